"""Checks across keys that a schema cannot express: surrogates, their labels and models.

Each check takes the configuration and the good rows of the slurry table, and yields a line for each problem.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from slurrycast import surrogates
from slurrycast.config.dem_checks import (
    increasing,
    mean_diameter_um,
    phase_counts,
    shortest_edges,
    whole_particles,
)
from slurrycast.config.derived_runs import replicas, timestep_runs
from slurrycast.config.formulations import of_slurry
from slurrycast.config.label_settings import adopted_models, training_needed, without_training
from slurrycast.config.schema_errors import down, shown
from slurrycast.config.slurry_table import Slurry
from slurrycast.runtime.files import InputError


def is_file(path: str) -> bool:
    """Whether a file exists at any text that may be a path."""
    try:
        return Path(path).is_file()
    except (OSError, ValueError):  # too long, or with a character that no path has
        return False


def roles(config: Mapping, slurries: Sequence[Slurry]) -> Iterator[str]:
    """There are slurries to learn from, and slurries to predict."""
    present = {slurry.role for slurry in slurries}
    if "train" not in present:
        try:
            names = config["surrogate"]["names"] if training_needed(config) else []
            needed = [text for text in names if not without_training(config, text)]
        except InputError:
            needed = []  # reported by `labels`
        if needed:
            must_be = f"must be at least one for {needed[0]}, or surrogate.models"
            yield f"{config['slurries']}: no slurry of role train: {must_be}"
    if not present & {"test", "new"}:
        yield f"{config['slurries']}: no slurry of role test or new: must be at least one"


def labels(config: Mapping, _) -> Iterator[str]:
    """Each label names a surrogate that can start at its last input frame, in one list only."""
    names, further = config["surrogate"]["names"], config["evaluation"]["surrogates"]
    target = config["learning"]["target_frame"]
    for key, texts in (("surrogate.names", names), ("evaluation.surrogates", further)):
        for text in texts:
            try:
                label = surrogates.parse(text)
            except InputError as error:
                yield f"{key}: {str(error).removeprefix('surrogate: ')}"
                continue
            surrogate, last = label.surrogate, label.last_frame
            n_frames = min(len(config["learning"]["input_frames"]), target if last is None else last + 1)
            if n_frames < surrogate.least_frames:
                least = f"at least {surrogate.least_frames} input frames, it has {n_frames}"
                yield f"{key}: {shown(text)}: must have {least}"
                continue
            if last is None:  # the last of the input frames
                continue
            if surrogate.from_recipe:
                yield f"{key}: {shown(text)}: must be {label.name}, which takes no frames"
            elif surrogate.learns_from == "samples":
                yield f"{key}: {shown(text)}: must be {label.name}, which learns from learning.input_frames only"
            elif not 0 < last < target:
                yield f"{key}: {shown(text)}: its last input frame must be 1 to {target - 1}, before the target frame"
    for text in further:
        if text in names:
            yield f"evaluation.surrogates: {shown(text)}: must not be in surrogate.names too"
    for text in config["report"]["pictures"]:
        if text not in names:
            yield f"report.pictures: {shown(text)}: must be one of surrogate.names, {', '.join(names)}"


def result_paths(config: Mapping, slurries: Sequence[Slurry]) -> Iterator[str]:
    """No two files of the results have one path. Folders keep ids and labels apart everywhere but in two places."""
    table, in_table = config["slurries"], {slurry.id for slurry in slurries}
    derived = dict.fromkeys(run.id for run in [*replicas(config, slurries), *timestep_runs(config, slurries)])
    ids = [slurry.id for slurry in slurries] + [run for run in derived if run not in in_table]
    for run in ids:  # structure/<source>/<id>.csv and <id>_rdf.csv
        if f"{run}_rdf" in in_table:
            yield f"{table}: slurries {run} and {run}_rdf would both write {run}_rdf.csv: rename one"
    pictured = config["report"]["pictures"]
    owners: dict[str, tuple[str, str]] = {}
    for label in [*pictured, *config["surrogate"]["names"], *config["evaluation"]["surrogates"]]:
        for run in ids:
            picture = f"slurry_{label}_{run}.png"
            first_label, first = owners.setdefault(picture, (label, run))
            # where both runs are derived, those that they derive from are named
            if first != run and first_label in pictured and in_table & {first, run}:
                yield (
                    f"{table}: {picture} would show slurry {first} of {first_label} and slurry {run} of {label}: "
                    "rename one"
                )


def neighbours_cutoff(config: Mapping, slurries: Sequence[Slurry]) -> Iterator[str]:
    """No particle has two periodic images of another one as neighbours."""
    used = [*config["surrogate"]["names"], *config["evaluation"]["surrogates"]]
    cutoff = config["surrogate"]["neighbours"]["cutoff_diameters"]
    if not any(surrogates.family(label) == "neighbours" for label in used) or not slurries:
        return
    edge_um, slurry_id = min(shortest_edges(config, slurries))
    half = edge_um / 2 / mean_diameter_um(config)
    if cutoff > half:
        yield (
            f"surrogate.neighbours.cutoff_diameters = {shown(cutoff)}: must be at most {down(half)}, half the shortest "
            f"edge that slurry {slurry_id} ends with, in mean diameters of its particles"
        )


def validation_share(config: Mapping, slurries: Sequence[Slurry]) -> Iterator[str]:
    """Particles are left on either side where samples are split."""
    share, roles = config["learning"]["validation_share"], ["train"]
    if config["learning"]["held_out_curves"]:
        roles += ["validation", "test"]
    for role in roles:
        of_role = [slurry for slurry in slurries if slurry.role == role]
        known = [slurry for slurry in of_role if slurry.formulation in ("", *config["formulations"])]
        if any(line for slurry in known for line in whole_particles(of_slurry(config, slurry), [slurry])):
            return
        n = sum(sum(phase_counts(config, slurry).values()) for slurry in known)
        if n and not 0 < round(share * n) < n:
            yield (
                f"learning.validation_share = {shown(share)}: must leave at least one of the {n} particles of role "
                f"{role} on either side"
            )


def early_dem(config: Mapping, _) -> Iterator[str]:
    """`early_dem` has time to find that its density is flat."""
    settings = config["surrogate"]["early_dem"]
    if settings["max_steps"] < settings["flat_steps"]:
        yield (
            f"surrogate.early_dem.max_steps = {settings['max_steps']}: must be at least "
            f"surrogate.early_dem.flat_steps = {settings['flat_steps']}"
        )


def packing_of_recipes(config: Mapping, slurries: Sequence[Slurry]) -> Iterator[str]:
    """A recipe without training slurries takes its packing fraction from `direct`, which is then there."""
    labels = [*config["surrogate"]["names"], *config["evaluation"]["surrogates"]]
    try:
        boxed = [label for label in labels if surrogates.parse(label).surrogate.needs_packing_fraction]
    except InputError:
        return  # reported by `labels`
    if not boxed or "direct" in labels or config["surrogate"]["packing_fraction"] is not None:
        return
    trained = {slurry.formulation for slurry in slurries if slurry.role == "train"}
    for slurry in slurries:
        if trained and slurry.formulation not in trained:
            name = f"formulation {slurry.formulation}" if slurry.formulation else "the default formulation"
            yield (
                f"surrogate.names: {boxed[0]} needs a packing fraction, and slurry {slurry.id} is of {name}, which has "
                "no training slurry: must hold direct too, which finds one"
            )
            return


def intermediate_targets(config: Mapping, _) -> Iterator[str]:
    """Intermediate targets increase, and the last layer is left for the target itself."""
    settings = config["surrogate"]["neighbours"]
    targets, layers = settings["intermediate_targets"], settings["layers"]
    key = f"surrogate.neighbours.intermediate_targets = {shown(targets)}"
    if not increasing(targets):
        yield f"{key}: must be strictly increasing"
    if len(targets) >= layers:
        yield f"{key}: must be at most {layers - 1}, one for each of surrogate.neighbours.layers but the last"


def models(config: Mapping, _) -> Iterator[str]:
    """Trained models exist, belong to networks of the run, and can predict without the training slurries."""
    names, further = config["surrogate"]["names"], config["evaluation"]["surrogates"]
    try:
        networks = [text for text in [*names, *further] if surrogates.parse(text).surrogate.is_trained]
    except InputError:
        return  # reported by `labels`
    for label, path in adopted_models(config).items():
        key = f"surrogate.models.{label} = {shown(path)}"
        if not is_file(path):
            yield f"{key}: no such file: must be a trained model.keras"
        if label not in networks:
            known = ", ".join(networks) or "none"
            yield f"{key}: must be of a network in surrogate.names or evaluation.surrogates, which are: {known}"
        elif label in names and not training_needed(config) and not without_training(config, label):
            yield (
                f"surrogate.packing_fraction = null: must be a number for {label} with surrogate.models: the training "
                "slurries, which would give it, are not run"
            )


def models_of_this_run(config: Mapping, _) -> Iterator[str]:
    """Trained models lie outside the folder that the run writes: the rule that copies one would delete it first."""
    written = Path("results") / config["run"]["name"] / "models"
    for label, path in adopted_models(config).items():
        if is_file(path) and Path(path).resolve().is_relative_to(written.resolve()):
            yield (
                f"surrogate.models.{label} = {shown(path)}: must lie outside {written}, which this run writes: "
                "choose another run.name"
            )
