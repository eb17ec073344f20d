"""What the predictions are measured against: the noise of the DEM, its limit, and the cheapest alternatives.

REQUIRED INPUTS:
    frames/{slurry}.h5, of replicas too; dem/{slurry}/frame_<k>.restart, run.json, inputs.json, coefficients.lmp
    models/{surrogate}/history.csv, dataset/training.h5: for the ablation
    hybrid/{surrogate}/{slurry}/predicted.h5, relaxed.h5
    costs/, tables/equilibrium.csv, cost.csv, speedup.csv
    config[evaluation]

OUTPUTS:
    perturbed/{slurry}.h5
    structure/{source}/{slurry}.csv, {slurry}_rdf.csv: of the DEM or a surrogate
    hybrid/{surrogate}/{slurry}/relaxed-<steps>.h5, by rule relax_slurry
    tables/noise.csv, skill.csv, structure_errors.csv, front.csv, equal_cost.csv, cost_scaling.csv, article_costs.csv,
    ablation.csv, relaxation.csv, uncertainty.csv
    models/{surrogate}/calibration.json
    figures/skill.png, structure.png, front.png, relaxation.png, uncertainty.png; evaluation.html
"""

EVALUATED = list(LABELS)
ABLATION = [text for text, label in LABELS.items() if label.name in ("vgg16", "vgg16_box")]
HAS_ABLATION = TRAINING_NEEDED and any(LABELS[text].settings for text in ABLATION)
HAS_RELAXATION = bool(RELAXATION_STEPS and with_role("validation"))


rule run_perturbed:
    input:
        script="scripts/evaluation/run_perturbed.py",
        modules=modules("scripts/evaluation/run_perturbed.py"),
        lammps=expand("scripts/lammps/{script}.lmp", script=["displace", "slurry"]),
        run=rules.run_slurry.output.run,
        frames=rules.extract_frames.output.frames,
        inputs=rules.generate_inputs.output.inputs,
        coefficients=rules.generate_inputs.output.coefficients,
        restart=f"{RESULTS}/dem/{{slurry}}/frame_{max(INPUT_FRAMES)}.restart",
    output:
        perturbed=f"{RESULTS}/perturbed/{{slurry}}.h5",
        cost=f"{RESULTS}/costs/run_perturbed/{{slurry}}.json",
    log:
        f"{RESULTS}/logs/run_perturbed/{{slurry}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/run_perturbed/{{slurry}}.tsv"
    conda:
        "../../envs/dem.yaml"
    threads: config["dem"]["ranks"]
    # How LAMMPS is started stands among the resources, as in run_slurry.
    resources:
        budgeted=int(BUDGETED),
        mpi=config["dem"]["launcher"] if config["dem"]["ranks"] > 1 else "",  # Slurm wants no launcher for one task
        tasks=config["dem"]["ranks"],
        cpus_per_task=1,
        executable=config["dem"]["executable"],
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
        " --coefficients {input.coefficients:q} --frames {input.frames:q} --first-frame {params.first_frame}"
        " --target-frame {params.target_frame} --displacement-um {params.displacement_um} --work {params.work:q}"
        " --executable {resources.executable:q} --launcher={resources.mpi:q} --ranks {resources.tasks}"
        " --budget-min $(({resources.runtime} * {resources.budgeted})) --attempts {params.attempts:q}"
        " --perturbed {output.perturbed:q} --cost {output.cost:q}"
        " 2>&1 | tee {log:q}"


rule measure_structure:
    input:
        unpack(structure_options),
        script="scripts/evaluation/measure_structure.py",
        modules=modules("scripts/evaluation/measure_structure.py"),
    output:
        structure=f"{RESULTS}/structure/{{source}}/{{slurry}}.csv",
        rdf=f"{RESULTS}/structure/{{source}}/{{slurry}}_rdf.csv",
        cost=f"{RESULTS}/costs/measure_structure/{{source}}/{{slurry}}.json",
    log:
        f"{RESULTS}/logs/measure_structure/{{source}}/{{slurry}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/measure_structure/{{source}}/{{slurry}}.tsv"
    conda:
        "../../envs/analysis.yaml"
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
        " --structure {output.structure:q} --rdf {output.rdf:q} --cost {output.cost:q}"
        " 2>&1 | tee {log:q}"


