"""What the configuration means for one label of a surrogate."""

from collections.abc import Mapping

from slurrycast import surrogates

WITHOUT_TRAINING = (
    "left out, as this run has no training slurries to learn from, or to take a packing fraction from "
    "(surrogate.packing_fraction)"
)


def without_training(config: Mapping, label: str) -> bool:
    """Whether a surrogate can predict in a run that takes a trained model and has no training slurries."""
    surrogate = surrogates.parse(label).surrogate
    if surrogate.needs_packing_fraction and config["surrogate"]["packing_fraction"] is None:
        return False
    return not surrogate.is_learned or (surrogate.is_trained and label in config["surrogate"]["names"])


def first_frame_seen(config: Mapping, label: str) -> int:
    """Earliest last input frame that a surrogate learns from; most learn from the input frames alone."""
    parsed = surrogates.parse(label)
    frames = parsed.input_frames(config["learning"]["input_frames"])
    return parsed.surrogate.first_frame_seen(frames, config["surrogate"].get(parsed.name, {}))
