"""What the rules of the data set and of the surrogates share: functions.

REQUIRED INPUTS:
    config[learning], config[surrogate]

OUTPUTS: the functions with which these rules state inputs, parameters and resources.
"""

from slurrycast.surrogates import trained_on


def packing_file(slurry):
    """Wildcard `recipe` of the packing fraction that sets the predicted box of a slurry."""
    return "_" * bool(RUNS[slurry].formulation) + RUNS[slurry].formulation


def packing_sources(wildcards):
    """Structures that give the packing fraction of a recipe: training slurries, else what `direct` makes of it."""
    if PACKING_GIVEN:
        return []
    of_it = [slurry for slurry in SLURRIES if packing_file(slurry) == wildcards.recipe]
    if trained := [slurry for slurry in of_it if slurry in TRAINING]:
        return [f"{RESULTS}/frames/{slurry}.h5" for slurry in trained]
    return [f"{RESULTS}/hybrid/direct/{slurry}/relaxed.h5" for slurry in of_it if slurry in PREDICTED]


wildcard_constraints:
    recipe=f"(?:{'|'.join(map(packing_file, SLURRIES))})",  # in brackets, since Snakemake ignores an empty pattern


def descriptions(labels):
    """Files beside the models of surrogates that say what they were trained on, so that the models can be taken along."""
    return [f"{RESULTS}/models/{label}/trained_on.json" for label in labels if KINDS[label].is_learned]


def phases_of(label):
    """Names of the phases in the order of their numbers in training, which may have been elsewhere."""
    known = trained_on.read_trained_on(trained_on.beside(ADOPTED[label])) if label in ADOPTED else None
    return known["phases"] if known else PHASES


def there_beside(model):
    """Files beside a model from elsewhere that are read with it, as far as they are there."""
    files = [Path(model).with_name(name) for name in ("history.csv", trained_on.FILE)] if model else []
    return [str(file) for file in files if file.exists()]


def start_of(label):
    """Model file that the training of a surrogate starts from; an empty list if it starts anew."""
    return config["surrogate"].get(LABELS[label].name, {}).get("start_from") or []


def learned_from(wildcards):
    """Inputs of train_surrogate that hold the training data."""
    if not learns_from_frames(wildcards):
        held_out = expand(rules.assemble_dataset.output.dataset, set=HELD_OUT_SETS)
        return {"dataset": TRAINING_SET, "held_out": held_out}
    frames = rules.extract_frames.output.frames
    validation = expand(frames, slurry=with_role("validation"))
    return {"frames": expand(frames, slurry=TRAINING), "validation_frames": validation}


def learning_options(wildcards, input):
    """Options of train_surrogate for the training data."""
    if not learns_from_frames(wildcards):
        held_out = [f"{name}={path}" for name, path in zip(HELD_OUT_SETS, input.held_out)]
        return ["--dataset", input.dataset, *(["--held-out", *held_out] if held_out else [])]
    options = ["--frames", *input.frames, "--validation-frames", *input.validation_frames]
    options += ["--input-frames", *input_frames(wildcards.surrogate), "--target-frame", TARGET_FRAME]
    return [*options, "--phases", *PHASES]


def training_minutes(wildcards, attempt):
    """Walltime of a training in minutes."""
    return minutes_to_train(config["surrogate"][LABELS[wildcards.surrogate].name], TRAINING, attempt)


def minutes_to_train(settings, slurries, attempt):
    """The same of any settings and slurries; one step of the largest network takes less than 2 s on a slow core."""
    if "batch_size" in settings:
        updates = settings["epochs"] * sum(map(particles, slurries)) / settings["batch_size"]
    else:  # one slurry per update, which takes 2 s per 1000 particles at most with the default width and cutoff
        updates = settings["members"] * settings["epochs"] * sum(map(particles, slurries)) / 1000
    return 10 + attempt * int(updates / 30)


def training_mb(wildcards, attempt):
    """Memory of a training in MB."""
    return mb_to_train(wildcards, TRAINING, attempt)


def mb_to_train(wildcards, slurries, attempt):
    """The same on any slurries; where the network learns from whole slurries, it grows with the largest one.

    Measured: 3.9 GB for 1208 particles in the largest slurry, 5.5 GB for 2402 (cost.csv of the reference runs small and
    start).
    """
    if not learns_from_frames(wildcards):
        return attempt * 4000
    return attempt * (3000 + 3 * max(map(particles, slurries)) // 2)