rule measure_noise:
    input:
        script="scripts/evaluation/measure_noise.py",
        modules=modules("scripts/evaluation/measure_noise.py"),
        structure=expand(rules.measure_structure.output.structure, source="dem", slurry=REPLICAS),
        rdf=expand(rules.measure_structure.output.rdf, source="dem", slurry=REPLICAS),
        perturbed=lambda wildcards: expand(rules.run_perturbed.output.perturbed, slurry=replicated()),
        frames=lambda wildcards: expand(rules.extract_frames.output.frames, slurry=replicated()),
    output:
        table=report(
            f"{RESULTS}/tables/noise.csv",
            caption="../report/noise.rst",
            category="Evaluation",
            labels={"table": "noise of the DEM"},
        ),
        cost=f"{RESULTS}/costs/measure_noise.json",
    log:
        f"{RESULTS}/logs/measure_noise.log",
    benchmark:
        f"{RESULTS}/benchmarks/measure_noise.tsv"
    conda:
        "../../envs/analysis.yaml"
    params:
        target_frame=TARGET_FRAME,
    shell:
        "python {input.script:q} --structure {input.structure:q} --rdf {input.rdf:q} --perturbed {input.perturbed:q}"
        " --frames {input.frames:q} --target-frame {params.target_frame} --table {output.table:q} --cost {output.cost:q}"
        " 2>&1 | tee {log:q}"


rule compute_skill:
    input:
        script="scripts/evaluation/compute_skill.py",
        modules=modules("scripts/evaluation/compute_skill.py"),
        predicted=expand(rules.predict_slurry.output.predicted, surrogate=EVALUATED, slurry=HELD_OUT),
        frames=expand(rules.extract_frames.output.frames, slurry=HELD_OUT * len(EVALUATED)),
        noise=rules.measure_noise.output.table,
    output:
        table=report(
            f"{RESULTS}/tables/skill.csv",
            caption="../report/skill.rst",
            category="Evaluation",
            labels={"table": "skill"},
        ),
        cost=f"{RESULTS}/costs/compute_skill.json",
    log:
        f"{RESULTS}/logs/compute_skill.log",
    benchmark:
        f"{RESULTS}/benchmarks/compute_skill.tsv"
    conda:
        "../../envs/analysis.yaml"
    params:
        target_frame=TARGET_FRAME,
    shell:
        "python {input.script:q} --predicted {input.predicted:q} --frames {input.frames:q} --noise {input.noise:q}"
        " --target-frame {params.target_frame} --table {output.table:q} --cost {output.cost:q}"
        " 2>&1 | tee {log:q}"


rule compare_structure:
    input:
        script="scripts/evaluation/compare_structure.py",
        modules=modules("scripts/evaluation/compare_structure.py"),
        structure=expand(rules.measure_structure.output.structure, source=EVALUATED, slurry=HELD_OUT),
        rdf=expand(rules.measure_structure.output.rdf, source=EVALUATED, slurry=HELD_OUT),
        dem_structure=expand(rules.measure_structure.output.structure, source="dem", slurry=HELD_OUT),
        dem_rdf=expand(rules.measure_structure.output.rdf, source="dem", slurry=HELD_OUT),
        noise=rules.measure_noise.output.table,
        replica_rdf=rules.measure_noise.input.rdf,
    output:
        table=report(
            f"{RESULTS}/tables/structure_errors.csv",
            caption="../report/structure_errors.rst",
            category="Evaluation",
            labels={"table": "structural errors"},
        ),
        cost=f"{RESULTS}/costs/compare_structure.json",
    log:
        f"{RESULTS}/logs/compare_structure.log",
    benchmark:
        f"{RESULTS}/benchmarks/compare_structure.tsv"
    conda:
        "../../envs/analysis.yaml"
    shell:
        "python {input.script:q} --structure {input.structure:q} --rdf {input.rdf:q}"
        " --dem-structure {input.dem_structure:q} --dem-rdf {input.dem_rdf:q} --noise {input.noise:q}"
        " --replica-rdf {input.replica_rdf:q}"
        " --table {output.table:q} --cost {output.cost:q}"
        " 2>&1 | tee {log:q}"


