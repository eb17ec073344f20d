"""What the rules share: the configuration, checked before any job, the lists that follow from it, and functions.

REQUIRED INPUTS:
    config                  the merged configuration of Snakemake
    config[slurries]        table of slurries

OUTPUTS: the names in capital letters below, and the functions with which rules state inputs, parameters and resources.
"""

import json
import os
import shlex
import sys
import types
from pathlib import Path

sys.path.insert(0, str(Path(workflow.basedir) / "scripts"))
from slurrycast.runtime import environment

try:
    environment.isolate_jobs(scripts=Path(sys.path[0]), cache=Path(".snakemake").absolute())
except environment.InputError as error:
    raise WorkflowError(str(error)) from None

from slurrycast import surrogates
from slurrycast.config import configuration, dem_checks, derived_runs, exploration, formulations
from slurrycast.config import label_settings, model_checks, physics
from slurrycast.runtime import provenance
from slurrycast.runtime.dependencies import modules, templates
from slurrycast.runtime.files import VERSIONS_VARIABLE
from slurrycast.dem import neighbour_lists
from slurrycast.dem.lammps_run import steps_per_frame
from slurrycast.dem.recipe import particle_counts, particle_types

MADE_WITH = provenance.made_with()
VERSIONS = provenance.name_of(MADE_WITH)
os.environ[VERSIONS_VARIABLE] = VERSIONS  # written beside the checksum of every output

# Snakemake merges what a user sets with config.yaml. A recipe is one thing: phases that the user sets replace those there.
OWN_FORMULATION = workflow.config_settings.overwrite_config.get("formulation")
if isinstance(OWN_FORMULATION, dict) and "phases" in OWN_FORMULATION:
    config["formulation"] |= {"expected_density_g_cm3": None} | OWN_FORMULATION

try:
    SLURRY_TABLE = configuration.checked_slurries(config)
    POINTS, DESIGN_PROBLEMS = configuration.checked_points(config, SLURRY_TABLE)
except configuration.ConfigurationError as error:
    raise WorkflowError(*error.lines, "Nothing was run.") from None

WRITTEN = configuration.in_order(config)
# Recipes of an exploration stay out of the configuration, which is kept with the results and handed to scripts.
WITH_POINTS = formulations.wet_recipes(exploration.with_points(WRITTEN, POINTS.values()))
config = {**WITH_POINTS, "formulations": {id: WITH_POINTS["formulations"][id] for id in WRITTEN["formulations"]}}
SLURRIES = {slurry.id: slurry for slurry in SLURRY_TABLE}
if workflow.is_main_process:
    for line in model_checks.model_warnings(config, SLURRY_TABLE):
        print(line, file=sys.stderr)

TRAINING_NEEDED = label_settings.training_needed(config)
if not TRAINING_NEEDED:
    SLURRIES = {id: slurry for id, slurry in SLURRIES.items() if slurry.role != "train"}  # not needed

REPLICAS = {run.id: run for run in derived_runs.replicas(config, SLURRIES.values())}
TIMESTEP_RUNS = {run.id: run for run in derived_runs.timestep_runs(config, SLURRIES.values())}
# every possible run of the DEM
RUNS = SLURRIES | REPLICAS | TIMESTEP_RUNS | {id: point.slurry for id, point in POINTS.items()}

# The configuration as it holds for each recipe, by name; the default has none.
RECIPES = {name: formulations.of_recipe(WITH_POINTS, name) for name in ["", *WITH_POINTS["formulations"]]}
PHASES = formulations.all_phases(config)  # their order numbers them for what learns from slurries of several recipes

RESULTS = f"results/{config['run']['name']}"
SURROGATES = config["surrogate"]["names"]  # in the main job
FURTHER = config["evaluation"]["surrogates"]
LEFT_OUT = []  # surrogates that need training slurries, where there are none
if not any(slurry.role == "train" for slurry in SLURRIES.values()):
    LEFT_OUT = [label for label in [*SURROGATES, *FURTHER] if not label_settings.without_training(config, label)]
    SURROGATES, FURTHER = ([label for label in labels if label not in LEFT_OUT] for labels in (SURROGATES, FURTHER))
