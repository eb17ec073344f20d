"""What is measured on the microstructures, and what each stage cost.

REQUIRED INPUTS:
    dem/{slurry}/thermo.csv, run.json
    frames/{slurry}.h5
    hybrid/{surrogate}/{slurry}/predicted.h5, relaxed.h5
    costs/
    config[analysis], config[relaxation]

OUTPUTS:
    rdf/{surrogate}/{slurry}.csv tables/density_volume.csv, coordinate_errors.csv, rdf_errors.csv, equilibrium.csv,
    relaxation_ends.csv, training_range.csv, cost.csv, speedup.csv
"""


rule measure_equilibrium:
    """Find when each DEM reached equilibrium, and how much its density still drifts."""
    input:
        **code("analysis/measure_equilibrium"),
        runs=expand(rules.run_slurry.output.run, slurry=SIMULATED),
        thermo=expand(rules.run_slurry.output.thermo, slurry=SIMULATED),
    output:
        table=reported("tables/equilibrium.csv", "equilibrium", "Tables", table="equilibrium"),
        cost=f"{RESULTS}/costs/measure_equilibrium.json",
    log:
        f"{RESULTS}/logs/measure_equilibrium.log",
    localrule: True
    conda:
        "../../envs/analysis.yaml"
    params:
        roles=[SLURRIES[slurry].role for slurry in SIMULATED],
        max_density_drift=config["dem"]["max_density_drift"],
    shell:
        "python {input.script:q} --run-json {input.runs:q} --thermo {input.thermo:q} --roles {params.roles:q}"
        " --max-density-drift {params.max_density_drift} --table {output.table:q} --cost {output.cost:q}"
        " 2>&1 | tee {log:q}"


rule measure_relaxation:
    """Find how near to rest each relaxed structure is."""
    input:
        **code("analysis/measure_relaxation"),
        relaxed=expand(RELAXED, surrogate=SURROGATES, slurry=PREDICTED),
    output:
        table=reported("tables/relaxation_ends.csv", "relaxation_ends", "Tables", table="ends of relaxations"),
        cost=f"{RESULTS}/costs/measure_relaxation.json",
    log:
        f"{RESULTS}/logs/measure_relaxation.log",
    localrule: True
    conda:
        "../../envs/analysis.yaml"
    params:
        pressure_kpa=config["dem"]["pressure_kpa"],
        max_kinetic_share=config["relaxation"]["max_kinetic_share"],
        pressure_within=config["relaxation"]["pressure_within"],
        temperature_k=config["dem"]["temperature_k"],
    shell:
        "python {input.script:q} --relaxed {input.relaxed:q} --pressure-kpa {params.pressure_kpa} --max-kinetic-share"
        " {params.max_kinetic_share} --pressure-within {params.pressure_within}"
        " --temperature-k {params.temperature_k} --table {output.table:q}"
        " --cost {output.cost:q}"
        " 2>&1 | tee {log:q}"


rule check_training_range:
    """Find predicted slurries outside the range of the training slurries, if there are any."""
    input:
        **code("analysis/check_training_range"),
        training=expand(rules.extract_frames.output.frames, slurry=TRAINING),
        adopted=expand(f"{RESULTS}/models/{{surrogate}}/trained_on.json", surrogate=ADOPTED),
        predicted=expand(rules.extract_frames.output.frames, slurry=PREDICTED),
    output:
        table=reported("tables/training_range.csv", "training_range", "Tables", table="training range"),
        cost=f"{RESULTS}/costs/check_training_range.json",
    log:
        f"{RESULTS}/logs/check_training_range.log",
    localrule: True
    conda:
        "../../envs/analysis.yaml"
    params:
        models=lambda wildcards, input: [f"{label}={path}" for label, path in zip(ADOPTED, input.adopted)],
        roles=[SLURRIES[slurry].role for slurry in PREDICTED],
        last_input_frame=max(INPUT_FRAMES),
        first_frame_seen=first_frame_seen(),
    shell:
        "python {input.script:q} --training {input.training:q} --models {params.models:q}"
        " --predicted {input.predicted:q} --roles {params.roles:q}"
        " --last-input-frame {params.last_input_frame} --first-frame-seen {params.first_frame_seen}"
        " --table {output.table:q} --cost {output.cost:q}"
        " 2>&1 | tee {log:q}"


rule measure_density:
    """Measure density and volume of the final microstructures."""
    input:
        **code("analysis/measure_density"),
        frames=expand(rules.extract_frames.output.frames, slurry=COMPLETE),
        relaxed=expand(RELAXED, surrogate=SURROGATES, slurry=PREDICTED),
    output:
        table=reported("tables/density_volume.csv", "density_volume", "Tables", table="density and volume"),
        cost=f"{RESULTS}/costs/measure_density.json",
    log:
        f"{RESULTS}/logs/measure_density.log",
    localrule: True
    conda:
        "../../envs/analysis.yaml"
    params:
        target_frame=TARGET_FRAME,
    shell:
        "python {input.script:q} --frames {input.frames:q} --relaxed {input.relaxed:q} --target-frame"
        " {params.target_frame} --table {output.table:q} --cost {output.cost:q}"
        " 2>&1 | tee {log:q}"


rule compare_coordinates:
    """Compare predicted coordinates with those of the DEM."""
    input:
        **code("analysis/compare_coordinates"),
        predicted=expand(rules.predict_slurry.output.predicted, surrogate=TRACKED, slurry=HELD_OUT),
        frames=expand(rules.extract_frames.output.frames, slurry=HELD_OUT * len(TRACKED)),
    output:
        table=reported("tables/coordinate_errors.csv", "coordinate_errors", "Tables", table="coordinate errors"),
        cost=f"{RESULTS}/costs/compare_coordinates.json",
    log:
        f"{RESULTS}/logs/compare_coordinates.log",
    localrule: True
    conda:
        "../../envs/analysis.yaml"
    params:
        target_frame=TARGET_FRAME,
    shell:
        "python {input.script:q} --predicted {input.predicted:q} --frames {input.frames:q} --target-frame"
        " {params.target_frame} --table {output.table:q} --cost {output.cost:q}"
        " 2>&1 | tee {log:q}"


