"""The tape: an equilibrated slurry dries.

REQUIRED INPUTS:
    frames/{slurry}.h5 where {source} is dem, hybrid/{source}/{slurry}/relaxed.h5 where it is a surrogate
    dem/{slurry}/inputs.json
    config[drying], config[relaxation]

OUTPUTS:
    tape/{source}/{slurry}/dried.data, dried.h5, drying.csv
    figures/render_tape_<slurry>.png of the first slurry that is dried
"""


rule dry_slurry:
    """Let the solvent leave a slurry in stages, and the tape come to rest."""
    input:
        **code("tape/dry_slurry"),
        lammps=lammps_scripts("dry"),
        structure=equilibrated,
        inputs=rules.generate_inputs.output.inputs,
    output:
        data=f"{RESULTS}/tape/{{source}}/{{slurry}}/dried.data",
        dried=f"{RESULTS}/tape/{{source}}/{{slurry}}/dried.h5",
        table=f"{RESULTS}/tape/{{source}}/{{slurry}}/drying.csv",
        cost=f"{RESULTS}/costs/dry_slurry/{{source}}/{{slurry}}.json",
    log:
        f"{RESULTS}/logs/dry_slurry/{{source}}/{{slurry}}.log",
    conda:
        "../../../envs/dem.yaml"
    threads: config["dem"]["ranks"]
    resources:
        **LAMMPS_JOB,
        mem_mb=slurry_mb,
        runtime=drying_minutes,
    params:
        settings=lambda wildcards: section(drying_settings(wildcards.slurry)),
        work=lambda wildcards: f"{RESULTS}/tape/{wildcards.source}/{wildcards.slurry}/work",
    shell:
        "python {input.script:q} --structure {input.structure:q} --inputs {input.inputs:q} --settings {params.settings:q}"
        " --work {params.work:q}"
        " --executable {resources.executable:q} --launcher={resources.mpi:q} --ranks {resources.tasks}"
        " --dried-data {output.data:q} --dried {output.dried:q} --table {output.table:q} --cost {output.cost:q}"
        " 2>&1 | tee {log:q}"


rule measure_drying:
    """Measure how near to rest each tape is at its end."""
    input:
        **code("tape/measure_drying"),
        dried=lambda wildcards: dried(rules.dry_slurry.output.dried),
    output:
        table=reported("tables/drying_ends.csv", "drying_ends", "Tape", table="rest at the end of the drying"),
    log:
        f"{RESULTS}/logs/measure_drying.log",
    localrule: True
    conda:
        "../../../envs/analysis.yaml"
    params:
        pressure_kpa=config["dem"]["pressure_kpa"],
        max_kinetic_share=config["relaxation"]["max_kinetic_share"],
        pressure_within=config["relaxation"]["pressure_within"],
        temperature_k=config["dem"]["temperature_k"],
    shell:
        "python {input.script:q} --dried {input.dried:q} --pressure-kpa {params.pressure_kpa}"
        " --max-kinetic-share {params.max_kinetic_share} --pressure-within {params.pressure_within}"
        " --temperature-k {params.temperature_k}"
        " --table {output.table:q}"
        " 2>&1 | tee {log:q}"


rule plot_drying:
    """Draw thickness and density while the solvent leaves."""
    input:
        **code("tape/plot_drying"),
        drying=lambda wildcards: tapes(rules.dry_slurry.output.table),
    output:
        figure=reported("figures/drying.png", "drying_figure", "Tape", figure="drying"),
    log:
        f"{RESULTS}/logs/plot_drying.log",
    localrule: True
    conda:
        "../../../envs/analysis.yaml"
    params:
        sources=lambda wildcards, input: [Path(table).parts[-3] for table in input.drying],
    shell:
        "python {input.script:q} --sources {params.sources:q} --drying {input.drying:q} --figure {output.figure:q} 2>&1 | tee {log:q}"


rule render_tape:
    """Draw a slurry and its tapes in 3D."""
    input:
        **code("tape/render_tape"),
        slurry=lambda wildcards: equilibrated(
            types.SimpleNamespace(source=pictured_source(wildcards.slurry), slurry=wildcards.slurry)
        ),
        tapes=lambda wildcards: expand(
            rules.dry_slurry.output.dried, source=sources_of(wildcards.slurry), slurry=wildcards.slurry
        ),
    output:
        figure=reported("figures/render_tape_{slurry}.png", "tape_pictures", "Tape", slurry="{slurry}", figure="3D"),
    log:
        f"{RESULTS}/logs/render_tape/{{slurry}}.log",
    conda:
        "../../../envs/analysis.yaml"
    resources:
        mem_mb=slurry_mb,
        runtime=structure_minutes,
    params:
        slurry_source=lambda wildcards: pictured_source(wildcards.slurry),
        sources=lambda wildcards: sources_of(wildcards.slurry),
    shell:
        "python {input.script:q} --slurry {input.slurry:q} --slurry-source {params.slurry_source:q}"
        " --sources {params.sources:q} --tapes {input.tapes:q} --figure {output.figure:q}"
        " 2>&1 | tee {log:q}"


rule calibrate_drying:
    """Dry one slurry at the ends of friction, and find the friction for a measured green density."""
    input:
        **code("tape/calibrate_drying"),
        lammps=lammps_scripts("dry"),
        structure=lambda wildcards: equilibrated(calibration_tape()),
        inputs=lambda wildcards: expand(rules.generate_inputs.output.inputs, slurry=calibration_tape().slurry),
    output:
        table=reported("tables/drying_calibration.csv", "drying_calibration", "Tape", table="calibration of the drying"),
        cost=f"{RESULTS}/costs/calibrate_drying.json",
    log:
        f"{RESULTS}/logs/calibrate_drying.log",
    conda:
        "../../../envs/dem.yaml"
    threads: config["dem"]["ranks"]
    resources:
        **LAMMPS_JOB,
        mem_mb=lambda wildcards, attempt: slurry_mb(calibration_tape(), attempt),
        runtime=lambda wildcards, attempt: (2 if GREEN is None else 9) * drying_minutes(calibration_tape(), attempt),
    params:
        settings=lambda wildcards: section(calibration_settings()),
        green=[] if GREEN is None else ["--green-density-g-cm3", GREEN],
        work=f"{RESULTS}/tape/calibration_work",
    shell:
        "python {input.script:q} --structure {input.structure:q} --inputs {input.inputs:q} --settings {params.settings:q}"
        " {params.green:q} --work {params.work:q}"
        " --executable {resources.executable:q} --launcher={resources.mpi:q} --ranks {resources.tasks}"
        " --table {output.table:q} --cost {output.cost:q}"
        " 2>&1 | tee {log:q}"