if LEFT_OUT and workflow.is_main_process:
    print(f"surrogates {', '.join(LEFT_OUT)}: {label_settings.WITHOUT_TRAINING}", file=sys.stderr)
LABELS = {text: surrogates.parse(text) for text in [*SURROGATES, *FURTHER]}
KINDS = {text: label.surrogate for text, label in LABELS.items()}
# Paths of models that were trained elsewhere, by label, and networks that this run trains.
ADOPTED = {text: path for text, path in label_settings.adopted_models(config).items() if text in LABELS}
TRAINED = [text for text in LABELS if KINDS[text].is_trained and text not in ADOPTED]
DESCRIBED = [text for text in LABELS if KINDS[text].is_learned and text not in ADOPTED]
LEARNED = [text for text in SURROGATES if KINDS[text].is_trained]
FITTED = [text for text in SURROGATES if KINDS[text].is_fitted]
SPREADING = [text for text in LABELS if KINDS[text].has_spread]  # with an uncertainty to calibrate
BOXED = [text for text in SURROGATES if KINDS[text].needs_packing_fraction]
# Those whose particles are where the DEM's are, so that coordinates can be compared: in the main job, and of all.
TRACKED = [text for text in SURROGATES if not KINDS[text].from_recipe]
ALL_TRACKED = [text for text in LABELS if not KINDS[text].from_recipe]
INPUT_FRAMES = config["learning"]["input_frames"]
TARGET_FRAME = config["learning"]["target_frame"]
FRAME_STEPS = steps_per_frame(config["dem"])
RELAXATION_STEPS = sorted(config["evaluation"]["relaxation_steps"])


def with_role(*roles):
    """Ids of the slurries that have one of the roles, in the order of the table."""
    return [slurry.id for slurry in SLURRIES.values() if slurry.role in roles]


PACKING_GIVEN = config["surrogate"]["packing_fraction"] is not None
TRAINING = with_role("train")
COMPLETE = with_role("train", "validation", "test")  # run to the end
HELD_OUT = with_role("validation", "test")  # predicted, and compared with their own end
ROLE_OF_SET = {"training": "train", "validation": "validation", "test": "test"}  # role of the slurries of a data set
TRAINING_SET = f"{RESULTS}/dataset/training.h5"
HELD_OUT_SETS = []  # whose errors join the learning curves of networks that learn from samples
if config["learning"]["held_out_curves"]:
    HELD_OUT_SETS = [name for name in ("validation", "test") if with_role(name)]
PREDICTED = with_role("validation", "test", "new")
# Slurries with a DEM: those of role `new` only if a surrogate of the main job takes frames from it.
SIMULATED = [id for id, slurry in SLURRIES.items() if slurry.role != "new" or TRACKED]
RANGE_KNOWN = bool((TRAINING or ADOPTED) and TRACKED)  # what takes no frames leaves no range
PICTURED = [label for label in config["report"]["pictures"] if label in SURROGATES]
EVALUATED = list(LABELS)
ABLATION = [text for text, label in LABELS.items() if label.name in ("vgg16", "vgg16_box")]
HAS_ABLATION = bool(TRAINING) and TRAINING_NEEDED and any(LABELS[text].settings for text in ABLATION)
HAS_RELAXATION = bool(RELAXATION_STEPS and with_role("validation"))


def checked_ids(key, ids, allowed):
    """The slurries that a setting names; an error, only for targets that need them, if one is not allowed."""
    for id in ids:
        if id not in allowed:
            raise WorkflowError(f"{key}: {id!r}: must be one of {', '.join(allowed)} for this target")
    return ids


def required(role, reason=""):
    """Slurries of a role; an error, only for targets that need them, if there are none."""
    slurries = with_role(role)
    if not slurries:
        raise WorkflowError(
            f"{config['slurries']}: no slurry of role {role}: must be at least one for this target{reason}"
        )
    return slurries


