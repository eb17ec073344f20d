"""Figures and the report, and what was run with which versions.

REQUIRED INPUTS:
    tables/, rdf/, frames/, dem/{slurry}/thermo.csv, inputs.json, run.json
    models/{surrogate}/, hybrid/{surrogate}/{slurry}/
    config, as a whole: it is shown

OUTPUTS:
    config.yaml, slurries.tsv, versions.json, versions/<name>.json
    figures/*.png
    report.html, evaluation.html
"""


rule record_run:
    """Record the effective configuration, the slurry table, the command and the versions."""
    input:
        **code("report/record_run"),
    output:
        config=f"{RESULTS}/config.yaml",
        slurries=f"{RESULTS}/slurries.tsv",
        versions=f"{RESULTS}/versions.json",
    log:
        f"{RESULTS}/logs/record_run.log",
    localrule: True
    conda:
        "../../envs/analysis.yaml"
    # Among the resources, since another command is no reason to record anew; other versions are.
    resources:
        command=lambda wildcards: shlex.join(["snakemake", *sys.argv[1:]]),
    params:
        config=lambda wildcards: section(WRITTEN),  # of a function, as it may hold braces
        slurries=lambda wildcards: section([slurry.row() for slurry in SLURRY_TABLE]),
        made_with=lambda wildcards: section(MADE_WITH),
        # not an output: while one under a new name is missing, Snakemake does not see that the others are old
        kept=f"{RESULTS}/versions/{VERSIONS}.json",
    shell:
        "python {input.script:q} --effective {params.config:q} --rows {params.slurries:q}"
        " --made-with {params.made_with:q} --command {resources.command:q} --config {output.config:q}"
        " --slurries {output.slurries:q} --versions {output.versions:q} --kept {params.kept:q}"
        " 2>&1 | tee {log:q}"


rule draw_rules:
    """Write the graph of the rules."""
    input:
        **code("report/draw_rules"),
        snakefile=project_file("Snakefile"),
        rules=sorted(map(project_file, Path(workflow.basedir, "workflow", "rules").rglob("*.smk"))),
        config=rules.record_run.output.config,
    output:
        rulegraph=f"{RESULTS}/figures/rulegraph.dot",
    log:
        f"{RESULTS}/logs/draw_rules.log",
    localrule: True
    conda:
        "../../envs/analysis.yaml"
    shell:
        "python {input.script:q} --snakefile {input.snakefile:q} --config {input.config:q} --rulegraph"
        " {output.rulegraph:q}"
        " 2>&1 | tee {log:q}"


rule plot_workflow:
    """Draw the graph of the rules."""
    input:
        **code("report/plot_workflow"),
        rulegraph=rules.draw_rules.output.rulegraph,
    output:
        figure=reported("figures/workflow.png", "rules", "Rules", figure="rules"),
    log:
        f"{RESULTS}/logs/plot_workflow.log",
    localrule: True
    conda:
        "../../envs/analysis.yaml"
    shell:
        "python {input.script:q} --rulegraph {input.rulegraph:q} --hide all record_run draw_rules plot_workflow"
        " --figure {output.figure:q}"
        " 2>&1 | tee {log:q}"


rule plot_densification:
    """Draw density against time."""
    input:
        **code("report/plot_densification"),
        thermo=expand(rules.run_slurry.output.thermo, slurry=SIMULATED),
        equilibrium=rules.measure_equilibrium.output.table,
    output:
        figure=reported("figures/densification.png", "densification", "DEM", figure="densification"),
    log:
        f"{RESULTS}/logs/plot_densification.log",
    localrule: True
    conda:
        "../../envs/analysis.yaml"
    params:
        slurries=SIMULATED,
        input_frames=INPUT_FRAMES,
        frame_interval_us=FRAME_STEPS * config["dem"]["timestep_us"],
    shell:
        "python {input.script:q} --slurries {params.slurries:q} --thermo {input.thermo:q}"
        " --equilibrium {input.equilibrium:q} --input-frames {params.input_frames} --frame-interval-us"
        " {params.frame_interval_us} --figure {output.figure:q}"
        " 2>&1 | tee {log:q}"


