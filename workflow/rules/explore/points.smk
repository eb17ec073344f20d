"""Many recipes: a design, a tape of each by `direct`, and what lies in between.

REQUIRED INPUTS:
    config[explore]
    the table of recipes, results/<run>/design.csv or config[explore][recipes]; the Snakefile reads it when it is parsed
    tape/direct/{slurry}/tape.csv of each recipe, tape/dem/{slurry}/tape.csv of those that are confirmed
    costs/

OUTPUTS:
    design.csv
    tables/explore.csv, explore_noise.csv, explore_costs.csv, explore_models.csv, explore_left_out.csv,
    explore_indices.csv, explore_nearest.csv, explore_confirmation.csv
    explore/maps.csv
    figures/explore_maps.png, explore_fits.png
    explore.html
"""


rule write_design:
    """Write recipes that fill the ranges, for the Snakefile to read."""
    input:
        **code("explore/write_design"),
    output:
        table=f"{RESULTS}/design.csv",
    log:
        f"{RESULTS}/logs/write_design.log",
    localrule: True
    conda:
        "../../../envs/analysis.yaml"
    params:
        ranges=lambda wildcards: explored_ranges(),
        share_total=exploration.share_total(WRITTEN, config["explore"]["ranges"]),
        points=config["explore"]["points"],
        replicas=config["explore"]["replicas"],
        confirmations=config["explore"]["confirmations"],
        seed=config["explore"]["seed"],
    shell:
        "python {input.script:q} --ranges {params.ranges:q} --share-total {params.share_total}"
        " --points {params.points} --replicas {params.replicas} --confirmations {params.confirmations}"
        " --seed {params.seed} --table {output.table:q}"
        " 2>&1 | tee {log:q}"


rule tabulate_points:
    """Put recipes and properties into one table, and measure the noise."""
    input:
        **code("explore/tabulate_points"),
        recipes=explored_recipes,
        tapes=expand(rules.measure_microstructure.output.table, source="direct", slurry=POINTS, stage="tape"),
        costs=explored_costs,
    output:
        table=reported("tables/explore.csv", "explore_table", "Exploration", table="recipes"),
        noise=reported("tables/explore_noise.csv", "explore_noise", "Exploration", table="noise"),
        costs=reported("tables/explore_costs.csv", "explore_costs", "Exploration", table="costs"),
    log:
        f"{RESULTS}/logs/tabulate_points.log",
    localrule: True
    conda:
        "../../../envs/analysis.yaml"
    params:
        properties=config["explore"]["properties"],
        costs=f"{RESULTS}/costs",  # their paths would not fit on a command line
    shell:
        "python {input.script:q} --recipes {input.recipes:q} --tapes {input.tapes:q} --properties {params.properties:q}"
        " --costs {params.costs:q} --table {output.table:q} --noise {output.noise:q} --cost-table {output.costs:q}"
        " 2>&1 | tee {log:q}"


