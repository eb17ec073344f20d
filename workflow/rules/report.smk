"""Figures and the report, and what was run with which versions."""


rule record_run:
    input:
        script="scripts/record_run.py",
        modules=modules("scripts/record_run.py"),
    output:
        config=f"{RESULTS}/config.yaml",
        versions=f"{RESULTS}/versions.json",
    log:
        f"{RESULTS}/logs/record_run.log",
    benchmark:
        f"{RESULTS}/benchmarks/record_run.tsv"
    conda:
        "../../envs/analysis.yaml"
    params:
        config=section(config),
    shell:
        "python {input.script:q} --effective {params.config:q} --config {output.config:q} --versions {output.versions:q}"
        " 2>&1 | tee {log:q}"