rule plot_learning_curves:
    """Draw the learning curves of a network."""
    input:
        **code("report/plot_learning_curves"),
        history=f"{RESULTS}/models/{{surrogate}}/history.csv",
        fit=fit_to_the_same_samples,
        errors=lambda wildcards: rules.compare_coordinates.output.table if shows_held_out(wildcards) else [],
    output:
        figure=reported(
            "figures/learning_curves_{surrogate}.png",
            "learning_curves",
            "Learning",
            surrogate="{surrogate}",
            figure="learning curves",
        ),
    log:
        f"{RESULTS}/logs/plot_learning_curves/{{surrogate}}.log",
    localrule: True
    conda:
        "../../envs/analysis.yaml"
    params:
        fit=lambda wildcards, input: ["--fit", input.fit] if input.fit else [],
        held_out=lambda wildcards, input: (
            ["--coordinate-errors", input.errors, "--test", *with_role("test")] if input.errors else []
        ),
        learns_from=lambda wildcards: KINDS[wildcards.surrogate].learns_from,  # for the caption, as the next one
        weights_of=lambda wildcards: KINDS[wildcards.surrogate].weights_epoch,
    shell:
        "python {input.script:q} --history {input.history:q} {params.fit:q} {params.held_out:q} --figure {output.figure:q}"
        " 2>&1 | tee {log:q}"


rule plot_coordinates:
    """Draw predicted against true coordinates of a slurry."""
    input:
        **code("report/plot_coordinates"),
        predicted=expand(rules.predict_slurry.output.predicted, surrogate=TRACKED, allow_missing=True),
        frames=rules.extract_frames.output.frames,
    output:
        figure=reported("figures/coordinates_{slurry}.png", "coordinates", "Coordinates", slurry="{slurry}"),
    log:
        f"{RESULTS}/logs/plot_coordinates/{{slurry}}.log",
    localrule: True
    conda:
        "../../envs/analysis.yaml"
    params:
        surrogates=TRACKED,
        target_frame=TARGET_FRAME,
    shell:
        "python {input.script:q} --surrogates {params.surrogates:q} --predicted {input.predicted:q}"
        " --frames {input.frames:q} --target-frame {params.target_frame} --figure {output.figure:q}"
        " 2>&1 | tee {log:q}"


rule render_slurry:
    """Draw target, prediction and relaxed structure in 3D."""
    input:
        **code("report/render_slurry"),
        predicted=rules.predict_slurry.output.predicted,
        relaxed=RELAXED,
        frames=target_frames,
    output:
        figure=reported(
            "figures/slurry_{surrogate}_{slurry}.png", "slurry", "Pictures", surrogate="{surrogate}", slurry="{slurry}"
        ),
    log:
        f"{RESULTS}/logs/render_slurry/{{surrogate}}/{{slurry}}.log",
    conda:
        "../../envs/analysis.yaml"
    resources:
        mem_mb=slurry_mb,
        runtime=structure_minutes,
    params:
        target=target_options,
    shell:
        "python {input.script:q} --predicted {input.predicted:q} --relaxed {input.relaxed:q} {params.target:q}"
        " --figure {output.figure:q}"
        " 2>&1 | tee {log:q}"


rule plot_density:
    """Draw the final density of DEM and hybrid chain."""
    input:
        **code("report/plot_density"),
        density=rules.measure_density.output.table,
    output:
        figure=reported("figures/density.png", "density", "Density", figure="density and volume"),
    log:
        f"{RESULTS}/logs/plot_density.log",
    localrule: True
    conda:
        "../../envs/analysis.yaml"
    params:
        surrogates=SURROGATES,
        slurries=PREDICTED,
    shell:
        "python {input.script:q} --density {input.density:q} --surrogates {params.surrogates:q} --slurries"
        " {params.slurries:q} --figure {output.figure:q}"
        " 2>&1 | tee {log:q}"


