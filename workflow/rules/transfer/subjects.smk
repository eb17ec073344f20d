"""What is trained further, and on which slurries of a recipe that the surrogates were not trained on.

REQUIRED INPUTS:
    config[transfer], the slurry table

OUTPUTS: functions and lists
"""

TUNING = config["transfer"]["networks"] if config["transfer"]["slurries"] else {}
TUNINGS = [
    f"{surrogate}_{start}_{count}"
    for surrogate in TUNING
    for start in ("fine_tuned", "from_scratch")
    for count in config["transfer"]["counts"]
    if count or start == "fine_tuned"
]


wildcard_constraints:
    start="fine_tuned|from_scratch",
    number="[0-9]+",


def recipes_elsewhere():
    """Recipes that surrogates know from elsewhere, and from a training that went on here; None if some are unknown."""
    recipes = {}
    for label in LABELS:
        if path := ADOPTED.get(label) or start_of(label):
            known = model_checks.recipes_trained_on(config, SLURRY_TABLE, path)
            own = [] if label in ADOPTED else sorted({SLURRIES[id].formulation for id in TRAINING})
            recipes[label] = [*own, *([None] if known is None else known)]
    return recipes


def tuned_on(wildcards):
    """Frames of the slurries of another recipe that a surrogate is trained on."""
    return expand(rules.extract_frames.output.frames, slurry=tuning_slurries(wildcards))


def tuning_slurries(wildcards):
    """Slurries of another recipe that a surrogate is trained on."""
    return config["transfer"]["slurries"][: int(wildcards.number)]


def tuning_packing(wildcards):
    """Packing fraction of the recipe that a surrogate is tuned to."""
    return expand(rules.measure_packing.output.packing, recipe=packing_file(config["transfer"]["slurries"][0]))


def tuning_settings(wildcards):
    """Settings of a surrogate with epochs and learning rate of this training."""
    own = config["surrogate"][LABELS[wildcards.surrogate].name] | TUNING[wildcards.surrogate][wildcards.start]
    return {key: value for key, value in own.items() if key != "start_from"}


def tuning_mb(wildcards, attempt):
    """Memory of this training in MB."""
    return mb_to_train(wildcards, [*TRAINING, *config["transfer"]["slurries"]], attempt)


def tuning_minutes(wildcards, attempt):
    """Walltime of this training in minutes."""
    return minutes_to_train(tuning_settings(wildcards), tuning_slurries(wildcards), attempt)
