"""The hybrid chain behind the surrogate: a prediction becomes a microstructure at rest in its periodic box.

REQUIRED INPUTS:
    hybrid/{surrogate}/{slurry}/predicted.h5
    dem/{slurry}/inputs.json, coefficients.lmp, push_off.lmp
    config[relaxation]

OUTPUTS:
    hybrid/{surrogate}/{slurry}/wrapped.data, relaxed.data, relaxed.h5; relaxed-<steps>.data, .h5 of other step counts
"""


rule wrap_slurry:
    """Wrap a prediction into its periodic box."""
    input:
        **code("hybrid/wrap_slurry"),
        predicted=rules.predict_slurry.output.predicted,
        inputs=rules.generate_inputs.output.inputs,
    output:
        wrapped=f"{RESULTS}/hybrid/{{surrogate}}/{{slurry}}/wrapped.data",
        cost=f"{RESULTS}/costs/wrap_slurry/{{surrogate}}/{{slurry}}.json",
    log:
        f"{RESULTS}/logs/wrap_slurry/{{surrogate}}/{{slurry}}.log",
    localrule: True
    conda:
        "../../envs/analysis.yaml"
    shell:
        "python {input.script:q} --predicted {input.predicted:q} --inputs {input.inputs:q} --wrapped {output.wrapped:q}"
        " --cost {output.cost:q}"
        " 2>&1 | tee {log:q}"


rule relax_slurry:
    """Push overlaps off and relax a prediction by a short DEM."""
    input:
        **code("hybrid/relax_slurry"),
        lammps=lammps_scripts("push_off", "relax"),
        wrapped=rules.wrap_slurry.output.wrapped,
        predicted=rules.predict_slurry.output.predicted,
        inputs=rules.generate_inputs.output.inputs,
        coefficients=rules.generate_inputs.output.coefficients,
        push_off=rules.generate_inputs.output.push_off,
    output:
        data=f"{RESULTS}/hybrid/{{surrogate}}/{{slurry}}/relaxed{{steps}}.data",
        relaxed=f"{RESULTS}/hybrid/{{surrogate}}/{{slurry}}/relaxed{{steps}}.h5",
        cost=f"{RESULTS}/costs/relax_slurry/{{surrogate}}/{{slurry}}{{steps}}.json",
    log:
        f"{RESULTS}/logs/relax_slurry/{{surrogate}}/{{slurry}}{{steps}}.log",
    conda:
        "../../envs/dem.yaml"
    threads: config["dem"]["ranks"]
    resources:
        **LAMMPS_JOB,
        mem_mb=slurry_mb,
        runtime=lambda wildcards, attempt: lammps_minutes(wildcards, relaxation(wildcards)["steps"], attempt),
    params:
        settings=lambda wildcards: section(relaxation(wildcards)),
        work=lambda wildcards: f"{RESULTS}/hybrid/{wildcards.surrogate}/{wildcards.slurry}/work{wildcards.steps}",
    shell:
        "python {input.script:q} --wrapped {input.wrapped:q} --predicted {input.predicted:q} --inputs {input.inputs:q}"
        " --coefficients {input.coefficients:q} --push-off {input.push_off:q} --settings {params.settings:q} --work"
        " {params.work:q} --executable {resources.executable:q} --launcher={resources.mpi:q} --ranks {resources.tasks}"
        " --relaxed-data {output.data:q} --relaxed {output.relaxed:q} --cost {output.cost:q}"
        " 2>&1 | tee {log:q}"


# Of the main job, which relaxes for relaxation.steps.
RELAXED, RELAXATION_COST = (
    expand(path, steps="", allow_missing=True)[0]
    for path in (rules.relax_slurry.output.relaxed, rules.relax_slurry.output.cost)
)
