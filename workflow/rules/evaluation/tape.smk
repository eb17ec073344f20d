"""Whether a tape is that of the full DEM, beside the noise of the tapes of its replicas.

REQUIRED INPUTS:
    tape/{source}/{slurry}/tape.csv, of replicas too

OUTPUTS:
    tables/tape_errors.csv, tape_verdicts.csv; plot_verdicts draws them
"""


# The same table of all tapes that are judged, beside the scatter of all replicas.
use rule tabulate_microstructure as compare_tapes with:
    input:
        **code("tape/tabulate_microstructure"),
        microstructures=lambda wildcards: judged_tapes(rules.measure_microstructure.output.table),
        replicas=lambda wildcards: expand(
            rules.measure_microstructure.output.table, source="dem", slurry=dried_replicas(), stage="tape"
        ),
    output:
        table=reported("tables/tape_errors.csv", "tape_errors", "Tape", table="errors of tapes"),
    log:
        f"{RESULTS}/logs/compare_tapes.log",


rule judge_tapes:
    """Judge whether tapes are inside the noise of those of the DEM."""
    input:
        **code("evaluation/judge_tapes"),
        tape_errors=rules.compare_tapes.output.table,
    output:
        table=reported("tables/tape_verdicts.csv", "tape_verdicts", "Tape", table="inside the noise"),
    log:
        f"{RESULTS}/logs/judge_tapes.log",
    localrule: True
    conda:
        "../../../envs/analysis.yaml"
    params:
        slurries=with_role("test"),
    shell:
        "python {input.script:q} --tape-errors {input.tape_errors:q} --slurries {params.slurries:q}"
        " --table {output.table:q}"
        " 2>&1 | tee {log:q}"
