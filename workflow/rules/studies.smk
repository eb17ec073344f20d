"""Studies beside the main job: the ablation of vgg16_box, the time step of the DEM, the size of the slurries.

REQUIRED INPUTS:
    models/{surrogate}/history.csv, dataset/training.h5, tables/skill.csv: for the ablation
    dem/{slurry}/run.json, thermo.csv and structure/dem/{slurry}.csv, {slurry}_rdf.csv of the runs of
    config[convergence]: for the time step
    dem/{slurry}/thermo.csv, run.json, frames/{slurry}.h5, hybrid/{surrogate}/{slurry}/predicted.h5, relaxed.h5: for
    the size
    tables/equilibrium.csv

OUTPUTS:
    tables/ablation.csv, timestep.csv, timestep_summary.csv, size_errors.csv, size_clock.csv
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
        frames=lambda wildcards: expand(rules.extract_frames.output.frames, slurry=required("train") + HELD_OUT),
        runs=expand(rules.run_slurry.output.run, slurry=COMPLETE),
        thermo=expand(rules.run_slurry.output.thermo, slurry=COMPLETE),
        predicted=lambda wildcards: sized(rules.predict_slurry.output.predicted),
        relaxed=lambda wildcards: sized(RELAXED),
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
