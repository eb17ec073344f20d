"""How accurate the predictions are, beside the affine map and the noise of the DEM.

REQUIRED INPUTS:
    frames/{slurry}.h5
    hybrid/{surrogate}/{slurry}/predicted.h5, relaxed.h5; relaxed-<steps>.h5 by rule relax_slurry
    structure/{source}/{slurry}.csv, {slurry}_rdf.csv: by rule measure_structure in noise.smk
    costs/relax_slurry/, tables/noise.csv
    config[evaluation]

OUTPUTS:
    tables/skill.csv, structure_errors.csv, verdicts.csv, relaxation.csv
    figures/skill.png, verdicts.png, relaxation.png
"""


rule compute_skill:
    """Compute the skill of each prediction, between the affine map and the noise of the DEM."""
    input:
        **code("evaluation/compute_skill"),
        predicted=lambda wildcards: expand(rules.predict_slurry.output.predicted, surrogate=skilled(), slurry=HELD_OUT),
        frames=expand(rules.extract_frames.output.frames, slurry=HELD_OUT * len(ALL_TRACKED)),
        noise=rules.measure_noise.output.table,
    output:
        table=reported("tables/skill.csv", "skill", "Evaluation", table="skill"),
    log:
        f"{RESULTS}/logs/compute_skill.log",
    localrule: True
    conda:
        "../../../envs/analysis.yaml"
    params:
        target_frame=TARGET_FRAME,
    shell:
        "python {input.script:q} --predicted {input.predicted:q} --frames {input.frames:q} --noise {input.noise:q}"
        " --target-frame {params.target_frame} --table {output.table:q}"
        " 2>&1 | tee {log:q}"


rule compare_structure:
    """Compare the structure of predictions with that of the DEM and its noise."""
    input:
        **code("evaluation/compare_structure"),
        structure=expand(rules.measure_structure.output.structure, source=EVALUATED, slurry=HELD_OUT),
        rdf=expand(rules.measure_structure.output.rdf, source=EVALUATED, slurry=HELD_OUT),
        dem_structure=expand(rules.measure_structure.output.structure, source="dem", slurry=HELD_OUT),
        dem_rdf=expand(rules.measure_structure.output.rdf, source="dem", slurry=HELD_OUT),
        noise=rules.measure_noise.output.table,
        replica_rdf=rules.measure_noise.input.rdf,
    output:
        table=reported("tables/structure_errors.csv", "structure_errors", "Evaluation", table="structural errors"),
    log:
        f"{RESULTS}/logs/compare_structure.log",
    localrule: True
    conda:
        "../../../envs/analysis.yaml"
    shell:
        "python {input.script:q} --structure {input.structure:q} --rdf {input.rdf:q}"
        " --dem-structure {input.dem_structure:q} --dem-rdf {input.dem_rdf:q} --noise {input.noise:q}"
        " --replica-rdf {input.replica_rdf:q} --table {output.table:q}"
        " 2>&1 | tee {log:q}"


rule judge_structures:
    """Judge whether structures are inside the noise of the DEM."""
    input:
        **code("evaluation/judge_structures"),
        structure_errors=rules.compare_structure.output.table,
    output:
        table=reported("tables/verdicts.csv", "verdicts", "Evaluation", table="inside the noise"),
    log:
        f"{RESULTS}/logs/judge_structures.log",
    localrule: True
    conda:
        "../../../envs/analysis.yaml"
    params:
        slurries=with_role("test"),
    shell:
        "python {input.script:q} --structure-errors {input.structure_errors:q} --slurries {params.slurries:q}"
        " --table {output.table:q}"
        " 2>&1 | tee {log:q}"


rule compare_relaxation:
    """Compare relaxations of several lengths."""
    input:
        **code("evaluation/compare_relaxation"),
        relaxed=lambda wildcards: relaxed_for_steps(rules.relax_slurry.output.relaxed),
        costs=lambda wildcards: relaxed_for_steps(rules.relax_slurry.output.cost),
        structure=expand(rules.measure_structure.output.structure, source=EVALUATED, slurry=with_role("validation")),
        dem_structure=expand(rules.measure_structure.output.structure, source="dem", slurry=with_role("validation")),
        dem_rdf=expand(rules.measure_structure.output.rdf, source="dem", slurry=with_role("validation")),
        noise=rules.measure_noise.output.table,
        replica_rdf=rules.measure_noise.input.rdf,
    output:
        table=reported("tables/relaxation.csv", "relaxation", "Evaluation", table="length of the relaxation"),
    log:
        f"{RESULTS}/logs/compare_relaxation.log",
    conda:
        "../../../envs/analysis.yaml"
    resources:
        mem_mb=lambda wildcards, attempt: attempt * (1000 + max(map(particles, HELD_OUT)) // 20),
        # as structure_minutes, of all that are measured one after the other
        runtime=lambda wildcards, input, attempt: (
            attempt * (5 + len(input.relaxed) * max(map(particles, HELD_OUT)) // 10000)
        ),
    params:
        cutoff_um=config["analysis"]["rdf_cutoff_um"],
        bins=config["analysis"]["rdf_bins"],
    shell:
        "python {input.script:q} --relaxed {input.relaxed:q} --relaxation-costs {input.costs:q}"
        " --structure {input.structure:q} --dem-structure {input.dem_structure:q} --dem-rdf {input.dem_rdf:q}"
        " --noise {input.noise:q} --replica-rdf {input.replica_rdf:q} --cutoff-um {params.cutoff_um} --bins"
        " {params.bins} --table {output.table:q}"
        " 2>&1 | tee {log:q}"


rule plot_skill:
    """Draw the skill of each surrogate."""
    input:
        **code("evaluation/plot_skill"),
        skill=rules.compute_skill.output.table,
    output:
        figure=reported("figures/skill.png", "skill_figure", "Evaluation", figure="skill"),
    log:
        f"{RESULTS}/logs/plot_skill.log",
    localrule: True
    conda:
        "../../../envs/analysis.yaml"
    shell:
        "python {input.script:q} --skill {input.skill:q} --figure {output.figure:q} 2>&1 | tee {log:q}"


rule plot_verdicts:
    """Draw how far structures or tapes are from the DEM in units of its noise, and the verdicts."""
    input:
        **code("evaluation/plot_verdicts"),
        verdicts=f"{RESULTS}/tables/{{verdicts}}.csv",
    output:
        figure=reported("figures/{verdicts}.png", "verdicts_figure", "Evaluation", figure="{verdicts}"),
    log:
        f"{RESULTS}/logs/plot_verdicts/{{verdicts}}.log",
    localrule: True
    conda:
        "../../../envs/analysis.yaml"
    shell:
        "python {input.script:q} --verdicts {input.verdicts:q} --figure {output.figure:q} 2>&1 | tee {log:q}"


rule plot_relaxation:
    """Draw error against the length of the relaxation."""
    input:
        **code("evaluation/plot_relaxation"),
        relaxation=rules.compare_relaxation.output.table,
    output:
        figure=reported("figures/relaxation.png", "relaxation_figure", "Evaluation", figure="length of the relaxation"),
    log:
        f"{RESULTS}/logs/plot_relaxation.log",
    localrule: True
    conda:
        "../../../envs/analysis.yaml"
    shell:
        "python {input.script:q} --relaxation {input.relaxation:q} --figure {output.figure:q} 2>&1 | tee {log:q}"
