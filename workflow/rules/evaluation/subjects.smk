"""What the evaluation takes: slurries, surrogates and files, or an error for targets that need what is not there.

REQUIRED INPUTS:
    config[evaluation], config[relaxation], the slurry table

OUTPUTS: functions and a list
"""


def skilled():
    """Surrogates that have a skill; an error, only for targets that need it, without the one whose skill is 0."""
    if "affine" not in LABELS:
        raise WorkflowError(
            "evaluation.surrogates: must hold affine for this target, the zero of every skill, if surrogate.names does "
            f"not; {RESULTS}/tables/verdicts.csv does without"
        )
    return ALL_TRACKED


EVALUATED_REPLICAS = [run.id for run in derived_runs.evaluated_replicas(config, SLURRIES.values())]


def replicated():
    """Slurries that have replicas and a perturbed run."""
    required("test")
    if not config["evaluation"]["replicated"]:
        raise WorkflowError("evaluation.replicated = []: must be at least one slurry for this target")
    ids = checked_ids("evaluation.replicated", config["evaluation"]["replicated"], HELD_OUT)
    for line in dem_checks.replicated_pairs(config, [SLURRIES[id] for id in ids], [SLURRIES[id] for id in HELD_OUT]):
        raise WorkflowError(f"{line} for this target")
    return ids


def calibration_slurries():
    """Slurries on which the spread of a surrogate is calibrated."""
    return required("validation", f", the spread of {', '.join(SPREADING)} is calibrated on it")


def relaxed_for_steps(path):
    """Outputs `path` of relax_slurry for every surrogate, validation slurry and number of steps.

    The relaxation for relaxation.steps is that of the main job.
    """
    if not RELAXATION_STEPS:
        raise WorkflowError("evaluation.relaxation_steps = []: must be at least one number for this target")
    steps = ["" if number == config["relaxation"]["steps"] else f"-{number}" for number in RELAXATION_STEPS]
    return expand(path, surrogate=EVALUATED, slurry=required("validation"), steps=steps)


def structure_options(wildcards):
    """Inputs of measure_structure: the frames of the DEM, or a prediction and its relaxed structure."""
    slurry, source = wildcards.slurry, wildcards.source
    if source == "dem":
        return {"dem": f"{RESULTS}/frames/{slurry}.h5"}
    folder = f"{RESULTS}/hybrid/{source}/{slurry}"
    return {"predicted": f"{folder}/predicted.h5", "relaxed": f"{folder}/relaxed.h5"}


def dried_replicas():
    """Ids of the replicas that are dried, those of the evaluation and of the main job; an error if there are none."""
    if config["evaluation"]["replicated"] or not DRIED_REPLICAS:
        replicated()
    return list(REPLICAS)
