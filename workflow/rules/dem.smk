"""The slurry DEM: from a row of the slurry table to its trajectory.

REQUIRED INPUTS:
    config[slurries], config[formulation], config[force_field], config[dem]

OUTPUTS:
    dem/{slurry}/initial.data, coefficients.lmp, push_off.lmp, inputs.json
    dem/{slurry}/dump.lammpstrj (temporary), frame_<k>.restart, lammps.log, thermo.csv, run.json
"""


rule generate_inputs:
    """Place the particles of a slurry and write the LAMMPS inputs."""
    input:
        **code("dem/generate_inputs"),
    output:
        data=f"{RESULTS}/dem/{{slurry}}/initial.data",
        coefficients=f"{RESULTS}/dem/{{slurry}}/coefficients.lmp",
        push_off=f"{RESULTS}/dem/{{slurry}}/push_off.lmp",
        inputs=f"{RESULTS}/dem/{{slurry}}/inputs.json",
        cost=f"{RESULTS}/costs/generate_inputs/{{slurry}}.json",
    log:
        f"{RESULTS}/logs/generate_inputs/{{slurry}}.log",
    priority: dem_priority
    localrule: True
    conda:
        "../../envs/dem.yaml"
    params:
        physics=lambda wildcards: section(physics.physics(config_of(wildcards.slurry), RUNS[wildcards.slurry])),
    shell:
        "python {input.script:q} --slurry {wildcards.slurry:q} --physics {params.physics:q} --data {output.data:q}"
        " --coefficients {output.coefficients:q} --push-off {output.push_off:q} --inputs {output.inputs:q}"
        " --cost {output.cost:q}"
        " 2>&1 | tee {log:q}"


rule run_slurry:
    """Run the DEM of a slurry from its initial state to its last frame."""
    input:
        **code("dem/run_slurry"),
        lammps=lammps_scripts("push_off", "start", "slurry"),
        data=rules.generate_inputs.output.data,
        coefficients=rules.generate_inputs.output.coefficients,
        push_off=rules.generate_inputs.output.push_off,
        inputs=rules.generate_inputs.output.inputs,
    output:
        dump=temp(f"{RESULTS}/dem/{{slurry}}/dump.lammpstrj"),
        # those of other restart frames are written too; declared is the one that every slurry has
        restart=expand(f"{RESULTS}/dem/{{{{slurry}}}}/frame_{{k}}.restart", k=max(INPUT_FRAMES)),
        log=f"{RESULTS}/dem/{{slurry}}/lammps.log",
        thermo=f"{RESULTS}/dem/{{slurry}}/thermo.csv",
        run=f"{RESULTS}/dem/{{slurry}}/run.json",
        cost=f"{RESULTS}/costs/run_slurry/{{slurry}}.json",
    log:
        f"{RESULTS}/logs/run_slurry/{{slurry}}.log",
    priority: dem_priority
    conda:
        "../../envs/dem.yaml"
    threads: config["dem"]["ranks"]
    resources:
        **LAMMPS_JOB,
        budgeted=int(BUDGETED),
        # among the resources, since a run is not repeated because other files of it would do
        restart_frames=restart_frames,
        mem_mb=slurry_mb,
        runtime=dem_minutes,
    params:
        last_frame=last_frame,
        restarts=lambda wildcards: f"{RESULTS}/dem/{wildcards.slurry}",
        work=work_of_dem,
        attempts=lambda wildcards: f"{RESULTS}/logs/run_slurry/{wildcards.slurry}",
    shell:
        "python {input.script:q} --inputs {input.inputs:q} --data {input.data:q} --coefficients {input.coefficients:q}"
        " --push-off {input.push_off:q} --last-frame {params.last_frame} --restart-frames {resources.restart_frames}"
        " --work {params.work:q}"
        " --executable {resources.executable:q} --launcher={resources.mpi:q} --ranks {resources.tasks}"
        " --budget-min $(({resources.runtime} * {resources.budgeted})) --attempts {params.attempts:q}"
        " --dump {output.dump:q} --restarts {params.restarts:q} --log {output.log:q} --thermo {output.thermo:q}"
        " --run {output.run:q} --cost {output.cost:q}"
        " 2>&1 | tee {log:q}"
