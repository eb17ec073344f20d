"""Surrogates: trained on the data set or on frames, or taken as they are, then asked for each slurry that was not
trained on.

REQUIRED INPUTS:
    frames/{slurry}.h5; dataset/training.h5; config[surrogate][models]; dataset/packing_fraction.json of its recipe
    dem/{slurry}/frame_<k>.restart, inputs.json, coefficients.lmp, run.json: for those that go on with the DEM
    config[learning], config[surrogate]

OUTPUTS:
    models/{surrogate}/model.keras and history.csv, or model.json; trained_on.json
    hybrid/{surrogate}/{slurry}/predicted.h5
"""

if TRAINED:

    rule train_surrogate:
        """Train a neural network."""
        input:
            unpack(learned_from),
            **code("surrogate/train_surrogate", loads_surrogate=True),
            start_from=lambda wildcards: start_of(wildcards.surrogate),
        output:
            model=f"{RESULTS}/models/{{surrogate}}/model.keras",
            history=f"{RESULTS}/models/{{surrogate}}/history.csv",
            cost=f"{RESULTS}/costs/train_surrogate/{{surrogate}}.json",
        log:
            f"{RESULTS}/logs/train_surrogate/{{surrogate}}.log",
        wildcard_constraints:
            surrogate="|".join(TRAINED),
        priority: 3000  # the longest job: everything else goes on beside it, the DEM of held-out slurries too
        conda:
            "../../envs/learning.yaml"
        threads: lambda wildcards: config["surrogate"][LABELS[wildcards.surrogate].name]["threads"]
        resources:
            mem_mb=training_mb,
            runtime=training_minutes,
        params:
            settings=surrogate_settings,
            seed=config["learning"]["seed"],
            work=lambda wildcards: f"{RESULTS}/models/{wildcards.surrogate}/work",
            learned=learning_options,
            started=lambda wildcards, input: ["--start-from", input.start_from] if input.start_from else [],
        shell:
            "python {input.script:q} --surrogate {wildcards.surrogate:q} {params.learned:q} {params.started:q}"
            " --settings {params.settings:q} --seed {params.seed} --work {params.work:q}"
            " --model {output.model:q} --history {output.history:q} --cost {output.cost:q}"
            " 2>&1 | tee {log:q}"


if TRAINING_NEEDED:

    rule fit_surrogate:
        """Fit a surrogate that is not a neural network."""
        input:
            **code("surrogate/fit_surrogate", loads_surrogate=True),
            dataset=TRAINING_SET,
        output:
            model=f"{RESULTS}/models/{{surrogate}}/model.json",
            cost=f"{RESULTS}/costs/fit_surrogate/{{surrogate}}.json",
        log:
            f"{RESULTS}/logs/fit_surrogate/{{surrogate}}.log",
        localrule: True
        conda:
            "../../envs/learning.yaml"
        params:
            settings=surrogate_settings,
            seed=config["learning"]["seed"],
        shell:
            "python {input.script:q} --surrogate {wildcards.surrogate:q} --dataset {input.dataset:q}"
            " --settings {params.settings:q} --seed {params.seed} --model {output.model:q} --cost {output.cost:q}"
            " 2>&1 | tee {log:q}"


if DESCRIBED:

    rule describe_model:
        """Say beside a model what it was trained on; a rule of its own, since no edit of it is a reason to train again."""
        input:
            **code("surrogate/describe_model"),
            model=lambda wildcards: model_of(wildcards.surrogate),
            frames=expand(rules.extract_frames.output.frames, slurry=TRAINING),
            start_from=lambda wildcards: start_of(wildcards.surrogate),
            beside=lambda wildcards: there_beside(start_of(wildcards.surrogate)),
        output:
            trained_on=f"{RESULTS}/models/{{surrogate}}/trained_on.json",
        log:
            f"{RESULTS}/logs/describe_model/{{surrogate}}.log",
        wildcard_constraints:
            surrogate="|".join(DESCRIBED),
        localrule: True
        conda:
            "../../envs/analysis.yaml"
        params:
            input_frames=lambda wildcards: input_frames(wildcards.surrogate),
            target_frame=TARGET_FRAME,
            phases=PHASES,
            started=lambda wildcards, input: ["--start-from", input.start_from] if input.start_from else [],
            first_frame_seen=lambda wildcards: label_settings.first_frame_seen(config, wildcards.surrogate),
        shell:
            "python {input.script:q} --surrogate {wildcards.surrogate:q} --model {input.model:q}"
            " --frames {input.frames:q} --input-frames {params.input_frames} --target-frame {params.target_frame}"
            " --phases {params.phases:q} --first-frame-seen {params.first_frame_seen} {params.started:q}"
            " --trained-on {output.trained_on:q}"
            " 2>&1 | tee {log:q}"


