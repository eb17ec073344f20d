"""Whether surrogates transfer to recipes that they were not trained on, and what it takes to teach them one.

REQUIRED INPUTS:
    tables/skill.csv, structure_errors.csv, tape_errors.csv
    models/{surrogate}/model.keras, frames/{slurry}.h5, dataset/packing_fraction of the recipe, tables/noise.csv
    config[transfer]

OUTPUTS:
    tables/recipes.csv, tuning.csv; figures/tuning.png
    tuning/{surrogate}_{start}_{number}.csv: errors of a surrogate trained on so many slurries of another recipe
"""


rule compare_recipes:
    """Compare what surrogates are worth on recipes that they were trained on and on others."""
    input:
        **code("transfer/compare_recipes"),
        skill=rules.compute_skill.output.table,
        structure_errors=rules.compare_structure.output.table,
        tape_errors=rules.compare_tapes.output.table if JUDGES_TAPES else [],
    output:
        table=reported("tables/recipes.csv", "recipes", "Transfer", table="recipes"),
    log:
        f"{RESULTS}/logs/compare_recipes.log",
    localrule: True
    conda:
        "../../../envs/analysis.yaml"
    params:
        tapes=lambda wildcards, input: ["--tape-errors", input.tape_errors] if input.tape_errors else [],
        recipes=section({id: SLURRIES[id].formulation for id in HELD_OUT}),
        roles=section({id: SLURRIES[id].role for id in HELD_OUT}),
        trained=section(sorted({SLURRIES[id].formulation for id in TRAINING})),
        elsewhere=section(recipes_elsewhere()),
    shell:
        "python {input.script:q} --skill {input.skill:q} --structure-errors {input.structure_errors:q}"
        " {params.tapes:q} --recipes {params.recipes:q} --roles {params.roles:q} --trained {params.trained:q}"
        " --elsewhere {params.elsewhere:q} --table {output.table:q}"
        " 2>&1 | tee {log:q}"


rule tune_surrogate:
    """Train a surrogate on a few slurries of another recipe, fine-tuned or from scratch."""
    input:
        **code("transfer/tune_surrogate", loads_surrogate=True),
        start_from=lambda wildcards: model_of(wildcards.surrogate) if wildcards.start == "fine_tuned" else [],
        frames=tuned_on,
        predicted=expand(
            rules.extract_frames.output.frames, slurry=model_checks.tuning_tests(config, SLURRIES.values())
        ),
        packing=tuning_packing,
        noise=rules.measure_noise.output.table,
    output:
        table=f"{RESULTS}/tuning/{{surrogate}}_{{start}}_{{number}}.csv",
        cost=f"{RESULTS}/costs/tune_surrogate/{{surrogate}}_{{start}}_{{number}}.json",
    log:
        f"{RESULTS}/logs/tune_surrogate/{{surrogate}}_{{start}}_{{number}}.log",
    conda:
        "../../../envs/learning.yaml"
    threads: lambda wildcards: config["surrogate"][LABELS[wildcards.surrogate].name]["threads"]
    resources:
        mem_mb=tuning_mb,
        runtime=tuning_minutes,
    params:
        settings=lambda wildcards: section(tuning_settings(wildcards)),
        seed=config["learning"]["seed"],
        started=lambda wildcards, input: ["--start-from", input.start_from] if input.start_from else [],
        input_frames=lambda wildcards: input_frames(wildcards.surrogate),
        target_frame=TARGET_FRAME,
        phases=lambda wildcards: phases_of(wildcards.surrogate) if wildcards.start == "fine_tuned" else PHASES,
        validation_share=config["learning"]["validation_share"],
        work=lambda wildcards: f"{RESULTS}/tuning/{wildcards.surrogate}_{wildcards.start}_{wildcards.number}",
    shell:
        "python {input.script:q} --surrogate {wildcards.surrogate:q} --settings {params.settings:q} --seed {params.seed}"
        " {params.started:q} --frames {input.frames:q} --predicted {input.predicted:q}"
        " --input-frames {params.input_frames} --target-frame {params.target_frame} --phases {params.phases:q}"
        " --validation-share {params.validation_share} --packing {input.packing:q} --noise {input.noise:q}"
        " --work {params.work:q} --table {output.table:q} --cost {output.cost:q}"
        " 2>&1 | tee {log:q}"


rule tabulate_tuning:
    """Tabulate the error against the number of slurries of another recipe that a surrogate was trained on."""
    input:
        **code("transfer/tabulate_tuning"),
        tunings=expand(f"{RESULTS}/tuning/{{tuning}}.csv", tuning=TUNINGS),
        costs=expand(f"{RESULTS}/costs/tune_surrogate/{{tuning}}.json", tuning=TUNINGS),
    output:
        table=reported("tables/tuning.csv", "tuning", "Transfer", table="tuning"),
    log:
        f"{RESULTS}/logs/tabulate_tuning.log",
    localrule: True
    conda:
        "../../../envs/analysis.yaml"
    shell:
        "python {input.script:q} --tunings {input.tunings:q} --costs {input.costs:q} --table {output.table:q}"
        " 2>&1 | tee {log:q}"


rule plot_tuning:
    """Draw skill against the number of slurries of another recipe that a surrogate was trained on."""
    input:
        **code("transfer/plot_tuning"),
        tuning=rules.tabulate_tuning.output.table,
    output:
        figure=reported("figures/tuning.png", "tuning_figure", "Transfer", figure="slurries of another recipe"),
    log:
        f"{RESULTS}/logs/plot_tuning.log",
    localrule: True
    conda:
        "../../../envs/analysis.yaml"
    shell:
        "python {input.script:q} --tuning {input.tuning:q} --figure {output.figure:q} 2>&1 | tee {log:q}"
