"""How far the spread of a prediction tells its error, for surrogates that have a spread.

REQUIRED INPUTS:
    frames/{slurry}.h5
    hybrid/{surrogate}/{slurry}/predicted.h5

OUTPUTS:
    models/{surrogate}/calibration.json
    tables/uncertainty.csv
    figures/uncertainty.png
"""

if SPREADING:

    rule calibrate_spread:
        """Calibrate the spread of a surrogate on the validation slurries."""
        input:
            **code("evaluation/calibrate_spread"),
            predicted=lambda wildcards: expand(
                rules.predict_slurry.output.predicted, surrogate=wildcards.surrogate, slurry=calibration_slurries()
            ),
            frames=lambda wildcards: expand(rules.extract_frames.output.frames, slurry=calibration_slurries()),
        output:
            calibration=f"{RESULTS}/models/{{surrogate}}/calibration.json",
        log:
            f"{RESULTS}/logs/calibrate_spread/{{surrogate}}.log",
        wildcard_constraints:
            surrogate="|".join(SPREADING),
        localrule: True
        conda:
            "../../../envs/analysis.yaml"
        params:
            target_frame=TARGET_FRAME,
        shell:
            "python {input.script:q} --predicted {input.predicted:q} --frames {input.frames:q}"
            " --target-frame {params.target_frame} --calibration {output.calibration:q}"
            " 2>&1 | tee {log:q}"

    rule measure_uncertainty:
        """Measure how far calibrated intervals cover the errors."""
        input:
            **code("evaluation/measure_uncertainty"),
            predicted=expand(rules.predict_slurry.output.predicted, surrogate=SPREADING, slurry=HELD_OUT),
            frames=expand(rules.extract_frames.output.frames, slurry=HELD_OUT * len(SPREADING)),
            calibrations=expand(rules.calibrate_spread.output.calibration, surrogate=SPREADING),
        output:
            table=reported("tables/uncertainty.csv", "uncertainty", "Evaluation", table="uncertainty"),
        log:
            f"{RESULTS}/logs/measure_uncertainty.log",
        localrule: True
        conda:
            "../../../envs/analysis.yaml"
        params:
            target_frame=TARGET_FRAME,
            roles=section({id: SLURRIES[id].role for id in HELD_OUT}),
        shell:
            "python {input.script:q} --predicted {input.predicted:q} --frames {input.frames:q}"
            " --target-frame {params.target_frame} --calibrations {input.calibrations:q} --roles {params.roles:q}"
            " --table {output.table:q}"
            " 2>&1 | tee {log:q}"

    rule plot_uncertainty:
        """Draw coverage of the intervals, and error against spread."""
        input:
            **code("evaluation/plot_uncertainty"),
            predicted=rules.measure_uncertainty.input.predicted,
            frames=rules.measure_uncertainty.input.frames,
            uncertainty=rules.measure_uncertainty.output.table,
        output:
            figure=reported("figures/uncertainty.png", "uncertainty_figure", "Evaluation", figure="uncertainty"),
        log:
            f"{RESULTS}/logs/plot_uncertainty.log",
        localrule: True
        conda:
            "../../../envs/analysis.yaml"
        params:
            target_frame=TARGET_FRAME,
        shell:
            "python {input.script:q} --predicted {input.predicted:q} --frames {input.frames:q}"
            " --target-frame {params.target_frame} --uncertainty {input.uncertainty:q} --figure {output.figure:q}"
            " 2>&1 | tee {log:q}"