if ADOPTED:

    rule adopt_model:
        """Use a network that was trained elsewhere."""
        input:
            **code("surrogate/adopt_model"),
            model=lambda wildcards: ADOPTED[wildcards.surrogate],
            beside=lambda wildcards: there_beside(ADOPTED[wildcards.surrogate]),
        output:
            model=f"{RESULTS}/models/{{surrogate}}/model.keras",
            history=f"{RESULTS}/models/{{surrogate}}/history.csv",
            trained_on=f"{RESULTS}/models/{{surrogate}}/trained_on.json",
            cost=f"{RESULTS}/costs/adopt_model/{{surrogate}}.json",
        log:
            f"{RESULTS}/logs/adopt_model/{{surrogate}}.log",
        wildcard_constraints:
            surrogate="|".join(ADOPTED),
        localrule: True
        conda:
            "../../envs/learning.yaml"
        shell:
            "python {input.script:q} --surrogate {wildcards.surrogate:q} --trained {input.model:q}"
            " --model {output.model:q} --history {output.history:q}"
            " --trained-on {output.trained_on:q} --cost {output.cost:q}"
            " 2>&1 | tee {log:q}"


rule predict_slurry:
    """Predict the target frame of a slurry from its input frames."""
    input:
        unpack(input_paths),
        **code("surrogate/predict_slurry", loads_surrogate=True),
        model=lambda wildcards: model_of(wildcards.surrogate),
        packing=lambda wildcards: (
            expand(rules.measure_packing.output.packing, recipe=packing_file(wildcards.slurry))
            if KINDS[wildcards.surrogate].needs_packing_fraction
            else []
        ),
    output:
        predicted=f"{RESULTS}/hybrid/{{surrogate}}/{{slurry}}/predicted.h5",
        cost=f"{RESULTS}/costs/predict_slurry/{{surrogate}}/{{slurry}}.json",
    log:
        f"{RESULTS}/logs/predict_slurry/{{surrogate}}/{{slurry}}.log",
    group:
        prediction_group
    conda:
        "../../envs/learning.yaml"
    threads: lambda wildcards: config["dem"]["ranks"] if goes_on(wildcards) else 1
    resources:
        mpi=lambda wildcards: LAMMPS_JOB["mpi"] if goes_on(wildcards) else "",
        tasks=lambda wildcards: config["dem"]["ranks"] if goes_on(wildcards) else 1,
        cpus_per_task=1,
        executable=lambda wildcards: config["dem"]["executable"] if goes_on(wildcards) else "",
        mem_mb=prediction_mb,
        runtime=prediction_minutes,
    params:
        settings=surrogate_settings,
        input_frames=lambda wildcards: input_frames(wildcards.surrogate),
        target_frame=TARGET_FRAME,
        phases=lambda wildcards: phases_of(wildcards.surrogate),
        learned=lambda wildcards, input: ["--model", input.model] if input.model else [],
        adopted=lambda wildcards: ["--adopted"] if wildcards.surrogate in ADOPTED else [],
        boxed=lambda wildcards, input: ["--packing", input.packing] if input.packing else [],
        started=lambda wildcards, input: input_options(input),
        continued=continuation_options,
    shell:
        "python {input.script:q} --surrogate {wildcards.surrogate:q} --settings {params.settings:q}"
        " {params.started:q} --input-frames {params.input_frames} --target-frame {params.target_frame}"
        " --phases {params.phases:q} {params.learned:q} {params.adopted:q} {params.boxed:q} {params.continued:q}"
        " --executable={resources.executable:q} --launcher={resources.mpi:q} --ranks {resources.tasks}"
        " --predicted {output.predicted:q} --cost {output.cost:q}"
        " 2>&1 | tee {log:q}"
