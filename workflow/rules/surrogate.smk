"""Surrogates: trained on the data set or taken as they are, then asked for each slurry that was not trained on.

REQUIRED INPUTS:
    dataset/training.h5, or config[surrogate][model]
    frames/{slurry}.h5
    config[learning], config[surrogate]

OUTPUTS:
    models/{surrogate}/model.keras, history.csv
    hybrid/{surrogate}/{slurry}/predicted.h5
"""

if TRAINING_NEEDED:

    rule train_surrogate:
        input:
            script="scripts/train_surrogate.py",
            modules=lambda wildcards: modules("scripts/train_surrogate.py", wildcards.surrogate),
            dataset=rules.assemble_dataset.output.dataset,
        output:
            model=f"{RESULTS}/models/{{surrogate}}/model.keras",
            history=f"{RESULTS}/models/{{surrogate}}/history.csv",
            cost=f"{RESULTS}/costs/train_surrogate/{{surrogate}}.json",
        log:
            f"{RESULTS}/logs/train_surrogate/{{surrogate}}.log",
        benchmark:
            f"{RESULTS}/benchmarks/train_surrogate/{{surrogate}}.tsv"
        priority: 1000  # the longest job: everything else goes on beside it
        conda:
            "../../envs/learning.yaml"
        threads: lambda wildcards: config["surrogate"][wildcards.surrogate]["threads"]
        resources:
            mem_mb=lambda wildcards, attempt: attempt * 4000,
            runtime=training_minutes,
        params:
            settings=lambda wildcards: section(config["surrogate"][wildcards.surrogate]),
            seed=config["learning"]["seed"],
            work=lambda wildcards: f"{RESULTS}/models/{wildcards.surrogate}/work",
        shell:
            "python {input.script:q} --surrogate {wildcards.surrogate:q} --dataset {input.dataset:q}"
            " --settings {params.settings:q} --seed {params.seed} --work {params.work:q}"
            " --model {output.model:q} --history {output.history:q} --cost {output.cost:q}"
            " 2>&1 | tee {log:q}"

else:

    rule adopt_model:
        input:
            script="scripts/adopt_model.py",
            modules=modules("scripts/adopt_model.py"),
            model=config["surrogate"]["model"],
        output:
            model=f"{RESULTS}/models/{{surrogate}}/model.keras",
            history=f"{RESULTS}/models/{{surrogate}}/history.csv",
            cost=f"{RESULTS}/costs/adopt_model/{{surrogate}}.json",
        log:
            f"{RESULTS}/logs/adopt_model/{{surrogate}}.log",
        benchmark:
            f"{RESULTS}/benchmarks/adopt_model/{{surrogate}}.tsv"
        conda:
            "../../envs/learning.yaml"
        params:
            input_frames=INPUT_FRAMES,
        shell:
            "python {input.script:q} --surrogate {wildcards.surrogate:q} --trained {input.model:q}"
            " --input-frames {params.input_frames} --model {output.model:q} --history {output.history:q}"
            " --cost {output.cost:q}"
            " 2>&1 | tee {log:q}"


rule predict_slurry:
    input:
        script="scripts/predict_slurry.py",
        modules=lambda wildcards: modules("scripts/predict_slurry.py", wildcards.surrogate),
        model=f"{RESULTS}/models/{{surrogate}}/model.keras",
        frames=rules.extract_frames.output.frames,
    output:
        predicted=f"{RESULTS}/hybrid/{{surrogate}}/{{slurry}}/predicted.h5",
        cost=f"{RESULTS}/costs/predict_slurry/{{surrogate}}/{{slurry}}.json",
    log:
        f"{RESULTS}/logs/predict_slurry/{{surrogate}}/{{slurry}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/predict_slurry/{{surrogate}}/{{slurry}}.tsv"
    conda:
        "../../envs/learning.yaml"
    resources:
        mem_mb=lambda wildcards, attempt: attempt * 4000,
    params:
        input_frames=INPUT_FRAMES,
        target_frame=TARGET_FRAME,
    shell:
        "python {input.script:q} --surrogate {wildcards.surrogate:q} --model {input.model:q}"
        " --frames {input.frames:q} --input-frames {params.input_frames} --target-frame {params.target_frame}"
        " --predicted {output.predicted:q} --cost {output.cost:q}"
        " 2>&1 | tee {log:q}"