rule compute_rdf:
    """Compute the RDF of target, prediction and relaxed structure."""
    input:
        **code("analysis/compute_rdf"),
        predicted=rules.predict_slurry.output.predicted,
        relaxed=RELAXED,
        frames=target_frames,
    output:
        rdf=f"{RESULTS}/rdf/{{surrogate}}/{{slurry}}.csv",
        cost=f"{RESULTS}/costs/compute_rdf/{{surrogate}}/{{slurry}}.json",
    log:
        f"{RESULTS}/logs/compute_rdf/{{surrogate}}/{{slurry}}.log",
    conda:
        "../../envs/analysis.yaml"
    resources:
        mem_mb=slurry_mb,
        runtime=structure_minutes,
    params:
        target=target_options,
        cutoff_um=config["analysis"]["rdf_cutoff_um"],
        bins=config["analysis"]["rdf_bins"],
        pair=rdf_pair,
    shell:
        "python {input.script:q} --predicted {input.predicted:q} --relaxed {input.relaxed:q}"
        " {params.target:q} --cutoff-um {params.cutoff_um} --bins {params.bins} {params.pair:q}"
        " --rdf {output.rdf:q} --cost {output.cost:q}"
        " 2>&1 | tee {log:q}"


rule compare_rdf:
    """Compare the RDF of relaxed structures with that of the DEM."""
    input:
        **code("analysis/compare_rdf"),
        rdf=expand(rules.compute_rdf.output.rdf, surrogate=SURROGATES, slurry=HELD_OUT),
    output:
        table=reported("tables/rdf_errors.csv", "rdf_errors", "Tables", table="RDF differences"),
        cost=f"{RESULTS}/costs/compare_rdf.json",
    log:
        f"{RESULTS}/logs/compare_rdf.log",
    localrule: True
    conda:
        "../../envs/analysis.yaml"
    shell:
        "python {input.script:q} --rdf {input.rdf:q} --table {output.table:q} --cost {output.cost:q} 2>&1 | tee {log:q}"


rule collect_costs:
    """Collect the cost of all jobs of the main job."""
    input:
        **code("analysis/collect_costs"),
        costs=[
            *expand(rules.generate_inputs.output.cost, slurry=[*SLURRIES, *DRIED_REPLICAS]),
            *expand(rules.run_slurry.output.cost, slurry=[*SIMULATED, *DRIED_REPLICAS]),
            *expand(rules.extract_frames.output.cost, slurry=[*SIMULATED, *DRIED_REPLICAS]),
            *expand(rules.assemble_dataset.output.cost, set=["training"] if TRAINING else []),
            *(PACKING_COSTS if BOXED else []),
            *model_costs(LEARNED),
            *expand(f"{RESULTS}/costs/fit_surrogate/{{surrogate}}.json", surrogate=FITTED),
            *expand(
                [
                    rules.predict_slurry.output.cost,
                    rules.wrap_slurry.output.cost,
                    RELAXATION_COST,
                    rules.compute_rdf.output.cost,
                ],
                surrogate=SURROGATES,
                slurry=PREDICTED,
            ),
            *([f"{RESULTS}/costs/calibrate_drying.json"] if HAS_TAPES else []),
            *(dried(f"{RESULTS}/costs/dry_slurry/{{source}}/{{slurry}}.json") if HAS_TAPES else []),
            *(
                dried(
                    f"{RESULTS}/costs/measure_microstructure/{{source}}/{{slurry}}_{{stage}}.json",
                    stage=["slurry", "tape"],
                )
                if HAS_TAPES
                else []
            ),
            rules.measure_equilibrium.output.cost,
            rules.measure_relaxation.output.cost,
            *([rules.check_training_range.output.cost] if RANGE_KNOWN else []),
            rules.measure_density.output.cost,
            rules.compare_coordinates.output.cost,
            rules.compare_rdf.output.cost,
        ],
        runs=expand(rules.run_slurry.output.run, slurry=SIMULATED),
    output:
        table=reported("tables/cost.csv", "cost", "Tables", table="cost"),
    log:
        f"{RESULTS}/logs/collect_costs.log",
    localrule: True
    conda:
        "../../envs/analysis.yaml"
    params:
        input_steps=max(INPUT_FRAMES) * FRAME_STEPS,
    shell:
        "python {input.script:q} --costs {input.costs:q} --run-json {input.runs:q} --input-steps {params.input_steps}"
        " --table {output.table:q}"
        " 2>&1 | tee {log:q}"


rule compare_costs:
    """Compare the cost of the hybrid chain with that of the full DEM."""
    input:
        **code("analysis/compare_costs"),
        cost=rules.collect_costs.output.table,
        equilibrium=rules.measure_equilibrium.output.table,
        runs=expand(rules.run_slurry.output.run, slurry=SIMULATED),
    output:
        table=reported("tables/speedup.csv", "speedup", "Tables", table="speed-up"),
    log:
        f"{RESULTS}/logs/compare_costs.log",
    localrule: True
    conda:
        "../../envs/analysis.yaml"
    params:
        input_steps=input_steps(SURROGATES),
    shell:
        "python {input.script:q} --cost-table {input.cost:q} --equilibrium {input.equilibrium:q}"
        " --run-json {input.runs:q} --input-steps {params.input_steps:q} --table {output.table:q}"
        " 2>&1 | tee {log:q}"
