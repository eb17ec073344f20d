"""The noise of the DEM: how far runs with other seeds differ, and how far a slightly perturbed run drifts away.

REQUIRED INPUTS:
    dem/{slurry}/frame_<k>.restart, run.json, inputs.json, coefficients.lmp
    frames/{slurry}.h5, also of replicas
    hybrid/{surrogate}/{slurry}/predicted.h5, relaxed.h5
    config[evaluation]

OUTPUTS:
    perturbed/{slurry}.h5
    structure/{source}/{slurry}.csv, {slurry}_rdf.csv: of the DEM or a surrogate
    tables/noise.csv
"""


rule run_perturbed:
    """Run the DEM again from the last input frame with slightly displaced particles."""
    input:
        **code("evaluation/run_perturbed"),
        lammps=lammps_scripts("displace", "slurry"),
        run=rules.run_slurry.output.run,
        frames=rules.extract_frames.output.frames,
        inputs=rules.generate_inputs.output.inputs,
        coefficients=rules.generate_inputs.output.coefficients,
        restart=rules.run_slurry.output.restart,
    output:
        perturbed=f"{RESULTS}/perturbed/{{slurry}}.h5",
    log:
        f"{RESULTS}/logs/run_perturbed/{{slurry}}.log",
    conda:
        "../../../envs/dem.yaml"
    threads: config["dem"]["ranks"]
    resources:
        **LAMMPS_JOB,
        budgeted=int(BUDGETED),
        mem_mb=slurry_mb,
        runtime=dem_minutes,
    params:
        first_frame=max(INPUT_FRAMES),
        target_frame=TARGET_FRAME,
        displacement_um=config["evaluation"]["perturbation_um"],
        work=lambda wildcards: f"{RESULTS}/perturbed/{wildcards.slurry}_work",
        attempts=lambda wildcards: f"{RESULTS}/logs/run_perturbed/{wildcards.slurry}",
    shell:
        "python {input.script:q} --restart {input.restart:q} --inputs {input.inputs:q}"
        " --coefficients {input.coefficients:q} --run {input.run:q} --frames {input.frames:q}"
        " --first-frame {params.first_frame} --target-frame {params.target_frame} --displacement-um {params.displacement_um} --work {params.work:q}"
        " --executable {resources.executable:q} --launcher={resources.mpi:q} --ranks {resources.tasks}"
        " --budget-min $(({resources.runtime} * {resources.budgeted})) --attempts {params.attempts:q}"
        " --perturbed {output.perturbed:q}"
        " 2>&1 | tee {log:q}"


rule measure_structure:
    """Measure contacts, overlaps and RDF of a structure from the DEM or a surrogate."""
    input:
        unpack(structure_options),
        **code("evaluation/measure_structure"),
    output:
        structure=f"{RESULTS}/structure/{{source}}/{{slurry}}.csv",
        rdf=f"{RESULTS}/structure/{{source}}/{{slurry}}_rdf.csv",
    log:
        f"{RESULTS}/logs/measure_structure/{{source}}/{{slurry}}.log",
    conda:
        "../../../envs/analysis.yaml"
    resources:
        mem_mb=slurry_mb,
        runtime=structure_minutes,
    params:
        stores=lambda wildcards, input: (
            ["--dem", input.dem, "--target-frame", TARGET_FRAME]
            if wildcards.source == "dem"
            else ["--predicted", input.predicted, "--relaxed", input.relaxed]
        ),
        cutoff_um=config["analysis"]["rdf_cutoff_um"],
        bins=config["analysis"]["rdf_bins"],
    shell:
        "python {input.script:q} {params.stores:q} --cutoff-um {params.cutoff_um} --bins {params.bins}"
        " --structure {output.structure:q} --rdf {output.rdf:q}"
        " 2>&1 | tee {log:q}"


rule measure_noise:
    """Measure how far replicas and perturbed runs of the DEM differ."""
    input:
        **code("evaluation/measure_noise"),
        structure=expand(rules.measure_structure.output.structure, source="dem", slurry=EVALUATED_REPLICAS),
        rdf=expand(rules.measure_structure.output.rdf, source="dem", slurry=EVALUATED_REPLICAS),
        perturbed=lambda wildcards: expand(rules.run_perturbed.output.perturbed, slurry=replicated()),
        frames=lambda wildcards: expand(rules.extract_frames.output.frames, slurry=replicated()),
    output:
        table=reported("tables/noise.csv", "noise", "Evaluation", table="noise of the DEM"),
    log:
        f"{RESULTS}/logs/measure_noise.log",
    localrule: True
    conda:
        "../../../envs/analysis.yaml"
    params:
        target_frame=TARGET_FRAME,
    shell:
        "python {input.script:q} --structure {input.structure:q} --rdf {input.rdf:q} --perturbed {input.perturbed:q}"
        " --frames {input.frames:q} --target-frame {params.target_frame} --table {output.table:q}"
        " 2>&1 | tee {log:q}"