rule fit_properties:
    """Fit each property over the inputs: errors, indices, maps, and the recipes nearest to the target."""
    input:
        **code("explore/fit_properties"),
        table=rules.tabulate_points.output.table,
        noise=rules.tabulate_points.output.noise,
    output:
        models=reported("tables/explore_models.csv", "explore_models", "Exploration", table="errors"),
        left_out=reported("tables/explore_left_out.csv", "explore_left_out", "Exploration", table="left out"),
        indices=reported("tables/explore_indices.csv", "explore_indices", "Exploration", table="indices"),
        nearest=reported("tables/explore_nearest.csv", "explore_nearest", "Exploration", table="nearest"),
        maps=f"{RESULTS}/explore/maps.csv",
    log:
        f"{RESULTS}/logs/fit_properties.log",
    conda:
        "../../../envs/analysis.yaml"
    resources:
        # a fit holds some matrices of points x points, and takes seconds for 100 points and minutes for 1000
        mem_mb=lambda wildcards, attempt: attempt * (2000 + len(POINTS) ** 2 // 1000),
        runtime=lambda wildcards, attempt: attempt * (10 + len(config["explore"]["properties"]) * len(POINTS) // 50),
    params:
        target=section(config["explore"]["target"]),
        seed=config["explore"]["seed"],
    shell:
        "python {input.script:q} --explore {input.table:q} --explore-noise {input.noise:q} --target {params.target:q}"
        " --seed {params.seed} --models {output.models:q} --left-out {output.left_out:q} --indices {output.indices:q}"
        " --nearest {output.nearest:q} --maps {output.maps:q}"
        " 2>&1 | tee {log:q}"


rule confirm_points:
    """Compare tapes of `direct` with those of the full DEM."""
    input:
        **code("explore/confirm_points"),
        direct=expand(rules.measure_microstructure.output.table, source="direct", slurry=CONFIRMED, stage="tape"),
        dem=expand(rules.measure_microstructure.output.table, source="dem", slurry=CONFIRMED, stage="tape"),
        noise=rules.tabulate_points.output.noise,
    output:
        table=reported("tables/explore_confirmation.csv", "explore_confirmation", "Exploration", table="confirmation"),
    log:
        f"{RESULTS}/logs/confirm_points.log",
    localrule: True
    conda:
        "../../../envs/analysis.yaml"
    params:
        slurries=CONFIRMED,
    shell:
        "python {input.script:q} --slurries {params.slurries:q} --direct {input.direct:q} --dem {input.dem:q}"
        " --explore-noise {input.noise:q} --table {output.table:q}"
        " 2>&1 | tee {log:q}"


rule plot_maps:
    """Draw the maps of the properties."""
    input:
        **code("explore/plot_maps"),
        table=rules.tabulate_points.output.table,
        noise=rules.tabulate_points.output.noise,
        models=rules.fit_properties.output.models,
        maps=rules.fit_properties.output.maps,
    output:
        figure=reported("figures/explore_maps.png", "explore_maps_figure", "Exploration", figure="maps"),
    log:
        f"{RESULTS}/logs/plot_maps.log",
    localrule: True
    conda:
        "../../../envs/analysis.yaml"
    shell:
        "python {input.script:q} --explore {input.table:q} --explore-noise {input.noise:q}"
        " --explore-models {input.models:q} --maps {input.maps:q} --figure {output.figure:q}"
        " 2>&1 | tee {log:q}"


rule plot_fits:
    """Draw each recipe as computed, and as expected from the others."""
    input:
        **code("explore/plot_fits"),
        noise=rules.tabulate_points.output.noise,
        left_out=rules.fit_properties.output.left_out,
    output:
        figure=reported("figures/explore_fits.png", "explore_fits_figure", "Exploration", figure="left out"),
    log:
        f"{RESULTS}/logs/plot_fits.log",
    localrule: True
    conda:
        "../../../envs/analysis.yaml"
    shell:
        "python {input.script:q} --explore-noise {input.noise:q} --explore-left-out {input.left_out:q}"
        " --figure {output.figure:q}"
        " 2>&1 | tee {log:q}"


rule write_explore:
    """Write the page of the exploration."""
    input:
        **code("explore/write_explore"),
        templates=page_templates("explore"),
        table=rules.tabulate_points.output.table,
        noise=rules.tabulate_points.output.noise,
        costs=rules.tabulate_points.output.costs,
        models=rules.fit_properties.output.models,
        indices=rules.fit_properties.output.indices,
        nearest=rules.fit_properties.output.nearest,
        confirmation=rules.confirm_points.output.table if CONFIRMED else [],
        figures=[rules.plot_maps.output.figure, rules.plot_fits.output.figure],
    output:
        page=reported("explore.html", "explore_page", "Report"),
    log:
        f"{RESULTS}/logs/write_explore.log",
    localrule: True
    conda:
        "../../../envs/analysis.yaml"
    params:
        run=config["run"]["name"],
        confirmation=lambda wildcards, input: (
            ["--explore-confirmation", input.confirmation] if input.confirmation else []
        ),
    shell:
        "python {input.script:q} --run {params.run:q} --explore {input.table:q} --explore-noise {input.noise:q}"
        " --explore-costs {input.costs:q} --explore-models {input.models:q} --explore-indices {input.indices:q}"
        " --explore-nearest {input.nearest:q} {params.confirmation:q} --figures {input.figures:q} --page {output.page:q}"
        " 2>&1 | tee {log:q}"