def sized(path):
    """Outputs `path` of the surrogates that have a box of their own; an error if there are none, or no test slurries."""
    required("test")
    if not TRACKED:
        raise WorkflowError("surrogate.names: must hold one that takes frames for this target, such as affine")
    return expand(path, surrogate=TRACKED, slurry=HELD_OUT)


def project_file(path):
    """Path of a file of the project from the working directory, which `--directory` or `-s` may set elsewhere."""
    return os.path.relpath(Path(workflow.basedir, path).resolve())


def code(script, loads_surrogate=False):
    """The script "stage/stem" of a rule and the modules that it imports, as inputs, so that an edit reruns the rule."""
    path = f"scripts/{script}.py"
    of_script = lambda surrogate=None: [project_file(module) for module in modules(path, surrogate)]
    of_surrogate = lambda wildcards: of_script(LABELS[wildcards.surrogate].name)
    return {"script": project_file(path), "modules": of_surrogate if loads_surrogate else of_script()}


def page_templates(page):
    """Templates of a page, "report" or "evaluation", as inputs."""
    return [project_file(template) for template in templates(page)]


def lammps_scripts(*stems):
    """Scripts in scripts/lammps, as inputs."""
    return [project_file(f"scripts/lammps/{stem}.lmp") for stem in stems]


def reported(path, caption, category, **labels):
    """An output in the results folder that `snakemake --report` shows, with its caption in workflow/report."""
    caption = Path(workflow.basedir) / "workflow" / "report" / f"{caption}.rst"
    return report(f"{RESULTS}/{path}", caption=str(caption), category=category, labels=labels)


def section(value):
    """A part of the configuration as one line of JSON, as scripts read it."""
    return json.dumps(value, ensure_ascii=False)


def config_of(slurry):
    """The configuration as it holds for a slurry: with `formulation`, `force_field` and `drying` of its recipe."""
    return RECIPES[RUNS[slurry].formulation]


def particles(slurry):
    """Number of particles of a slurry."""
    formulation = config_of(slurry)["formulation"]
    mass_pg = RUNS[slurry].mass_units * formulation["unit_mass_pg"]
    return int(particle_counts(particle_types(formulation["phases"]), mass_pg).sum())