rule plot_rdf:
    """Draw the radial distribution functions."""
    input:
        **code("report/plot_rdf"),
        rdf=expand(rules.compute_rdf.output.rdf, surrogate=SURROGATES, slurry=PREDICTED),
        rdf_errors=rules.compare_rdf.output.table,
    output:
        figure=reported("figures/rdf.png", "rdf", "Structure", figure="radial distribution functions"),
    log:
        f"{RESULTS}/logs/plot_rdf.log",
    localrule: True
    conda:
        "../../envs/analysis.yaml"
    params:
        surrogates=SURROGATES,
        slurries=PREDICTED,
    shell:
        "python {input.script:q} --surrogates {params.surrogates:q} --slurries {params.slurries:q} --rdf {input.rdf:q}"
        " --rdf-errors {input.rdf_errors:q} --figure {output.figure:q}"
        " 2>&1 | tee {log:q}"


rule plot_costs:
    """Draw the wall time of the hybrid chain and of the DEM."""
    input:
        **code("report/plot_costs"),
        speedup=rules.compare_costs.output.table,
    output:
        figure=reported("figures/costs.png", "costs", "Cost", figure="cost"),
    log:
        f"{RESULTS}/logs/plot_costs.log",
    localrule: True
    conda:
        "../../envs/analysis.yaml"
    params:
        surrogates=SURROGATES,
    shell:
        "python {input.script:q} --speedup {input.speedup:q} --surrogates {params.surrogates:q}"
        " --figure {output.figure:q}"
        " 2>&1 | tee {log:q}"


rule write_report:
    """Write the report of the main job as one HTML page."""
    input:
        **code("report/write_report"),
        templates=page_templates("report"),
        config=rules.record_run.output.config,
        versions=rules.record_run.output.versions,
        inputs=expand(rules.generate_inputs.output.inputs, slurry=SLURRIES),
        runs=expand(rules.run_slurry.output.run, slurry=SIMULATED),
        density=rules.measure_density.output.table,
        coordinate_errors=rules.compare_coordinates.output.table,
        rdf_errors=rules.compare_rdf.output.table,
        equilibrium=rules.measure_equilibrium.output.table,
        relaxation_ends=rules.measure_relaxation.output.table,
        microstructure=rules.tabulate_microstructure.output.table if HAS_TAPES else [],
        drying_ends=rules.measure_drying.output.table if HAS_TAPES else [],
        drying_calibration=rules.calibrate_drying.output.table if HAS_TAPES else [],
        training_range=rules.check_training_range.output.table if RANGE_KNOWN else [],
        cost=rules.collect_costs.output.table,
        speedup=rules.compare_costs.output.table,
        models=expand(f"{RESULTS}/models/{{surrogate}}/model.keras", surrogate=LEARNED),
        histories=expand(f"{RESULTS}/models/{{surrogate}}/history.csv", surrogate=LEARNED),
        figures=[
            rules.plot_workflow.output.figure,
            *([rules.plot_densification.output.figure] if SIMULATED else []),
            *expand(rules.plot_learning_curves.output.figure, surrogate=LEARNED),
            *expand(rules.plot_coordinates.output.figure, slurry=HELD_OUT if TRACKED else []),
            *expand(rules.render_slurry.output.figure, surrogate=PICTURED, slurry=PREDICTED),
            rules.plot_density.output.figure,
            rules.plot_rdf.output.figure,
            *([rules.plot_costs.output.figure] if TRACKED or HELD_OUT else []),
            *expand(rules.render_tape.output.figure, slurry=PICTURED_TAPES),
            *([rules.plot_drying.output.figure] if HAS_TAPES else []),
            *expand(rules.plot_tape.output.figure, slurry=SHOWN_TAPES),
        ],
    output:
        report=reported("report.html", "report", "Report"),
    log:
        f"{RESULTS}/logs/write_report.log",
    localrule: True
    conda:
        "../../envs/analysis.yaml"
    params:
        roles=section({id: slurry.role for id, slurry in SLURRIES.items()}),
        formulations=section({id: slurry.formulation for id, slurry in SLURRIES.items()}),
        expected=section({id: formulations.expected_density_g_cm3(config_of(id)["formulation"]) for id in SLURRIES}),
        surrogates=SURROGATES,
        left_out=LEFT_OUT,
        optional=lambda wildcards, input: [
            word
            for name in ("microstructure", "drying_ends", "drying_calibration", "training_range")
            if input[name]
            for word in (f"--{name.replace('_', '-')}", input[name])
        ],
        models=lambda wildcards, input: [f"{label}={path}" for label, path in zip(LEARNED, input.models)],
        histories=lambda wildcards, input: [f"{label}={path}" for label, path in zip(LEARNED, input.histories)],
    shell:
        "python {input.script:q} --config {input.config:q} --versions {input.versions:q} --inputs {input.inputs:q}"
        " --run-json {input.runs:q} --roles {params.roles:q} --formulations {params.formulations:q} --expected-g-cm3 {params.expected:q}"
        " --left-out {params.left_out:q}"
        " --density {input.density:q} --coordinate-errors {input.coordinate_errors:q}"
        " --rdf-errors {input.rdf_errors:q} --equilibrium {input.equilibrium:q} --relaxation-ends"
        " {input.relaxation_ends:q} --cost-table {input.cost:q} --speedup {input.speedup:q}"
        " {params.optional:q} --surrogates {params.surrogates:q} --models"
        " {params.models:q} --histories {params.histories:q} --figures {input.figures:q} --report {output.report:q}"
        " 2>&1 | tee {log:q}"


