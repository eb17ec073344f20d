"""From recipe to report: DEM of tape-casting slurries, a surrogate that jumps to equilibrium, and what it is worth.

    snakemake --cores 2                                      demo scale, config/config.yaml
    snakemake --cores 2 --configfile config/reduced.yaml     another scale
    snakemake --cores 2 slurries                             one stage and what it needs; the targets are in this file
    snakemake --cores 2 evaluation                           what the predictions are worth, on the same results
    snakemake --cores 2 convergence                          whether the time step is small enough
    snakemake --cores 2 size --configfile config/size.yaml   why a network fails on larger slurries

Rules stand in workflow/rules in the order in which a particle passes through them; scripts/ has a script for each.
"""

from snakemake.utils import min_version

min_version("9.14.8")  # jobs on other nodes see the same configuration


configfile: "config/config.yaml"


include: "workflow/rules/common.smk"
include: "workflow/rules/dem.smk"
include: "workflow/rules/dataset.smk"
include: "workflow/rules/surrogate.smk"
include: "workflow/rules/hybrid.smk"
include: "workflow/rules/analysis.smk"
include: "workflow/rules/evaluation/noise.smk"
include: "workflow/rules/evaluation/accuracy.smk"
include: "workflow/rules/evaluation/cost.smk"
include: "workflow/rules/evaluation/uncertainty.smk"
include: "workflow/rules/studies.smk"
include: "workflow/rules/report.smk"


report: "workflow/report/workflow.rst"


# Jobs of seconds, which a queueing system would only delay.
localrules:
    all,
    slurries,
    models,
    microstructures,
    tables,
    noise,
    evaluation,
    convergence,
    size,
    generate_inputs,
    extract_frames,
    assemble_dataset,
    measure_packing,
    fit_surrogate,
    wrap_slurry,
    measure_equilibrium,
    check_training_range,
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
    measure_noise,
    compute_skill,
    compare_structure,
    compute_front,
    compare_at_equal_cost,
    fit_costs,
    compare_article_costs,
    plot_skill,
    plot_structure,
    plot_front,
    plot_relaxation,
    write_evaluation,
    compare_timesteps,
    plot_timesteps,
    compare_sizes,
    plot_sizes,


rule all:
    default_target: True
    input:
        f"{RESULTS}/report.html",
        f"{RESULTS}/config.yaml",
        f"{RESULTS}/versions.json",


rule slurries:
    input:
        expand(rules.extract_frames.output.frames, slurry=SLURRIES),


rule models:
    input:
        [model_of(surrogate) for surrogate in SURROGATES],


rule microstructures:
    input:
        expand(RELAXED, surrogate=SURROGATES, slurry=PREDICTED),


rule tables:
    input:
        rules.measure_density.output.table,
        rules.compare_coordinates.output.table,
        rules.compare_rdf.output.table,
        rules.measure_equilibrium.output.table,
        rules.check_training_range.output.table if TRAINING else [],
        rules.compare_costs.output.table,


rule noise:
    input:
        rules.measure_noise.output.table,


rule evaluation:
    input:
        rules.write_evaluation.output.page,


rule convergence:
    input:
        rules.compare_timesteps.output,
        rules.plot_timesteps.output.figure,


rule size:
    input:
        rules.compare_sizes.output.table,
        rules.compare_sizes.output.clock,
        rules.plot_sizes.output.figure,
