"""Frames and samples: from trajectories to what is learned from.

REQUIRED INPUTS:
    dem/{slurry}/dump.lammpstrj, inputs.json, run.json
    config[learning], config[surrogate][packing_fraction]

OUTPUTS:
    frames/{slurry}.h5
    dataset/training.h5, packing_fraction.json, packing_fraction_<recipe>.json
    dataset/validation.h5, test.h5: of held-out slurries, for learning curves
"""


rule extract_frames:
    """Check the dump of a DEM and keep its frames in HDF5."""
    input:
        # The dump is gone once the frames are checked, so any reason to read it again repeats the DEM. An edit of the
        # code is none: the script is ancient, its modules are not listed. To have it all the same: --forcerun
        # extract_frames.
        script=ancient(project_file("scripts/dem/extract_frames.py")),
        dump=rules.run_slurry.output.dump,
        inputs=rules.generate_inputs.output.inputs,
        run=rules.run_slurry.output.run,
    output:
        frames=f"{RESULTS}/frames/{{slurry}}.h5",
        cost=f"{RESULTS}/costs/extract_frames/{{slurry}}.json",
    log:
        f"{RESULTS}/logs/extract_frames/{{slurry}}.log",
    priority: dem_priority
    localrule: True
    conda:
        "../../envs/analysis.yaml"
    params:
        work=work_of_dem,
    shell:
        "python {input.script:q} --dump {input.dump:q} --inputs {input.inputs:q} --run {input.run:q} --work"
        " {params.work:q} --frames {output.frames:q} --cost {output.cost:q}"
        " 2>&1 | tee {log:q}"


rule assemble_dataset:
    """Collect the training set from the frames of the training slurries, or the like of it from held-out ones."""
    input:
        **code("dataset/assemble_dataset"),
        frames=lambda wildcards: expand(
            rules.extract_frames.output.frames, slurry=with_role(ROLE_OF_SET[wildcards.set])
        ),
    output:
        dataset=f"{RESULTS}/dataset/{{set}}.h5",
        cost=f"{RESULTS}/costs/assemble_dataset/{{set}}.json",
    log:
        f"{RESULTS}/logs/assemble_dataset/{{set}}.log",
    priority: 3000  # as train_surrogate, which waits for it
    localrule: True
    conda:
        "../../envs/analysis.yaml"
    params:
        input_frames=INPUT_FRAMES,
        target_frame=TARGET_FRAME,
        phases=PHASES,
        validation_share=config["learning"]["validation_share"],
        seed=config["learning"]["seed"],
    shell:
        "python {input.script:q} --frames {input.frames:q} --input-frames {params.input_frames} --target-frame"
        " {params.target_frame} --phases {params.phases:q} --validation-share {params.validation_share} --seed {params.seed}"
        " --dataset {output.dataset:q} --cost {output.cost:q}"
        " 2>&1 | tee {log:q}"


rule measure_packing:
    """Take the packing fraction that sets the predicted boxes of a recipe, from slurries or the configuration."""
    input:
        **code("dataset/measure_packing"),
        frames=packing_sources,
    output:
        packing=f"{RESULTS}/dataset/packing_fraction{{recipe}}.json",
        cost=f"{RESULTS}/costs/measure_packing{{recipe}}.json",
    log:
        f"{RESULTS}/logs/measure_packing/packing_fraction{{recipe}}.log",
    localrule: True
    conda:
        "../../envs/analysis.yaml"
    params:
        source=lambda wildcards, input: (
            ["--given", config["surrogate"]["packing_fraction"]]
            if PACKING_GIVEN
            else ["--frames", *input.frames, "--target-frame", TARGET_FRAME]
        ),
    shell:
        "python {input.script:q} {params.source:q} --packing {output.packing:q} --cost {output.cost:q}"
        " 2>&1 | tee {log:q}"


# Of all recipes that are predicted.
PACKING_COSTS = expand(
    rules.measure_packing.output.cost, recipe=dict.fromkeys(packing_file(slurry) for slurry in PREDICTED)
)
