"""What is dried and measured: slurries, sources and settings, or an error for targets that need what is not there.

REQUIRED INPUTS:
    config[drying], config[relaxation], the slurry table

OUTPUTS: functions and lists
"""

from slurrycast.analysis.microstructure import MOST_PARTICLES


def equilibrated(wildcards):
    """The slurry that is dried: the DEM's, or one that a surrogate predicted and that was relaxed."""
    if wildcards.source == "dem":
        return f"{RESULTS}/frames/{wildcards.slurry}.h5"
    return f"{RESULTS}/hybrid/{wildcards.source}/{wildcards.slurry}/relaxed.h5"


def drying_settings(slurry):
    """Settings of a drying: of its section those that it depends on, and what it shares with the relaxation."""
    shared = ("pressure_damping_steps", "start_thermal_share")
    others = ("sources", "test_slurries", "replicas", "composition_is", "solvent_fraction_of")
    others += ("wet_thickness_um", "green_density_g_cm3")
    settings = {key: value for key, value in config_of(slurry)["drying"].items() if key not in others}
    return settings | {key: config["relaxation"][key] for key in shared}


def calibration_settings():
    """Settings of the calibration: those of a drying but for the friction, so that a new one repeats nothing."""
    settings = drying_settings(calibration_tape().slurry)
    force_field = {key: value for key, value in settings["force_field"].items() if key != "friction"}
    return settings | {"force_field": force_field}


def drying_minutes(wildcards, attempt):
    """Walltime of a drying in minutes."""
    settings = config["drying"]
    steps = settings["stages"] * settings["steps_per_stage"] + settings["rest_steps"]
    return lammps_minutes(wildcards, steps, attempt)


def dried_slurries(source):
    """Slurries that the main job dries, those that have a DEM first: that of one of role `new` does not run to its end.

    What only the evaluation predicts has no slurries of role `new`.
    """
    test = with_role("test")[: config["drying"]["test_slurries"]]
    return [*test, *(with_role("new") if source in SURROGATES else [])]


def sources_of(slurry):
    """Sources of the tapes of a slurry."""
    return [source for source in DRIED if slurry in dried_slurries(source)]


# Those that this run has: in the main job, and in the evaluation. Whether the main job dries anything: there are sources
# and slurries for them.
DRIED, JUDGED = (
    [source for source in config["drying"]["sources"] if source in ["dem", *labels]] for labels in (SURROGATES, LABELS)
)
HAS_TAPES = any(map(dried_slurries, DRIED))
DRIED_REPLICAS = [run.id for run in derived_runs.dried_replicas(config, SLURRIES.values())]  # in the main job
GREEN = config["drying"]["green_density_g_cm3"]  # measured, None if not
# Whether tapes of surrogates are judged beside those of the DEM.
JUDGES_TAPES = bool("dem" in JUDGED and JUDGED[1:] and with_role("test"))
SHOWN_TAPES = [slurry for source in DRIED for slurry in dried_slurries(source)][:1]  # in figures of one slurry
PICTURED_TAPES = SHOWN_TAPES if PICTURED else []


def pictured_source(slurry):
    """Source of the slurry that is shown beside its tapes: the DEM, if that is dried."""
    return min(sources_of(slurry), key=lambda source: source != "dem")


def microstructure_options(wildcards):
    """Options of measure_microstructure; diffusion is solved only for the first tapes, as it takes long."""
    drying, settings = config_of(wildcards.slurry)["drying"], config["microstructure"]
    options = ["--organic", drying["phase"], "--spacing-um", settings["spacing_um"]]
    if wildcards.stage == "slurry":
        options += ["--solvent-mass-fraction", drying["solvent_mass_fraction"]]
    elif drying["wet_thickness_um"] is not None:
        options += ["--wet-thickness-um", drying["wet_thickness_um"]]
    # replicas as the slurry that they repeat, for the scatter
    slurry = wildcards.slurry.rpartition("_r")[0] if wildcards.slurry in REPLICAS else wildcards.slurry
    first = dried_slurries(wildcards.source)[: settings["tortuosity_slurries"]]
    is_explored = slurry in POINTS and any(name.startswith("tortuosity_") for name in config["explore"]["properties"])
    is_solved = is_explored or (slurry in first and wildcards.stage in settings["tortuosity_stages"])
    if is_solved and settings["tortuosity_spacings_um"]:
        options += ["--tortuosity-spacings-um", *settings["tortuosity_spacings_um"]]
        options += ["--tortuosity-axes", *settings["tortuosity_axes"], "--tortuosity-of", *settings["tortuosity_of"]]
        options += ["--tortuosity-extrapolated"] * settings["tortuosity_extrapolated"]
    return options


def tapes(path, **wildcards):
    """Outputs `path` for every source and every slurry that the main job dries; an error if there are none."""
    if not HAS_TAPES:
        raise WorkflowError(
            f"drying.sources = {section(config['drying']['sources'])}: must be at least one of "
            f"{', '.join(['dem', *SURROGATES])} with a slurry of role test for this target"
        )
    return [
        tape for source in DRIED for tape in expand(path, source=source, slurry=dried_slurries(source), **wildcards)
    ]


def dried(path, **wildcards):
    """The same and outputs `path` of the replicas that are dried."""
    return [*tapes(path, **wildcards), *expand(path, source="dem", slurry=DRIED_REPLICAS, **wildcards)]


def judged_tapes(path):
    """Outputs `path` for every tape that is judged, or an error if there are none to compare."""
    if not JUDGES_TAPES:
        raise WorkflowError(
            f"drying.sources = {section(config['drying']['sources'])}: must be dem and at least one of "
            f"{', '.join(LABELS)} with a slurry of role test for this target"
        )
    return expand(path, source=JUDGED, slurry=with_role("test"), stage="tape")


def microstructure_mb(wildcards, attempt):
    """Memory in MB of the measures of one slurry or tape: `slurry_mb`, and some 100 bytes for each voxel.

    130 bytes for each voxel were measured of a tortuosity through the void, which is solved in a layer of large slurries.
    """
    settings = config["microstructure"]
    image_mb = 1e-4 * voxels(wildcards, settings["spacing_um"])
    if "--tortuosity-spacings-um" in microstructure_options(wildcards):
        layer = min(1, MOST_PARTICLES / particles(wildcards.slurry))
        image_mb = max(image_mb, 2e-4 * layer * voxels(wildcards, min(settings["tortuosity_spacings_um"])))
    return slurry_mb(wildcards, attempt) + round(attempt * image_mb)


def microstructure_minutes(wildcards, attempt):
    """Walltime in minutes of the measures; 2 to 4 us for each voxel were measured of a solution of the diffusion."""
    settings = config["microstructure"]
    solutions = len(settings["tortuosity_axes"]) * len(settings["tortuosity_of"])
    solved = sum(voxels(wildcards, spacing_um) for spacing_um in settings["tortuosity_spacings_um"])
    return structure_minutes(wildcards, attempt) + round(attempt * 10 * 4e-6 / 60 * solutions * solved)


def voxels(wildcards, spacing_um):
    """Number of voxels of a slurry."""
    formulation = config_of(wildcards.slurry)["formulation"]
    mass_pg = RUNS[wildcards.slurry].mass_units * formulation["unit_mass_pg"]
    return mass_pg / formulations.expected_density_g_cm3(formulation) / spacing_um**3


def calibration_tape():
    """Source and slurry of the tape that the friction is calibrated on, the first one, as wildcards."""
    source, slurry = tapes("{source} {slurry}")[0].split(" ")
    return types.SimpleNamespace(source=source, slurry=slurry)
