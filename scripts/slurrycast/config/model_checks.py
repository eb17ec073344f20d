"""Checks of trained models that a run takes from elsewhere, to use as they are or to train on.

Each check takes the configuration and the good rows of the slurry table, and yields a line for each problem. What was
trained elsewhere says in a file beside it on what (`surrogates.trained_on`).
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

from slurrycast import surrogates
from slurrycast.config.formulations import all_phases, wet_recipes
from slurrycast.config.label_settings import adopted_models
from slurrycast.config.physics import flat_settings, physics
from slurrycast.config.schema_errors import shown
from slurrycast.config.slurry_table import Slurry
from slurrycast.config.surrogate_checks import is_file
from slurrycast.runtime.files import InputError, checksum
from slurrycast.surrogates.stored_model import input_shapes, stored_layers
from slurrycast.surrogates.trained_on import beside, read_trained_on, recipe_of


def other_recipes(config: Mapping, slurries: Sequence[Slurry], known: Mapping) -> Iterator[tuple[str, str]]:
    """Slurries to predict that are of no recipe that a model was trained on, each with how the nearest one differs."""
    recipes = [dict(flat_settings(recipe)) for recipe in known["recipes"]]
    wet = wet_recipes(config)
    for slurry in slurries:
        if slurry.role == "train" or slurry.formulation not in ("", *config["formulations"]):
            continue  # the latter is reported by `recipe_names`
        now, differing = dict(flat_settings(recipe_of(physics(wet, slurry)))), []
        for recipe in recipes:
            keys = [key for key in dict.fromkeys([*now, *recipe]) if key not in now or recipe.get(key) != now[key]]
            differing.append((len(keys), keys, recipe))
        count, keys, recipe = min(differing, key=lambda one: one[0])
        if count:
            was, has = (shown(each[keys[0]]) if keys[0] in each else "nothing" for each in (recipe, now))
            more = f" (and {count - 1} more)" if count > 1 else ""
            yield slurry.id, f"was trained with {keys[0]} = {was}, slurry {slurry.id} has {has}{more}"


def models_of_other_training(config: Mapping, slurries: Sequence[Slurry]) -> Iterator[str]:
    """A model that was trained elsewhere is of the same surrogate, input frames and, unless asked for, recipe."""
    for label, path in _adopted(config):
        key = f"surrogate.models.{label} = {shown(path)}"
        frames = surrogates.parse(label).input_frames(config["learning"]["input_frames"])
        try:
            problem, known = unusable(surrogates.parse(label), path, len(frames)), described(path)
        except InputError as error:
            yield f"{key}: {error}"
            continue
        if problem:
            yield f"{key}: {problem}"
            continue
        if known is None:
            continue  # said by `model_warnings`
        asked = {"surrogate": label, "input_frames": frames, "target_frame": config["learning"]["target_frame"]}
        if wrong := [name for name, value in asked.items() if known[name] != value]:
            had, needed = shown(known[wrong[0]]), shown(asked[wrong[0]])
            yield f"{key}: was trained with {wrong[0].replace('_', ' ')} {had}, needed is {needed}"
        elif unknown := [phase for phase in all_phases(config) if phase not in known["phases"]]:
            yield f"{key}: was trained without a phase {unknown[0]}: must know all phases"
        elif config["surrogate"]["other_recipe"] == "refuse":
            for _, how in other_recipes(config, slurries, known):
                yield f"{key}: {how}: must be the same, or set surrogate.other_recipe: warn"
                break


def unusable(label: surrogates.Label, path: str, n_frames: int) -> str | None:
    """What keeps a stored model from being used as it is; its settings may be others than those of this run."""
    layers = stored_layers(path)
    try:
        shapes, expected = input_shapes(layers), label.surrogate.input_shapes(n_frames, label.settings)
        # a network with one input may call it as it likes
        named = shapes if len(shapes) > 1 else dict.fromkeys(expected, *shapes.values())
        if any(named.get(name) != shape for name, shape in expected.items()):
            return f"takes inputs of shape {_listed(shapes)}, {label.text} needs {_listed(expected)}"
        is_known = label.surrogate.knows(layers)
    except (KeyError, TypeError):  # of a file that has layers of other kinds than Keras writes
        is_known = False
    return None if is_known else f"is no model of {label.name}, or one of an earlier version: train it again"


def described(path: str) -> dict | None:
    """What is known of a stored model, None if nothing. InputError if it is known of another one."""
    known = read_trained_on(beside(path))
    if known and known["model_sha256"] != checksum(path):
        raise InputError(f"{beside(path)}: is of another model than {Path(path).name} beside it")
    return known


def recipes_trained_on(config: Mapping, slurries: Sequence[Slurry], path: str) -> list[str] | None:
    """Names of the recipes to predict that a stored model was trained on; None if it does not say."""
    if (known := read_trained_on(beside(path))) is None:
        return None
    others = {id for id, _ in other_recipes(config, slurries, known)}
    return sorted({each.formulation for each in slurries if each.role != "train" and each.id not in others})


def model_warnings(config: Mapping, slurries: Sequence[Slurry]) -> Iterator[str]:
    """What is to be said of models that were trained elsewhere, in a configuration without problems."""
    for label, path in _adopted(config):
        known = read_trained_on(beside(path))
        if known is None:
            yield (
                f"{path}: no {beside(path).name} beside it: whether {label} was trained on this recipe, scale and "
                "input frames cannot be checked"
            )
        elif others := list(other_recipes(config, slurries, known)):
            more = f"; another recipe too: slurries {', '.join(id for id, _ in others[1:])}" if others[1:] else ""
            yield f"{path}: {others[0][1]}{more}"


def starts(config: Mapping, _) -> Iterator[str]:
    """A model that a training starts from fits in layers and input frames, and is not what this run makes of it."""
    for text in [*config["surrogate"]["names"], *config["evaluation"]["surrogates"]]:
        try:
            label = surrogates.parse(text)
        except InputError:
            continue  # reported by `labels`
        settings = config["surrogate"].get(label.name, {})
        is_trained = label.surrogate.is_trained and text not in adopted_models(config)
        if not is_trained or (path := settings.get("start_from")) is None:
            continue
        what = f"surrogate.{label.name}.start_from = {shown(path)}"
        if not is_file(path):
            yield f"{what}: no such file: must be null or a trained model.keras"
        elif problem := start_problem(config, label, path):
            yield f"{what}: {problem}"


def start_problem(config: Mapping, label: surrogates.Label, path: str) -> str | None:
    """What keeps the training of a surrogate from going on with the model at `path`, if anything does."""
    written = Path("results") / config["run"]["name"] / "models"
    if Path(path).resolve().is_relative_to(written.resolve()):
        return f"must lie outside {written}, which this run writes: choose another run.name"
    frames, phases = label.input_frames(config["learning"]["input_frames"]), all_phases(config)
    try:
        known = described(path)
    except InputError as error:
        return str(error)
    if problem := training_misfit(config, label, path, len(phases)):
        return problem
    for key, value in {"surrogate": label.text, "input_frames": frames, "phases": phases}.items():
        if known and known[key] != value:
            return f"was trained with {key.replace('_', ' ')} {shown(known[key])}, needed is {shown(value)}"
    return None


def training_misfit(config: Mapping, label: surrogates.Label, path: str, n_phases: int) -> str | None:
    """What of a stored model keeps a training with these settings and number of phases from going on with it."""
    n_frames = len(label.input_frames(config["learning"]["input_frames"]))
    try:
        problem = label.surrogate.misfit(
            stored_layers(path), n_frames, n_phases, {**config["surrogate"][label.name], **label.settings}
        )
    except InputError as error:
        return str(error)
    except (KeyError, TypeError):  # of a file that has layers of other kinds than Keras writes
        return "is no model of this kind"
    return f"{problem}, for {label.text}" if problem else None


def tuning_tests(config: Mapping, slurries: Iterable[Slurry]) -> list[str]:
    """Slurries that the networks of the study `transfer` predict: others of the recipe that they are trained on."""
    slurries, tuned = list(slurries), config["transfer"]["slurries"]
    recipes = {slurry.formulation for slurry in slurries if slurry.id in tuned}
    return [
        each.id for each in slurries if each.role == "test" and each.formulation in recipes and each.id not in tuned
    ]


def tuning(config: Mapping, slurries: Sequence[Slurry]) -> Iterator[str]:
    """The slurries of the study `transfer` are test slurries of one recipe, its networks are there and can be tuned."""
    study, by_id = config["transfer"], {slurry.id: slurry for slurry in slurries}
    if not study["slurries"]:
        return
    key = f"transfer.slurries = {shown(study['slurries'])}"
    wrong = [id for id in study["slurries"] if id not in by_id or by_id[id].role != "test"]
    if wrong:
        yield f"{key}: {wrong[0]}: must be a slurry of role test"
        return
    if len({by_id[id].formulation for id in study["slurries"]}) > 1:
        yield f"{key}: must be of one formulation"
    elif not tuning_tests(config, slurries):
        yield f"{key}: must leave a test slurry of their formulation, to predict"
    if max(study["counts"]) > len(study["slurries"]):
        yield f"transfer.counts = {shown(study['counts'])}: must be at most {len(study['slurries'])}, those slurries"
    labels = [*config["surrogate"]["names"], *config["evaluation"]["surrogates"]]
    for label in study["networks"]:
        try:
            is_network = label in labels and surrogates.parse(label).surrogate.is_trained
        except InputError:
            continue  # reported by `labels`
        if not is_network:
            yield f"transfer.networks: {shown(label)}: must be a network of surrogate.names or evaluation.surrogates"
    if max(study["counts"]) == 0:
        return
    for label, path in _adopted(config):
        if label in study["networks"]:
            known = read_trained_on(beside(path))
            phases = known["phases"] if known else all_phases(config)
            if problem := training_misfit(config, surrogates.parse(label), path, len(phases)):
                yield f"transfer.networks: surrogate.models.{label} = {shown(path)} cannot be trained on: {problem}"


def _listed(shapes: Mapping[str, tuple[int | None, ...]]) -> str:
    return ", ".join(" x ".join(map(str, shape)) for shape in shapes.values()) or "none"


def _adopted(config: Mapping) -> list[tuple[str, str]]:
    """Labels and paths of models that were trained elsewhere and are there; other problems are said by `models`."""
    labels = [*config["surrogate"]["names"], *config["evaluation"]["surrogates"]]
    try:
        networks = [text for text in labels if surrogates.parse(text).surrogate.is_trained]
    except InputError:
        return []  # reported by `labels`
    return [(label, path) for label, path in adopted_models(config).items() if label in networks and is_file(path)]
