"""Studies beside the main job: the ablation of vgg16_box, the time step of the DEM, the size of the slurries, recipes.

REQUIRED INPUTS:
    models/{surrogate}/history.csv, dataset/training.h5, tables/skill.csv: for the ablation
    dem/{slurry}/run.json, thermo.csv and structure/dem/{slurry}.csv, {slurry}_rdf.csv of the runs of
    config[convergence]: for the time step
    dem/{slurry}/thermo.csv, run.json, frames/{slurry}.h5, hybrid/{surrogate}/{slurry}/predicted.h5, relaxed.h5: for
    the size
    tables/skill.csv, structure_errors.csv, tape_errors.csv; models/{surrogate}/model.keras, dataset/packing_fraction of
    a recipe, tables/noise.csv and config[transfer]: for the recipes
    tables/equilibrium.csv

OUTPUTS:
    tables/ablation.csv, timestep.csv, timestep_summary.csv, size_errors.csv, size_clock.csv, recipes.csv, tuning.csv
    figures/timesteps.png, sizes.png
"""

if HAS_ABLATION:

    rule tabulate_ablation:
        """Compare networks that differ from vgg16_box in one step."""
        input:
            **code("studies/tabulate_ablation"),
            histories=expand(f"{RESULTS}/models/{{surrogate}}/history.csv", surrogate=ABLATION),
            dataset=TRAINING_SET,
            skill=rules.compute_skill.output.table,
        output:
            table=reported("tables/ablation.csv", "ablation", "Evaluation", table="ablation"),
        log:
            f"{RESULTS}/logs/tabulate_ablation.log",
        conda:
            "../../envs/analysis.yaml"
        params:
            surrogates=ABLATION,
            roles=section({id: SLURRIES[id].role for id in HELD_OUT}),
        shell:
            "python {input.script:q} --surrogates {params.surrogates:q} --histories {input.histories:q}"
            " --dataset {input.dataset:q} --skill {input.skill:q} --roles {params.roles:q} --table {output.table:q}"
            " 2>&1 | tee {log:q}"


rule compare_timesteps:
    """Compare DEM runs of several time steps and seeds."""
    input:
        **code("studies/compare_timesteps"),
        runs=lambda wildcards: expand(rules.run_slurry.output.run, slurry=timestep_runs()),
        thermo=lambda wildcards: expand(rules.run_slurry.output.thermo, slurry=timestep_runs()),
        structure=lambda wildcards: expand(
            rules.measure_structure.output.structure, source="dem", slurry=timestep_runs()
        ),
        rdf=lambda wildcards: expand(rules.measure_structure.output.rdf, source="dem", slurry=timestep_runs()),
    output:
        runs=reported("tables/timestep.csv", "timestep", "Convergence", table="runs"),
        summary=reported("tables/timestep_summary.csv", "timestep_summary", "Convergence", table="time steps"),
    log:
        f"{RESULTS}/logs/compare_timesteps.log",
    localrule: True
    conda:
        "../../envs/analysis.yaml"
    params:
        max_density_difference=config["convergence"]["max_density_difference"],
    shell:
        "python {input.script:q} --run-json {input.runs:q} --thermo {input.thermo:q} --structure {input.structure:q}"
        " --rdf {input.rdf:q} --max-density-difference {params.max_density_difference} --runs {output.runs:q}"
        " --summary {output.summary:q}"
        " 2>&1 | tee {log:q}"


rule plot_timesteps:
    """Draw the end of the DEM against its time step."""
    input:
        **code("studies/plot_timesteps"),
        runs=rules.compare_timesteps.output.runs,
        summary=rules.compare_timesteps.output.summary,
        equilibrium=rules.measure_equilibrium.output.table,
    output:
        figure=reported("figures/timesteps.png", "timesteps", "Convergence", figure="time steps"),
    log:
        f"{RESULTS}/logs/plot_timesteps.log",
    localrule: True
    conda:
        "../../envs/analysis.yaml"
    params:
        max_density_difference=config["convergence"]["max_density_difference"],
    shell:
        "python {input.script:q} --runs {input.runs:q} --summary {input.summary:q} --equilibrium {input.equilibrium:q}"
        " --max-density-difference {params.max_density_difference} --figure {output.figure:q}"
        " 2>&1 | tee {log:q}"


rule compare_sizes:
    """Compare volume errors and barostat clocks of slurries of several sizes."""
    input:
        **code("studies/compare_sizes"),
        frames=expand(rules.extract_frames.output.frames, slurry=TRAINING + HELD_OUT),
        runs=expand(rules.run_slurry.output.run, slurry=COMPLETE),
        thermo=expand(rules.run_slurry.output.thermo, slurry=COMPLETE),
        predicted=expand(rules.predict_slurry.output.predicted, surrogate=TRACKED, slurry=HELD_OUT),
        relaxed=expand(RELAXED, surrogate=TRACKED, slurry=HELD_OUT),
        equilibrium=rules.measure_equilibrium.output.table,
    output:
        table=reported("tables/size_errors.csv", "size_errors", "Size", table="volume errors"),
        clock=reported("tables/size_clock.csv", "size_clock", "Size", table="clock of the barostat"),
    log:
        f"{RESULTS}/logs/compare_sizes.log",
    localrule: True
    conda:
        "../../envs/analysis.yaml"
    params:
        last_input_frame=max(INPUT_FRAMES),
        target_frame=TARGET_FRAME,
    shell:
        "python {input.script:q} --frames {input.frames:q} --run-json {input.runs:q} --thermo {input.thermo:q}"
        " --predicted {input.predicted:q} --relaxed {input.relaxed:q} --equilibrium {input.equilibrium:q}"
        " --last-input-frame {params.last_input_frame} --target-frame {params.target_frame} --table {output.table:q}"
        " --clock {output.clock:q}"
        " 2>&1 | tee {log:q}"


