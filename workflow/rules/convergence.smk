"""Whether the time step is small enough: one slurry with several time steps and seeds.

REQUIRED INPUTS:
    dem/{slurry}/run.json, thermo.csv and structure/dem/{slurry}.csv, {slurry}_rdf.csv of the runs of
    config[convergence] tables/equilibrium.csv

OUTPUTS:
    tables/timestep.csv, timestep_summary.csv
    figures/timesteps.png
"""


rule compare_timesteps:
    input:
        script="scripts/studies/compare_timesteps.py",
        modules=modules("scripts/studies/compare_timesteps.py"),
        runs=lambda wildcards: expand(rules.run_slurry.output.run, slurry=timestep_runs()),
        thermo=lambda wildcards: expand(rules.run_slurry.output.thermo, slurry=timestep_runs()),
        structure=lambda wildcards: expand(
            rules.measure_structure.output.structure, source="dem", slurry=timestep_runs()
        ),
        rdf=lambda wildcards: expand(rules.measure_structure.output.rdf, source="dem", slurry=timestep_runs()),
    output:
        runs=report(
            f"{RESULTS}/tables/timestep.csv",
            caption="../report/timestep.rst",
            category="Convergence",
            labels={"table": "runs"},
        ),
        summary=report(
            f"{RESULTS}/tables/timestep_summary.csv",
            caption="../report/timestep_summary.rst",
            category="Convergence",
            labels={"table": "time steps"},
        ),
        cost=f"{RESULTS}/costs/compare_timesteps.json",
    log:
        f"{RESULTS}/logs/compare_timesteps.log",
    benchmark:
        f"{RESULTS}/benchmarks/compare_timesteps.tsv"
    conda:
        "../../envs/analysis.yaml"
    params:
        max_density_difference=config["convergence"]["max_density_difference"],
    shell:
        "python {input.script:q} --run-json {input.runs:q} --thermo {input.thermo:q}"
        " --structure {input.structure:q} --rdf {input.rdf:q}"
        " --max-density-difference {params.max_density_difference}"
        " --runs {output.runs:q} --summary {output.summary:q} --cost {output.cost:q}"
        " 2>&1 | tee {log:q}"


rule plot_timesteps:
    input:
        script="scripts/studies/plot_timesteps.py",
        modules=modules("scripts/studies/plot_timesteps.py"),
        runs=rules.compare_timesteps.output.runs,
        summary=rules.compare_timesteps.output.summary,
        equilibrium=rules.measure_equilibrium.output.table,
    output:
        figure=report(
            f"{RESULTS}/figures/timesteps.png",
            caption="../report/timesteps.rst",
            category="Convergence",
            labels={"figure": "time steps"},
        ),
    log:
        f"{RESULTS}/logs/plot_timesteps.log",
    benchmark:
        f"{RESULTS}/benchmarks/plot_timesteps.tsv"
    conda:
        "../../envs/analysis.yaml"
    params:
        max_density_difference=config["convergence"]["max_density_difference"],
    shell:
        "python {input.script:q} --runs {input.runs:q} --summary {input.summary:q} --equilibrium {input.equilibrium:q}"
        " --max-density-difference {params.max_density_difference} --figure {output.figure:q}"
        " 2>&1 | tee {log:q}"