def slurry_mb(wildcards, attempt):
    """Memory in MB of a job that holds one slurry in LAMMPS, or its frames and their neighbours."""
    return attempt * (1000 + particles(wildcards.slurry) // 20)


def last_frame(wildcards):
    """Last frame of the DEM; for a slurry of role `new` the last input frame that any surrogate of the main job needs."""
    if RUNS[wildcards.slurry].role == "new":
        return max(map(max, [INPUT_FRAMES, *map(input_frames, SURROGATES)]))
    return config["dem"]["frames"] - 1


def restart_frames(wildcards):
    """Frames at which the DEM of a slurry keeps a restart file: the last input frame, and where surrogates continue it."""
    predicted_by = {"new": SURROGATES, "validation": LABELS, "test": LABELS}.get(RUNS[wildcards.slurry].role, [])
    frames = {max(input_frames(label)) for label in predicted_by if KINDS[label].continues_dem}
    return " ".join(map(str, sorted(frames | {max(INPUT_FRAMES)})))


def dem_priority(wildcards):
    """Training slurries first, so that training runs beside the held-out ones; in each group the longest first."""
    run = RUNS[wildcards.slurry]
    return run.mass_units + {"train": 2000, "replica": 0, "timestep": 0}.get(run.role, 1000)


# How LAMMPS is started stands among the resources, since a change of it is no reason to run a slurry again.
LAMMPS_JOB = {
    "mpi": config["dem"]["launcher"] if config["dem"]["ranks"] > 1 else "",  # Slurm wants no launcher for one task
    "tasks": config["dem"]["ranks"],
    "cpus_per_task": 1,
    "executable": config["dem"]["executable"],
}

# Whether DEM jobs are killed at their walltime, so that they have to stop before it.
BUDGETED = workflow.remote_exec or config["dem"]["budget_min"] is not None


def dem_minutes(wildcards, attempt):
    """Walltime of the DEM of a slurry in minutes."""
    if config["dem"]["budget_min"] is not None:
        return config["dem"]["budget_min"]
    frame_steps = steps_per_frame(derived_runs.dem_settings(config, RUNS[wildcards.slurry]))
    return lammps_minutes(wildcards, last_frame(wildcards) * frame_steps, attempt)


def work_of_dem(wildcards):
    """Folder with the finished parts of a DEM, until its frames are extracted."""
    return f"{RESULTS}/dem/{wildcards.slurry}/work"


def lammps_minutes(wildcards, steps, attempt):
    """Walltime of `steps` of the DEM in minutes."""
    recipe = config_of(wildcards.slurry)
    types = particle_types(recipe["formulation"]["phases"])
    counts = particle_counts(types, RUNS[wildcards.slurry].mass_units * recipe["formulation"]["unit_mass_pg"])
    skin_um = neighbour_lists.skin_um(config["dem"], types)
    cost = neighbour_lists.relative_cost(types, counts, recipe["force_field"]["lennard_jones"], skin_um)
    particle_steps_per_s = 1.0e6 * config["dem"]["ranks"] / cost  # of slow cores
    return 10 + attempt * round(int(counts.sum()) * steps / particle_steps_per_s / 60)


def structure_minutes(wildcards, attempt):
    """Walltime in minutes of a job on the neighbours in one slurry; 1 ms per particle was measured."""
    return attempt * (5 + particles(wildcards.slurry) // 10000)


def input_frames(label):
    """Input frames of a surrogate."""
    return LABELS[label].input_frames(INPUT_FRAMES)


def input_steps(labels):
    """Steps of the DEM that each surrogate needs, as label=steps."""
    return [f"{label}={max(input_frames(label)) * FRAME_STEPS}" for label in labels]


def model_of(label):
    """Model file of a surrogate; an empty list if it has none."""
    file = KINDS[label].model_file
    return f"{RESULTS}/models/{label}/{file}" if file else []


def model_costs(labels):
    """Cost records of the models of networks, trained here or elsewhere."""
    stages = {label: "train_surrogate" if label in TRAINED else "adopt_model" for label in labels}
    return [f"{RESULTS}/costs/{stages[label]}/{label}.json" for label in labels]


def learns_from_frames(wildcards):
    """Whether a surrogate learns from whole slurries instead of the training set."""
    return KINDS[wildcards.surrogate].learns_from == "frames"


def learns_from_samples(wildcards):
    """Whether a network is trained here, on the samples of the training set."""
    return wildcards.surrogate in TRAINED and not learns_from_frames(wildcards)


def shows_held_out(wildcards):
    """Whether the learning curves of a network hold errors of held-out slurries."""
    return bool(HELD_OUT_SETS) and learns_from_samples(wildcards)


def fit_to_the_same_samples(wildcards):
    """Model of the first fit of the main job, with errors on the samples that a network is trained on; else nothing."""
    return f"{RESULTS}/models/{FITTED[0]}/model.json" if FITTED and learns_from_samples(wildcards) else []


def first_frame_seen():
    """Earliest last input frame that all surrogates of the main job learn from; some move their input frames back."""
    learned = [label for label in SURROGATES if label in DESCRIBED]
    last = max(INPUT_FRAMES)
    return min(last, max((label_settings.first_frame_seen(config, label) for label in learned), default=last))


def surrogate_settings(wildcards):
    """Settings of a surrogate; its variants share them. The model that its training starts from is an input."""
    settings = config["surrogate"].get(LABELS[wildcards.surrogate].name, {})
    return section({key: value for key, value in settings.items() if key != "start_from"})


def goes_on(wildcards):
    """Whether the surrogate continues the DEM."""
    return KINDS[wildcards.surrogate].continues_dem


def input_paths(wildcards):
    """Inputs of predict_slurry beside the model and the packing fraction: frames, the recipe, a DEM to continue."""
    surrogate = KINDS[wildcards.surrogate]
    paths = {} if surrogate.from_recipe else {"frames": rules.extract_frames.output.frames}
    if surrogate.from_recipe or surrogate.continues_dem:
        paths["inputs"] = rules.generate_inputs.output.inputs
    if surrogate.continues_dem:
        paths["coefficients"] = rules.generate_inputs.output.coefficients
        paths["lammps"] = project_file(f"scripts/lammps/{surrogate.dem_script}")
        paths["run"] = rules.run_slurry.output.run  # the restart files are beside it
    return paths


def input_options(input):
    """Options of predict_slurry for the frames or the recipe."""
    return [word for name in ("frames", "inputs") if name in input.keys() for word in (f"--{name}", input[name])]


def restart_file(wildcards):
    """Restart file from which a surrogate continues the DEM of a slurry."""
    return f"{RESULTS}/dem/{wildcards.slurry}/frame_{max(input_frames(wildcards.surrogate))}.restart"


def continuation_options(wildcards, input):
    """Options of predict_slurry for a surrogate that continues the DEM."""
    if not goes_on(wildcards):
        return []
    restart = restart_file(wildcards)
    work = f"{RESULTS}/hybrid/{wildcards.surrogate}/{wildcards.slurry}/work_dem"
    options = {"restart": restart, "coefficients": input.coefficients, "work": work}
    return [word for name, value in options.items() for word in (f"--{name}", value)]


def prediction_group(wildcards):
    """Group of a prediction: on a cluster short ones share a job, and one that continues the DEM has a job alone."""
    return "predictions" if workflow.non_local_exec and not goes_on(wildcards) else None


def prediction_minutes(wildcards, attempt):
    """Walltime of a prediction in minutes."""
    if goes_on(wildcards):
        most_steps = KINDS[wildcards.surrogate].most_steps(config["surrogate"][LABELS[wildcards.surrogate].name])
        return lammps_minutes(wildcards, most_steps, attempt)
    return attempt * (10 + particles(wildcards.slurry) // 2000)


def prediction_mb(wildcards, attempt):
    """Memory of a prediction in MB: TensorFlow and the neighbours of all particles, or the slurry in LAMMPS."""
    if goes_on(wildcards):
        return slurry_mb(wildcards, attempt)
    return attempt * (3000 + particles(wildcards.slurry) // 10)


def relaxation(wildcards):
    """Settings of a relaxation; the wildcard `-500` stands for 500 steps, an empty one for those of the configuration."""
    bounds = ("max_kinetic_share", "pressure_within")  # only checked
    settings = {key: value for key, value in config["relaxation"].items() if key not in bounds}
    return settings | {"steps": int(wildcards.steps.removeprefix("-") or settings["steps"])}


def timestep_runs():
    """Ids of the runs of the convergence study."""
    checked_ids("convergence.slurry", [config["convergence"]["slurry"]], COMPLETE)
    return list(TIMESTEP_RUNS)


def target_frames(wildcards):
    """Frames of the DEM with the target that a structure is compared with, if it has one."""
    return [f"{RESULTS}/frames/{wildcards.slurry}.h5"] if wildcards.slurry in HELD_OUT else []


def target_options(wildcards, input):
    """Options of a script for the target that a structure is compared with."""
    return ["--frames", *input.frames, "--target-frame", TARGET_FRAME] if input.frames else []


def rdf_pair(wildcards):
    """Option of compute_rdf for the pair of phases, if the slurry's recipe has both."""
    pair = config["analysis"]["rdf_pair"]
    return ["--pair", *pair] if {*pair} <= {*config_of(wildcards.slurry)["formulation"]["phases"]} else []


# The ids themselves, since any other pattern splits names like coordinates_vgg16_6_r1 in the wrong place.
wildcard_constraints:
    slurry="|".join(RUNS),
    surrogate="|".join(LABELS),
    source="|".join(["dem", *LABELS]),
    stage="slurry|tape",
    set="|".join(ROLE_OF_SET),
    verdicts="verdicts|tape_verdicts",
    # no id has a hyphen; in brackets, since Snakemake ignores an empty pattern
    steps=f"(?:{'|'.join(['', *(f'-{steps}' for steps in RELAXATION_STEPS)])})",
