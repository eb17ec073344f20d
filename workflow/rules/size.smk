"""Why predictions of large slurries fail: the barostat's clock, or coordinates beyond those of the training.

REQUIRED INPUTS:
    dem/{slurry}/thermo.csv, run.json
    frames/{slurry}.h5
    hybrid/{surrogate}/{slurry}/predicted.h5, relaxed.h5
    tables/equilibrium.csv

OUTPUTS:
    tables/size_errors.csv, size_clock.csv
    figures/sizes.png
"""


rule compare_sizes:
    input:
        script="scripts/studies/compare_sizes.py",
        modules=modules("scripts/studies/compare_sizes.py"),
        frames=expand(rules.extract_frames.output.frames, slurry=TRAINING + HELD_OUT),
        runs=expand(rules.run_slurry.output.run, slurry=COMPLETE),
        thermo=expand(rules.run_slurry.output.thermo, slurry=COMPLETE),
        predicted=expand(rules.predict_slurry.output.predicted, surrogate=SURROGATES, slurry=HELD_OUT),
        relaxed=expand(RELAXED, surrogate=SURROGATES, slurry=HELD_OUT),
        equilibrium=rules.measure_equilibrium.output.table,
    output:
        table=report(
            f"{RESULTS}/tables/size_errors.csv",
            caption="../report/size_errors.rst",
            category="Size",
            labels={"table": "volume errors"},
        ),
        clock=report(
            f"{RESULTS}/tables/size_clock.csv",
            caption="../report/size_clock.rst",
            category="Size",
            labels={"table": "clock of the barostat"},
        ),
        cost=f"{RESULTS}/costs/compare_sizes.json",
    log:
        f"{RESULTS}/logs/compare_sizes.log",
    benchmark:
        f"{RESULTS}/benchmarks/compare_sizes.tsv"
    conda:
        "../../envs/analysis.yaml"
    params:
        last_input_frame=max(INPUT_FRAMES),
        target_frame=TARGET_FRAME,
    shell:
        "python {input.script:q} --frames {input.frames:q} --run-json {input.runs:q} --thermo {input.thermo:q}"
        " --predicted {input.predicted:q} --relaxed {input.relaxed:q} --equilibrium {input.equilibrium:q}"
        " --last-input-frame {params.last_input_frame} --target-frame {params.target_frame}"
        " --table {output.table:q} --clock {output.clock:q} --cost {output.cost:q}"
        " 2>&1 | tee {log:q}"


rule plot_sizes:
    input:
        script="scripts/studies/plot_sizes.py",
        modules=modules("scripts/studies/plot_sizes.py"),
        table=rules.compare_sizes.output.table,
    output:
        figure=report(
            f"{RESULTS}/figures/sizes.png",
            caption="../report/size_figure.rst",
            category="Size",
            labels={"figure": "volume error against size"},
        ),
    log:
        f"{RESULTS}/logs/plot_sizes.log",
    benchmark:
        f"{RESULTS}/benchmarks/plot_sizes.tsv"
    conda:
        "../../envs/analysis.yaml"
    params:
        table=lambda wildcards, input: f"{config['run']['name']}={input.table}",
    shell:
        "python {input.script:q} --tables {params.table:q} --figure {output.figure:q} 2>&1 | tee {log:q}"