rule plot_sizes:
    """Draw the volume error against the number of particles."""
    input:
        **code("studies/plot_sizes"),
        table=rules.compare_sizes.output.table,
    output:
        figure=reported("figures/sizes.png", "size_figure", "Size", figure="volume error against size"),
    log:
        f"{RESULTS}/logs/plot_sizes.log",
    localrule: True
    conda:
        "../../envs/analysis.yaml"
    params:
        table=lambda wildcards, input: f"{config['run']['name']}={input.table}",
    shell:
        "python {input.script:q} --tables {params.table:q} --figure {output.figure:q} 2>&1 | tee {log:q}"


rule compare_recipes:
    """Compare what surrogates are worth on recipes that they were trained on and on others."""
    input:
        **code("studies/compare_recipes"),
        skill=rules.compute_skill.output.table,
        structure_errors=rules.compare_structure.output.table,
        tape_errors=rules.compare_tapes.output.table if JUDGES_TAPES else [],
    output:
        table=reported("tables/recipes.csv", "recipes", "Transfer", table="recipes"),
    log:
        f"{RESULTS}/logs/compare_recipes.log",
    localrule: True
    conda:
        "../../envs/analysis.yaml"
    params:
        tapes=lambda wildcards, input: ["--tape-errors", input.tape_errors] if input.tape_errors else [],
        recipes=section({id: SLURRIES[id].formulation for id in HELD_OUT}),
        roles=section({id: SLURRIES[id].role for id in HELD_OUT}),
        trained=section(sorted({SLURRIES[id].formulation for id in TRAINING})),
    shell:
        "python {input.script:q} --skill {input.skill:q} --structure-errors {input.structure_errors:q}"
        " {params.tapes:q} --recipes {params.recipes:q} --roles {params.roles:q} --trained {params.trained:q}"
        " --table {output.table:q}"
        " 2>&1 | tee {log:q}"


TUNING = config["transfer"]["networks"] if config["transfer"]["slurries"] and TRAINING_NEEDED else {}
TUNINGS = [
    f"{surrogate}_{start}_{count}"
    for surrogate in TUNING
    for start in ("stored", "nothing")
    for count in config["transfer"]["counts"]
    if count or start == "stored"
]


wildcard_constraints:
    start="stored|nothing",
    number="[0-9]+",


def tuned_on(wildcards):
    """Slurries of another recipe that a surrogate is trained on."""
    return expand(rules.extract_frames.output.frames, slurry=config["transfer"]["slurries"][: int(wildcards.number)])


def tuning_packing(wildcards):
    """Packing fraction of the recipe that a surrogate is tuned to."""
    return expand(rules.measure_packing.output.packing, recipe=packing_file(config["transfer"]["slurries"][0]))


def tuning_settings(wildcards):
    """Settings of a surrogate with epochs and learning rate of this training."""
    own = config["surrogate"][LABELS[wildcards.surrogate].name] | TUNING[wildcards.surrogate][wildcards.start]
    return section({key: value for key, value in own.items() if key != "start_from"})


rule tune_surrogate:
    """Train a surrogate on a few slurries of another recipe, from its model or from nothing."""
    input:
        **code("studies/tune_surrogate", loads_surrogate=True),
        start_from=lambda wildcards: model_of(wildcards.surrogate) if wildcards.start == "stored" else [],
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
        "../../envs/learning.yaml"
    threads: lambda wildcards: config["surrogate"][LABELS[wildcards.surrogate].name]["threads"]
    resources:
        mem_mb=training_mb,
        runtime=training_minutes,
    params:
        settings=tuning_settings,
        seed=config["learning"]["seed"],
        started=lambda wildcards, input: ["--start-from", input.start_from] if input.start_from else [],
        input_frames=lambda wildcards: input_frames(wildcards.surrogate),
        target_frame=TARGET_FRAME,
        phases=PHASES,
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
        **code("studies/tabulate_tuning"),
        tunings=expand(f"{RESULTS}/tuning/{{tuning}}.csv", tuning=TUNINGS),
        costs=expand(f"{RESULTS}/costs/tune_surrogate/{{tuning}}.json", tuning=TUNINGS),
    output:
        table=reported("tables/tuning.csv", "tuning", "Transfer", table="tuning"),
    log:
        f"{RESULTS}/logs/tabulate_tuning.log",
    localrule: True
    conda:
        "../../envs/analysis.yaml"
    shell:
        "python {input.script:q} --tunings {input.tunings:q} --costs {input.costs:q} --table {output.table:q}"
        " 2>&1 | tee {log:q}"
