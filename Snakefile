"""From recipe to report: DEM of tape-casting slurries, a surrogate that jumps to equilibrium, and what it is worth.

    snakemake --cores 2                                      demo scale, config/config.yaml
    snakemake --cores 2 --configfile config/reduced.yaml     another scale
    snakemake --cores 2 slurries                             one stage and what it needs; the targets are in this file
    snakemake --cores 2 tapes                                what becomes of the slurries when they dry
    snakemake --cores 2 evaluation                           what the predictions are worth, on the same results
    snakemake --cores 2 convergence                          whether the time step is small enough
    snakemake --cores 1 design --configfile config/explore.yaml   many recipes, and then
    snakemake --cores 2 explore --configfile config/explore.yaml
    snakemake --cores 2 size --configfile config/size.yaml   why a network fails on larger slurries
    snakemake --cores 2 transfer --configfile config/transfer.yaml   what becomes of it on other recipes

Rules stand in workflow/rules in the order in which a particle passes through them; scripts/ has a script for each.
"""

from snakemake.utils import min_version

min_version("9.14.8")  # jobs on other nodes see the same configuration


include: "workflow/rules/configfiles.smk"


configfile: os.path.join(workflow.basedir, "config", "config.yaml")


include: "workflow/rules/common.smk"
include: "workflow/rules/dem.smk"
include: "workflow/rules/learning.smk"
include: "workflow/rules/dataset.smk"
include: "workflow/rules/surrogate.smk"
include: "workflow/rules/hybrid.smk"
include: "workflow/rules/tape/subjects.smk"
include: "workflow/rules/tape/drying.smk"
include: "workflow/rules/tape/microstructure.smk"
include: "workflow/rules/analysis.smk"
include: "workflow/rules/evaluation/subjects.smk"
include: "workflow/rules/evaluation/noise.smk"
include: "workflow/rules/evaluation/accuracy.smk"
include: "workflow/rules/evaluation/cost.smk"
include: "workflow/rules/evaluation/uncertainty.smk"
include: "workflow/rules/evaluation/tape.smk"
include: "workflow/rules/studies.smk"
include: "workflow/rules/transfer/subjects.smk"
include: "workflow/rules/transfer/recipes.smk"
include: "workflow/rules/explore/subjects.smk"
include: "workflow/rules/explore/points.smk"
include: "workflow/rules/report.smk"
include: "workflow/rules/preflight.smk"


# The only one, since a further one would replace it. Snakemake leaves it out in a dry-run.
onstart:
    drop_default_rate_limit()
    if workflow.is_main_process:
        check_earlier_results()
        check_restart_files()
        check_design()
        check_lammps()


report: "workflow/report/workflow.rst"


# Every target records the configuration and the versions with its results.
rule all:
    """Make the report."""
    default_target: True
    input:
        f"{RESULTS}/report.html",
        descriptions(SURROGATES),
        rules.record_run.output,
    localrule: True


rule slurries:
    """Run the DEM of every slurry that somebody needs."""
    input:
        expand(rules.extract_frames.output.frames, slurry=SIMULATED),
        rules.record_run.output,
    localrule: True


rule models:
    """Train or fit every surrogate."""
    input:
        [model_of(surrogate) for surrogate in SURROGATES],
        descriptions(SURROGATES),
        rules.record_run.output,
    localrule: True


rule microstructures:
    """Predict and relax every slurry that is not trained on."""
    input:
        expand(RELAXED, surrogate=SURROGATES, slurry=PREDICTED),
        rules.record_run.output,
    localrule: True


rule tapes:
    """Dry the slurries of each source."""
    input:
        lambda wildcards: tapes(rules.dry_slurry.output.dried),
        rules.measure_drying.output.table,
        rules.calibrate_drying.output.table,
        rules.tabulate_microstructure.output.table,
        expand(rules.render_tape.output.figure, slurry=PICTURED_TAPES),
        rules.plot_drying.output.figure,
        expand(rules.plot_tape.output.figure, slurry=SHOWN_TAPES),
        rules.record_run.output,
    localrule: True


rule tables:
    """Make all tables of the main job."""
    input:
        rules.measure_density.output.table,
        rules.compare_coordinates.output.table,
        rules.compare_rdf.output.table,
        rules.measure_equilibrium.output.table,
        rules.measure_relaxation.output.table,
        rules.check_training_range.output.table if RANGE_KNOWN else [],
        rules.compare_costs.output.table,
        rules.record_run.output,
    localrule: True


rule tape_evaluation:
    """Judge whether tapes are those of the DEM."""
    input:
        expand(rules.plot_verdicts.output.figure, verdicts="tape_verdicts"),
        rules.record_run.output,
    localrule: True


rule evaluation:
    """Evaluate the predictions."""
    input:
        rules.write_evaluation.output.page,
        descriptions(EVALUATED),
        rules.record_run.output,
    localrule: True


rule convergence:
    """Show whether the time step is small enough."""
    input:
        rules.compare_timesteps.output,
        rules.plot_timesteps.output.figure,
        rules.record_run.output,
    localrule: True


rule transfer:
    """Show whether surrogates are worth something on recipes that they were not trained on."""
    input:
        rules.compare_recipes.output.table,
        rules.plot_tuning.output.figure if TUNINGS else [],
        descriptions(EVALUATED),
        rules.record_run.output,
    localrule: True


rule size:
    """Compare predictions of slurries of several sizes."""
    input:
        rules.compare_sizes.output.table,
        rules.compare_sizes.output.clock,
        rules.plot_sizes.output.figure,
        rules.record_run.output,
    localrule: True


rule design:
    """Write the recipes of an exploration."""
    input:
        rules.write_design.output.table,
        rules.record_run.output,
    localrule: True


rule explore:
    """Compare tapes of many recipes."""
    input:
        explored_recipes,  # whose errors Snakemake would pass over below, where outputs are there
        rules.write_explore.output.page,
        rules.record_run.output,
    localrule: True