rule compute_front:
    input:
        script="scripts/evaluation/compute_front.py",
        modules=modules("scripts/evaluation/compute_front.py"),
        costs=[
            *expand([rules.generate_inputs.output.cost, rules.extract_frames.output.cost], slurry=PREDICTED),
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
        table=report(
            f"{RESULTS}/tables/front.csv",
            caption="../report/front.rst",
            category="Evaluation",
            labels={"table": "error against cost"},
        ),
    log:
        f"{RESULTS}/logs/compute_front.log",
    benchmark:
        f"{RESULTS}/benchmarks/compute_front.tsv"
    conda:
        "../../envs/analysis.yaml"
    params:
        input_steps=input_steps(EVALUATED),
    shell:
        "python {input.script:q} --costs {input.costs:q} --equilibrium {input.equilibrium:q} --run-json {input.runs:q}"
        " --structure-errors {input.structure_errors:q} --input-steps {params.input_steps:q} --table {output.table:q}"
        " 2>&1 | tee {log:q}"


rule compare_at_equal_cost:
    input:
        script="scripts/evaluation/compare_at_equal_cost.py",
        modules=modules("scripts/evaluation/compare_at_equal_cost.py"),
        front=rules.compute_front.output.table,
        skill=rules.compute_skill.output.table,
    output:
        table=report(
            f"{RESULTS}/tables/equal_cost.csv",
            caption="../report/equal_cost.rst",
            category="Evaluation",
            labels={"table": "early DEM at equal cost"},
        ),
    log:
        f"{RESULTS}/logs/compare_at_equal_cost.log",
    benchmark:
        f"{RESULTS}/benchmarks/compare_at_equal_cost.tsv"
    conda:
        "../../envs/analysis.yaml"
    shell:
        "python {input.script:q} --front {input.front:q} --skill {input.skill:q} --table {output.table:q}"
        " 2>&1 | tee {log:q}"


rule fit_costs:
    input:
        script="scripts/evaluation/fit_costs.py",
        modules=modules("scripts/evaluation/fit_costs.py"),
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
            *([rules.assemble_dataset.output.cost] if TRAINING_NEEDED else []),
            rules.measure_packing.output.cost,
            *expand(
                f"{RESULTS}/costs/{SOURCE_OF_MODELS}/{{surrogate}}.json",
                surrogate=[text for text in EVALUATED if MODULES[text].MODEL_FILE == "model.keras"],
            ),
            *expand(
                f"{RESULTS}/costs/fit_surrogate/{{surrogate}}.json",
                surrogate=[text for text in EVALUATED if MODULES[text].MODEL_FILE == "model.json"],
            ),
        ],
        equilibrium=rules.measure_equilibrium.output.table,
        runs=expand(rules.run_slurry.output.run, slurry=HELD_OUT),
    output:
        table=report(
            f"{RESULTS}/tables/cost_scaling.csv",
            caption="../report/cost_scaling.rst",
            category="Evaluation",
            labels={"table": "cost against size, and training"},
        ),
    log:
        f"{RESULTS}/logs/fit_costs.log",
    benchmark:
        f"{RESULTS}/benchmarks/fit_costs.tsv"
    conda:
        "../../envs/analysis.yaml"
    params:
        input_steps=input_steps(EVALUATED),
        learning=[
            text
            for text, module in MODULES.items()
            if module.MODEL_FILE or (module.BOX_RULE == "mean_packing_fraction" and not PACKING_GIVEN)
        ],
    shell:
        "python {input.script:q} --costs {input.costs:q} --equilibrium {input.equilibrium:q} --run-json {input.runs:q}"
        " --input-steps {params.input_steps:q} --learns-from-dem {params.learning:q} --table {output.table:q}"
        " 2>&1 | tee {log:q}"


