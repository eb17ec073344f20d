"""From recipe to report: DEM of tape-casting slurries, a surrogate that jumps to equilibrium, and what it is worth.

    snakemake --cores 2                                      demo scale, config/config.yaml
    snakemake --cores 2 --configfile config/reduced.yaml     another scale
    snakemake --cores 2 slurries                             one stage and what it needs; the targets are in this file

Rules stand in workflow/rules in the order in which a particle passes through them; scripts/ has a script for each.
"""

from snakemake.utils import min_version

min_version("9.14.8")  # jobs on other nodes see the same configuration


configfile: "config/config.yaml"


include: "workflow/rules/configuration.smk"
include: "workflow/rules/dem.smk"
include: "workflow/rules/dataset.smk"
include: "workflow/rules/surrogate.smk"
include: "workflow/rules/hybrid.smk"
include: "workflow/rules/analysis.smk"
include: "workflow/rules/report.smk"


report: "workflow/report/workflow.rst"


# Jobs of a second or two, which a queueing system would only delay.
localrules:
    all,
    slurries,
    models,
    microstructures,
    tables,
    generate_inputs,
    assemble_dataset,
    wrap_slurry,
    measure_equilibrium,
    measure_density,
    compare_coordinates,
    compare_rdf,
    collect_costs,
    compare_costs,
    record_run,
    draw_rules,
    plot_workflow,
    plot_densification,
    plot_learning_curves,
    plot_coordinates,
    plot_density,
    plot_rdf,
    plot_costs,
    write_report,


rule all:
    default_target: True
    input:
        f"{RESULTS}/report.html",
        f"{RESULTS}/config.yaml",
        f"{RESULTS}/versions.json",


rule slurries:
    input:
        expand(f"{RESULTS}/frames/{{slurry}}.h5", slurry=SLURRIES),


rule models:
    input:
        expand(f"{RESULTS}/models/{{surrogate}}/model.keras", surrogate=SURROGATES),


rule microstructures:
    input:
        expand(f"{RESULTS}/hybrid/{{surrogate}}/{{slurry}}/relaxed.h5", surrogate=SURROGATES, slurry=PREDICTED),


rule tables:
    input:
        rules.measure_density.output.table,
        rules.compare_coordinates.output.table,
        rules.compare_rdf.output.table,
        rules.measure_equilibrium.output.table,
        rules.compare_costs.output.table,
