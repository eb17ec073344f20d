"""What is explored: the table of recipes, or an error for targets that need it where it is not there or not usable.

REQUIRED INPUTS:
    config[explore], the recipes that the Snakefile has read

OUTPUTS: functions and lists
"""

RECIPE_TABLE = exploration.table_path(config)
CONFIRMED = [id for id, point in POINTS.items() if point.is_confirmed]


def explored_ranges():
    """Section `explore.ranges`; an error, only for the target that needs them, if there are none."""
    if not config["explore"]["ranges"]:
        raise WorkflowError("explore.ranges = {}: must have at least one input for this target")
    return section(config["explore"]["ranges"])


def explored_recipes(wildcards):
    """The table of recipes; an error, only for targets that need it, if there is none."""
    if not exploration.is_on(config):
        raise WorkflowError("explore.ranges = {}: must have at least one input for this target, or set explore.recipes")
    if DESIGN_PROBLEMS:
        raise WorkflowError(
            *DESIGN_PROBLEMS,
            "Nothing was run. For another design change explore.ranges, explore.points or explore.particles and run "
            "snakemake --cores 1 design again.",
        )
    if not POINTS:
        raise WorkflowError(
            f"{RECIPE_TABLE}: no such file: run snakemake --cores 1 design with this configuration first"
        )
    return str(RECIPE_TABLE)


def explored_costs(wildcards):
    """Cost records of the jobs of all recipes."""
    return [
        *expand(rules.generate_inputs.output.cost, slurry=POINTS),
        *expand(
            [rules.predict_slurry.output.cost, rules.wrap_slurry.output.cost, RELAXATION_COST],
            surrogate="direct",
            slurry=POINTS,
        ),
        *expand([rules.run_slurry.output.cost, rules.extract_frames.output.cost], slurry=CONFIRMED),
        *(
            path
            for source, ids in (("direct", POINTS), ("dem", CONFIRMED))
            for path in expand(
                [rules.dry_slurry.output.cost, rules.measure_microstructure.output.cost],
                source=source,
                slurry=ids,
                stage="tape",
            )
        ),
    ]