rule write_evaluation:
    """Write the evaluation as one HTML page."""
    input:
        **code("evaluation/write_evaluation"),
        templates=page_templates("evaluation"),
        equilibrium=rules.measure_equilibrium.output.table,
        skill=rules.compute_skill.output.table,
        noise=rules.measure_noise.output.table,
        structure_errors=rules.compare_structure.output.table,
        verdicts=rules.judge_structures.output.table,
        front=rules.compute_front.output.table,
        equal_cost=rules.compare_at_equal_cost.output.table,
        cost_scaling=rules.fit_costs.output.table,
        article_costs=rules.compare_article_costs.output.table,
        ablation=rules.tabulate_ablation.output.table if HAS_ABLATION else [],
        relaxation=rules.compare_relaxation.output.table if HAS_RELAXATION else [],
        uncertainty=rules.measure_uncertainty.output.table if SPREADING else [],
        tape_errors=rules.compare_tapes.output.table if JUDGES_TAPES else [],
        tape_verdicts=rules.judge_tapes.output.table if JUDGES_TAPES else [],
        figures=[
            *expand(rules.render_slurry.output.figure, surrogate=PICTURED[:1], slurry=with_role("test")[:1]),
            *expand(
                rules.plot_verdicts.output.figure, verdicts=["verdicts", *(["tape_verdicts"] if JUDGES_TAPES else [])]
            ),
            rules.plot_skill.output.figure,
            rules.plot_front.output.figure,
            *([rules.plot_relaxation.output.figure] if HAS_RELAXATION else []),
            *([rules.plot_uncertainty.output.figure] if SPREADING else []),
        ],
    output:
        page=reported("evaluation.html", "evaluation", "Report"),
    log:
        f"{RESULTS}/logs/write_evaluation.log",
    localrule: True
    conda:
        "../../envs/analysis.yaml"
    params:
        run=config["run"]["name"],
        networks=[text for text, surrogate in KINDS.items() if surrogate.is_trained],
        optional=lambda wildcards, input: [
            word
            for name in ("ablation", "relaxation", "uncertainty", "tape_errors", "tape_verdicts")
            if input[name]
            for word in (f"--{name.replace('_', '-')}", input[name])
        ],
    shell:
        "python {input.script:q} --run {params.run:q} --networks {params.networks:q}"
        " --equilibrium {input.equilibrium:q} --skill {input.skill:q} --noise {input.noise:q}"
        " --structure-errors {input.structure_errors:q} --verdicts {input.verdicts:q} --front {input.front:q} --equal-cost {input.equal_cost:q}"
        " --cost-scaling {input.cost_scaling:q} --article-costs {input.article_costs:q} {params.optional:q}"
        " --figures {input.figures:q} --page {output.page:q}"
        " 2>&1 | tee {log:q}"
