"""What the configuration means for one label of a surrogate."""

from collections.abc import Mapping

from slurrycast import surrogates

WITHOUT_TRAINING = (
    "left out, as this run has no training slurries to learn from, or to take a packing fraction from "
    "(surrogate.packing_fraction)"
)


def adopted_models(config: Mapping) -> dict[str, str]:
    """Paths of the models that were trained elsewhere, by the label of their surrogate."""
    return dict(config["surrogate"]["models"])


def training_needed(config: Mapping) -> bool:
    """Whether a run takes its training slurries: not if all networks of surrogate.names were trained elsewhere.

    InputError if a label is not known.
    """
    networks = [label for label in config["surrogate"]["names"] if surrogates.parse(label).surrogate.is_trained]
    return not networks or not adopted_models(config).keys() >= set(networks)


def without_training(config: Mapping, label: str) -> bool:
    """Whether a surrogate can predict in a run that has no training slurries."""
    surrogate = surrogates.parse(label).surrogate
    if surrogate.needs_packing_fraction and config["surrogate"]["packing_fraction"] is None:
        return False
    return not surrogate.is_learned or label in adopted_models(config)


def first_frame_seen(config: Mapping, label: str) -> int:
    """Earliest last input frame that a surrogate learns from; most learn from the input frames alone."""
    parsed = surrogates.parse(label)
    frames = parsed.input_frames(config["learning"]["input_frames"])
    return parsed.surrogate.first_frame_seen(frames, config["surrogate"].get(parsed.name, {}))
