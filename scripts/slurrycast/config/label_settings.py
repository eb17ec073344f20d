"""What the configuration means for one label of a surrogate."""

from collections.abc import Mapping

from slurrycast import surrogates


def without_training(config: Mapping, label: str) -> bool:
    """Whether a surrogate can predict in a run that takes a trained model and has no training slurries."""
    surrogate = surrogates.load(surrogates.parse(label).name)
    if surrogate.BOX_RULE == "mean_packing_fraction" and config["surrogate"]["packing_fraction"] is None:
        return False
    return surrogate.MODEL_FILE is None or (
        surrogate.MODEL_FILE == "model.keras" and label in config["surrogate"]["names"]
    )


def first_frame_seen(config: Mapping, label: str) -> int:
    """Earliest last input frame that a surrogate learns from; most learn from the input frames alone."""
    parsed = surrogates.parse(label)
    surrogate, frames = surrogates.load(parsed.name), parsed.input_frames(config["learning"]["input_frames"])
    if not hasattr(surrogate, "first_frame_seen"):
        return max(frames)
    return surrogate.first_frame_seen(frames, config["surrogate"][parsed.name])


def relaxation_steps(config: Mapping, label: str) -> int:
    """Steps for which predictions of the surrogate with this label are relaxed in the main job."""
    settings = config["relaxation"]
    of_surrogate = settings["steps_of"].get(surrogates.parse(label).name, settings["steps"])
    return settings["steps_of"].get(label, of_surrogate)