rule compare_article_costs:
    input:
        script="scripts/evaluation/compare_article_costs.py",
        modules=modules("scripts/evaluation/compare_article_costs.py"),
        speedup=rules.compare_costs.output.table,
        equilibrium=rules.measure_equilibrium.output.table,
    output:
        table=report(
            f"{RESULTS}/tables/article_costs.csv",
            caption="../report/article_costs.rst",
            category="Evaluation",
            labels={"table": "cost as the reference article claims it"},
        ),
    log:
        f"{RESULTS}/logs/compare_article_costs.log",
    benchmark:
        f"{RESULTS}/benchmarks/compare_article_costs.tsv"
    conda:
        "../../envs/analysis.yaml"
    shell:
        "python {input.script:q} --speedup {input.speedup:q} --equilibrium {input.equilibrium:q} --table {output.table:q}"
        " 2>&1 | tee {log:q}"


if HAS_ABLATION:

    rule tabulate_ablation:
        input:
            script="scripts/studies/tabulate_ablation.py",
            modules=modules("scripts/studies/tabulate_ablation.py"),
            histories=expand(f"{RESULTS}/models/{{surrogate}}/history.csv", surrogate=ABLATION),
            dataset=rules.assemble_dataset.output.dataset,
            skill=rules.compute_skill.output.table,
        output:
            table=report(
                f"{RESULTS}/tables/ablation.csv",
                caption="../report/ablation.rst",
                category="Evaluation",
                labels={"table": "ablation"},
            ),
            cost=f"{RESULTS}/costs/tabulate_ablation.json",
        log:
            f"{RESULTS}/logs/tabulate_ablation.log",
        benchmark:
            f"{RESULTS}/benchmarks/tabulate_ablation.tsv"
        conda:
            "../../envs/analysis.yaml"
        params:
            surrogates=ABLATION,
            roles=section({id: SLURRIES[id].role for id in HELD_OUT}),
        shell:
            "python {input.script:q} --surrogates {params.surrogates:q} --histories {input.histories:q}"
            " --dataset {input.dataset:q} --skill {input.skill:q} --roles {params.roles:q}"
            " --table {output.table:q} --cost {output.cost:q}"
            " 2>&1 | tee {log:q}"


