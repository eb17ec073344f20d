"""What the predictions cost, beside their errors and beside the full DEM.

REQUIRED INPUTS:
    costs/, dem/{slurry}/run.json
    tables/equilibrium.csv, speedup.csv, skill.csv, structure_errors.csv

OUTPUTS:
    tables/front.csv, equal_cost.csv, cost_scaling.csv, article_costs.csv
    figures/front.png
"""


rule compute_front:
    """Compute error against cost of each surrogate."""
    input:
        **code("evaluation/compute_front"),
        costs=[
            *expand(rules.generate_inputs.output.cost, slurry=PREDICTED),
            *expand(rules.extract_frames.output.cost, slurry=[slurry for slurry in PREDICTED if slurry in SIMULATED]),
            *expand(
                [rules.predict_slurry.output.cost, rules.wrap_slurry.output.cost, RELAXATION_COST],
                surrogate=EVALUATED,
                slurry=HELD_OUT,
            ),
        ],
        equilibrium=rules.measure_equilibrium.output.table,
        runs=expand(rules.run_slurry.output.run, slurry=HELD_OUT),
        structure_errors=rules.compare_structure.output.table,
    output:
        table=reported("tables/front.csv", "front", "Evaluation", table="error against cost"),
    log:
        f"{RESULTS}/logs/compute_front.log",
    localrule: True
    conda:
        "../../../envs/analysis.yaml"
    params:
        input_steps=input_steps(EVALUATED),
    shell:
        "python {input.script:q} --costs {input.costs:q} --equilibrium {input.equilibrium:q} --run-json {input.runs:q}"
        " --structure-errors {input.structure_errors:q} --input-steps {params.input_steps:q} --table {output.table:q}"
        " 2>&1 | tee {log:q}"


rule compare_at_equal_cost:
    """Compare each surrogate with early_dem at equal cost."""
    input:
        **code("evaluation/compare_at_equal_cost"),
        front=rules.compute_front.output.table,
        skill=rules.compute_skill.output.table,
    output:
        table=reported("tables/equal_cost.csv", "equal_cost", "Evaluation", table="early DEM at equal cost"),
    log:
        f"{RESULTS}/logs/compare_at_equal_cost.log",
    localrule: True
    conda:
        "../../../envs/analysis.yaml"
    shell:
        "python {input.script:q} --front {input.front:q} --skill {input.skill:q} --table {output.table:q}"
        " 2>&1 | tee {log:q}"


rule fit_costs:
    """Fit how cost grows with the number of particles, and when training pays back."""
    input:
        **code("evaluation/fit_costs"),
        costs=[
            *rules.compute_front.input.costs,
            *expand(
                [
                    rules.generate_inputs.output.cost,
                    rules.run_slurry.output.cost,
                    rules.extract_frames.output.cost,
                ],
                slurry=TRAINING,
            ),
            *expand(rules.assemble_dataset.output.cost, set=["training"] if TRAINING else []),
            *PACKING_COSTS,
            *model_costs([text for text in EVALUATED if KINDS[text].is_trained]),
            *expand(
                f"{RESULTS}/costs/fit_surrogate/{{surrogate}}.json",
                surrogate=[text for text in EVALUATED if KINDS[text].is_fitted],
            ),
        ],
        equilibrium=rules.measure_equilibrium.output.table,
        runs=expand(rules.run_slurry.output.run, slurry=HELD_OUT),
    output:
        table=reported("tables/cost_scaling.csv", "cost_scaling", "Evaluation", table="cost against size, and training"),
    log:
        f"{RESULTS}/logs/fit_costs.log",
    localrule: True
    conda:
        "../../../envs/analysis.yaml"
    params:
        input_steps=input_steps(EVALUATED),
        learning=[
            text
            for text, surrogate in KINDS.items()
            if surrogate.is_learned or (surrogate.needs_packing_fraction and not PACKING_GIVEN)
        ],
        elsewhere=[text for text in KINDS if text in ADOPTED or start_of(text)],
    shell:
        "python {input.script:q} --costs {input.costs:q} --equilibrium {input.equilibrium:q} --run-json {input.runs:q}"
        " --input-steps {params.input_steps:q} --learns-from-dem {params.learning:q}"
        " --trained-elsewhere {params.elsewhere:q} --table {output.table:q}"
        " 2>&1 | tee {log:q}"


rule compare_article_costs:
    """Compare the cost with that of the reference article."""
    input:
        **code("evaluation/compare_article_costs"),
        speedup=rules.compare_costs.output.table,
        equilibrium=rules.measure_equilibrium.output.table,
    output:
        table=reported(
            "tables/article_costs.csv", "article_costs", "Evaluation", table="cost as the reference article claims it"
        ),
    log:
        f"{RESULTS}/logs/compare_article_costs.log",
    localrule: True
    conda:
        "../../../envs/analysis.yaml"
    shell:
        "python {input.script:q} --speedup {input.speedup:q} --equilibrium {input.equilibrium:q}"
        " --table {output.table:q}"
        " 2>&1 | tee {log:q}"


rule plot_front:
    """Draw error against cost."""
    input:
        **code("evaluation/plot_front"),
        front=rules.compute_front.output.table,
        skill=rules.compute_skill.output.table,
        structure_errors=rules.compare_structure.output.table,
        equilibrium=rules.measure_equilibrium.output.table,
        speedup=rules.compare_costs.output.table,
    output:
        figure=reported("figures/front.png", "front_figure", "Evaluation", figure="error against cost"),
    log:
        f"{RESULTS}/logs/plot_front.log",
    localrule: True
    conda:
        "../../../envs/analysis.yaml"
    shell:
        "python {input.script:q} --front {input.front:q} --skill {input.skill:q}"
        " --structure-errors {input.structure_errors:q} --equilibrium {input.equilibrium:q} --speedup {input.speedup:q}"
        " --figure {output.figure:q}"
        " 2>&1 | tee {log:q}"
