"""What slurries and tapes are like inside: densities, shares, contacts, percolation, pores, mixing, tortuosity.

REQUIRED INPUTS:
    frames/{slurry}.h5 where {source} is dem, hybrid/{source}/{slurry}/relaxed.h5 where it is a surrogate
    tape/{source}/{slurry}/dried.h5
    dem/{slurry}/inputs.json
    config[drying], config[microstructure]

OUTPUTS:
    tape/{source}/{slurry}/{stage}.csv, {stage}_profile.csv, {stage}_pores.csv, {stage}_properties.json,
    {stage}_voxels.h5; {stage} is slurry or tape
    tables/microstructure.csv
    figures/pores_<slurry>.png of the first slurry that is dried
"""


rule measure_microstructure:
    """Measure the microstructure of a slurry or tape."""
    input:
        **code("tape/measure_microstructure"),
        structure=lambda wildcards: (
            equilibrated(wildcards)
            if wildcards.stage == "slurry"
            else expand(rules.dry_slurry.output.dried, source=wildcards.source, slurry=wildcards.slurry)
        ),
        inputs=rules.generate_inputs.output.inputs,
    output:
        table=f"{RESULTS}/tape/{{source}}/{{slurry}}/{{stage}}.csv",
        profile=f"{RESULTS}/tape/{{source}}/{{slurry}}/{{stage}}_profile.csv",
        pores=f"{RESULTS}/tape/{{source}}/{{slurry}}/{{stage}}_pores.csv",
        properties=f"{RESULTS}/tape/{{source}}/{{slurry}}/{{stage}}_properties.json",
        voxels=f"{RESULTS}/tape/{{source}}/{{slurry}}/{{stage}}_voxels.h5",
        cost=f"{RESULTS}/costs/measure_microstructure/{{source}}/{{slurry}}_{{stage}}.json",
    log:
        f"{RESULTS}/logs/measure_microstructure/{{source}}/{{slurry}}_{{stage}}.log",
    conda:
        "../../../envs/analysis.yaml"
    resources:
        mem_mb=microstructure_mb,
        runtime=microstructure_minutes,
    params:
        settings=microstructure_options,
    shell:
        "python {input.script:q} --structure {input.structure:q} --inputs {input.inputs:q} {params.settings:q}"
        " --table {output.table:q} --profile {output.profile:q} --pores {output.pores:q}"
        " --properties {output.properties:q}"
        " --voxels {output.voxels:q} --cost {output.cost:q}"
        " 2>&1 | tee {log:q}"


rule tabulate_microstructure:
    """Put the microstructures of all slurries and tapes into one table."""
    input:
        **code("tape/tabulate_microstructure"),
        microstructures=lambda wildcards: tapes(rules.measure_microstructure.output.table, stage=["slurry", "tape"]),
        replicas=expand(
            rules.measure_microstructure.output.table, source="dem", slurry=DRIED_REPLICAS, stage=["slurry", "tape"]
        ),
    output:
        table=reported("tables/microstructure.csv", "microstructure", "Tables", table="microstructures"),
    log:
        f"{RESULTS}/logs/tabulate_microstructure.log",
    localrule: True
    conda:
        "../../../envs/analysis.yaml"
    shell:
        "python {input.script:q} --microstructures {input.microstructures:q} --replicas {input.replicas:q}"
        " --table {output.table:q}"
        " 2>&1 | tee {log:q}"


rule plot_tape:
    """Draw the pore sizes of a tape, and the shares of its phases along z."""
    input:
        **code("tape/plot_tape"),
        pores=lambda wildcards: expand(
            rules.measure_microstructure.output.pores,
            source=sources_of(wildcards.slurry),
            slurry=wildcards.slurry,
            stage="tape",
        ),
        profiles=lambda wildcards: expand(
            rules.measure_microstructure.output.profile,
            source=sources_of(wildcards.slurry),
            slurry=wildcards.slurry,
            stage="tape",
        ),
    output:
        figure=reported("figures/pores_{slurry}.png", "pores_figure", "Tape", slurry="{slurry}", figure="tape"),
    log:
        f"{RESULTS}/logs/plot_tape/{{slurry}}.log",
    localrule: True
    conda:
        "../../../envs/analysis.yaml"
    params:
        sources=lambda wildcards: sources_of(wildcards.slurry),
    shell:
        "python {input.script:q} --sources {params.sources:q} --pores {input.pores:q} --profiles {input.profiles:q}"
        " --figure {output.figure:q}"
        " 2>&1 | tee {log:q}"