rule compare_relaxation:
    input:
        script="scripts/evaluation/compare_relaxation.py",
        modules=modules("scripts/evaluation/compare_relaxation.py"),
        relaxed=lambda wildcards: relaxed_for_steps(rules.relax_slurry.output.relaxed),
        costs=lambda wildcards: relaxed_for_steps(rules.relax_slurry.output.cost),
        structure=expand(rules.measure_structure.output.structure, source=EVALUATED, slurry=with_role("validation")),
        dem_structure=expand(rules.measure_structure.output.structure, source="dem", slurry=with_role("validation")),
        dem_rdf=expand(rules.measure_structure.output.rdf, source="dem", slurry=with_role("validation")),
        noise=rules.measure_noise.output.table,
        replica_rdf=rules.measure_noise.input.rdf,
    output:
        table=report(
            f"{RESULTS}/tables/relaxation.csv",
            caption="../report/relaxation.rst",
            category="Evaluation",
            labels={"table": "length of the relaxation"},
        ),
        cost=f"{RESULTS}/costs/compare_relaxation.json",
    log:
        f"{RESULTS}/logs/compare_relaxation.log",
    benchmark:
        f"{RESULTS}/benchmarks/compare_relaxation.tsv"
    conda:
        "../../envs/analysis.yaml"
    resources:
        mem_mb=lambda wildcards, attempt: attempt * (1000 + max(map(particles, HELD_OUT)) // 20),
        # as structure_minutes, of all that are measured one after the other
        runtime=lambda wildcards, input, attempt: (
            attempt * (5 + len(input.relaxed) * max(map(particles, HELD_OUT)) // 10000)
        ),
    params:
        cutoff_um=config["analysis"]["rdf_cutoff_um"],
        bins=config["analysis"]["rdf_bins"],
        rdf_tolerance=config["evaluation"]["rdf_tolerance"],
    shell:
        "python {input.script:q} --relaxed {input.relaxed:q} --relaxation-costs {input.costs:q}"
        " --structure {input.structure:q} --dem-structure {input.dem_structure:q} --dem-rdf {input.dem_rdf:q}"
        " --noise {input.noise:q} --replica-rdf {input.replica_rdf:q} --cutoff-um {params.cutoff_um}"
        " --bins {params.bins} --rdf-tolerance {params.rdf_tolerance} --table {output.table:q} --cost {output.cost:q}"
        " 2>&1 | tee {log:q}"


if SPREADING:

    rule calibrate_spread:
        input:
            script="scripts/evaluation/calibrate_spread.py",
            modules=modules("scripts/evaluation/calibrate_spread.py"),
            predicted=lambda wildcards: expand(
                rules.predict_slurry.output.predicted, surrogate=wildcards.surrogate, slurry=calibrated_on()
            ),
            frames=lambda wildcards: expand(rules.extract_frames.output.frames, slurry=calibrated_on()),
        output:
            calibration=f"{RESULTS}/models/{{surrogate}}/calibration.json",
            cost=f"{RESULTS}/costs/calibrate_spread/{{surrogate}}.json",
        log:
            f"{RESULTS}/logs/calibrate_spread/{{surrogate}}.log",
        benchmark:
            f"{RESULTS}/benchmarks/calibrate_spread/{{surrogate}}.tsv"
        wildcard_constraints:
            surrogate="|".join(SPREADING),
        localrule: True
        conda:
            "../../envs/analysis.yaml"
        params:
            target_frame=TARGET_FRAME,
        shell:
            "python {input.script:q} --predicted {input.predicted:q} --frames {input.frames:q}"
            " --target-frame {params.target_frame} --calibration {output.calibration:q} --cost {output.cost:q}"
            " 2>&1 | tee {log:q}"

    rule measure_uncertainty:
        input:
            script="scripts/evaluation/measure_uncertainty.py",
            modules=modules("scripts/evaluation/measure_uncertainty.py"),
            predicted=expand(rules.predict_slurry.output.predicted, surrogate=SPREADING, slurry=HELD_OUT),
            frames=expand(rules.extract_frames.output.frames, slurry=HELD_OUT * len(SPREADING)),
            calibrations=expand(rules.calibrate_spread.output.calibration, surrogate=SPREADING),
        output:
            table=report(
                f"{RESULTS}/tables/uncertainty.csv",
                caption="../report/uncertainty.rst",
                category="Evaluation",
                labels={"table": "uncertainty"},
            ),
            cost=f"{RESULTS}/costs/measure_uncertainty.json",
        log:
            f"{RESULTS}/logs/measure_uncertainty.log",
        benchmark:
            f"{RESULTS}/benchmarks/measure_uncertainty.tsv"
        localrule: True
        conda:
            "../../envs/analysis.yaml"
        params:
            target_frame=TARGET_FRAME,
            roles=section({id: SLURRIES[id].role for id in HELD_OUT}),
        shell:
            "python {input.script:q} --predicted {input.predicted:q} --frames {input.frames:q}"
            " --target-frame {params.target_frame} --calibrations {input.calibrations:q} --roles {params.roles:q}"
            " --table {output.table:q} --cost {output.cost:q}"
            " 2>&1 | tee {log:q}"

    rule plot_uncertainty:
        input:
            script="scripts/evaluation/plot_uncertainty.py",
            modules=modules("scripts/evaluation/plot_uncertainty.py"),
            predicted=rules.measure_uncertainty.input.predicted,
            frames=rules.measure_uncertainty.input.frames,
            uncertainty=rules.measure_uncertainty.output.table,
        output:
            figure=report(
                f"{RESULTS}/figures/uncertainty.png",
                caption="../report/uncertainty_figure.rst",
                category="Evaluation",
                labels={"figure": "uncertainty"},
            ),
        log:
            f"{RESULTS}/logs/plot_uncertainty.log",
        benchmark:
            f"{RESULTS}/benchmarks/plot_uncertainty.tsv"
        localrule: True
        conda:
            "../../envs/analysis.yaml"
        params:
            target_frame=TARGET_FRAME,
        shell:
            "python {input.script:q} --predicted {input.predicted:q} --frames {input.frames:q}"
            " --target-frame {params.target_frame} --uncertainty {input.uncertainty:q} --figure {output.figure:q}"
            " 2>&1 | tee {log:q}"


rule plot_skill:
    input:
        script="scripts/evaluation/plot_skill.py",
        modules=modules("scripts/evaluation/plot_skill.py"),
        skill=rules.compute_skill.output.table,
    output:
        figure=report(
            f"{RESULTS}/figures/skill.png",
            caption="../report/skill_figure.rst",
            category="Evaluation",
            labels={"figure": "skill"},
        ),
    log:
        f"{RESULTS}/logs/plot_skill.log",
    benchmark:
        f"{RESULTS}/benchmarks/plot_skill.tsv"
    conda:
        "../../envs/analysis.yaml"
    shell:
        "python {input.script:q} --skill {input.skill:q} --figure {output.figure:q}" " 2>&1 | tee {log:q}"


rule plot_front:
    input:
        script="scripts/evaluation/plot_front.py",
        modules=modules("scripts/evaluation/plot_front.py"),
        front=rules.compute_front.output.table,
        skill=rules.compute_skill.output.table,
        structure_errors=rules.compare_structure.output.table,
        equilibrium=rules.measure_equilibrium.output.table,
        speedup=rules.compare_costs.output.table,
    output:
        figure=report(
            f"{RESULTS}/figures/front.png",
            caption="../report/front_figure.rst",
            category="Evaluation",
            labels={"figure": "error against cost"},
        ),
    log:
        f"{RESULTS}/logs/plot_front.log",
    benchmark:
        f"{RESULTS}/benchmarks/plot_front.tsv"
    conda:
        "../../envs/analysis.yaml"
    shell:
        "python {input.script:q} --front {input.front:q} --skill {input.skill:q}"
        " --structure-errors {input.structure_errors:q}"
        " --equilibrium {input.equilibrium:q} --speedup {input.speedup:q} --figure {output.figure:q}"
        " 2>&1 | tee {log:q}"


rule plot_structure:
    input:
        script="scripts/evaluation/plot_structure.py",
        modules=modules("scripts/evaluation/plot_structure.py"),
        structure_errors=rules.compare_structure.output.table,
    output:
        figure=report(
            f"{RESULTS}/figures/structure.png",
            caption="../report/structure_figure.rst",
            category="Evaluation",
            labels={"figure": "structural errors"},
        ),
    log:
        f"{RESULTS}/logs/plot_structure.log",
    benchmark:
        f"{RESULTS}/benchmarks/plot_structure.tsv"
    conda:
        "../../envs/analysis.yaml"
    params:
        slurries=with_role("test"),
    shell:
        "python {input.script:q} --structure-errors {input.structure_errors:q} --slurries {params.slurries:q}"
        " --figure {output.figure:q}"
        " 2>&1 | tee {log:q}"


rule plot_relaxation:
    input:
        script="scripts/evaluation/plot_relaxation.py",
        modules=modules("scripts/evaluation/plot_relaxation.py"),
        relaxation=rules.compare_relaxation.output.table,
    output:
        figure=report(
            f"{RESULTS}/figures/relaxation.png",
            caption="../report/relaxation_figure.rst",
            category="Evaluation",
            labels={"figure": "length of the relaxation"},
        ),
    log:
        f"{RESULTS}/logs/plot_relaxation.log",
    benchmark:
        f"{RESULTS}/benchmarks/plot_relaxation.tsv"
    conda:
        "../../envs/analysis.yaml"
    params:
        rdf_tolerance=config["evaluation"]["rdf_tolerance"],
    shell:
        "python {input.script:q} --relaxation {input.relaxation:q} --rdf-tolerance {params.rdf_tolerance} --figure {output.figure:q}"
        " 2>&1 | tee {log:q}"


rule write_evaluation:
    input:
        script="scripts/evaluation/write_evaluation.py",
        modules=modules("scripts/evaluation/write_evaluation.py"),
        template="scripts/slurrycast/report/report.html.jinja",
        equilibrium=rules.measure_equilibrium.output.table,
        skill=rules.compute_skill.output.table,
        noise=rules.measure_noise.output.table,
        structure_errors=rules.compare_structure.output.table,
        front=rules.compute_front.output.table,
        equal_cost=rules.compare_at_equal_cost.output.table,
        cost_scaling=rules.fit_costs.output.table,
        article_costs=rules.compare_article_costs.output.table,
        ablation=rules.tabulate_ablation.output.table if HAS_ABLATION else [],
        relaxation=rules.compare_relaxation.output.table if HAS_RELAXATION else [],
        uncertainty=rules.measure_uncertainty.output.table if SPREADING else [],
        figures=[
            rules.plot_skill.output.figure,
            rules.plot_structure.output.figure,
            rules.plot_front.output.figure,
            *([rules.plot_relaxation.output.figure] if HAS_RELAXATION else []),
            *([rules.plot_uncertainty.output.figure] if SPREADING else []),
        ],
    output:
        page=report(f"{RESULTS}/evaluation.html", caption="../report/evaluation.rst", category="Report"),
    log:
        f"{RESULTS}/logs/write_evaluation.log",
    benchmark:
        f"{RESULTS}/benchmarks/write_evaluation.tsv"
    conda:
        "../../envs/analysis.yaml"
    params:
        run=config["run"]["name"],
        relaxed_for=section({label: configuration.own_relaxation_steps(config, label) for label in EVALUATED}),
        networks=[text for text, module in MODULES.items() if module.MODEL_FILE == "model.keras"],
        density_tolerance=config["evaluation"]["density_tolerance"],
        rdf_tolerance=config["evaluation"]["rdf_tolerance"],
        optional=lambda wildcards, input: [
            word
            for name in ("ablation", "relaxation", "uncertainty")
            if input[name]
            for word in (f"--{name}", input[name])
        ],
    shell:
        "python {input.script:q} --run {params.run:q} --networks {params.networks:q}"
        " --density-tolerance {params.density_tolerance} --rdf-tolerance {params.rdf_tolerance} --relaxed-for {params.relaxed_for:q}"
        " --equilibrium {input.equilibrium:q}"
        " --skill {input.skill:q} --noise {input.noise:q} --structure-errors {input.structure_errors:q}"
        " --front {input.front:q} --equal-cost {input.equal_cost:q} --cost-scaling {input.cost_scaling:q}"
        " --article-costs {input.article_costs:q} {params.optional:q} --figures {input.figures:q} --page {output.page:q}"
        " 2>&1 | tee {log:q}"
