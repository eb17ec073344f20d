"""Say what a model was trained on, in a file beside it that goes where the model goes.

In: the model, and the frame stores (HDF5) of the slurries that it was trained on.
Out: JSON with label of the surrogate, SHA-256 of the model, ids of the slurries, input frames and target frame, names
of the phases in the order of their numbers, each recipe (phases and force field, wet composition), and the range of the
slurries at the last input frame: least and greatest value of each quantity of tables/training_range.csv, and `low` and
`high` with room for whole particles. After a training that went on with a stored model, `started_from` has the SHA-256
of that model; if a description is beside it, its recipes are there too, and recipes and range are of both trainings.
"""

from dataclasses import asdict
from pathlib import Path

from slurrycast import surrogates
from slurrycast.analysis.slurry_states import read_state
from slurrycast.analysis.training_range import Range, merged, training_range
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.files import checksum
from slurrycast.surrogates.trained_on import beside, distinct, read_trained_on, recipe_of, write_trained_on


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_value("--surrogate", f"label of one of: {', '.join(surrogates.NAMES)}")
    parser.add_input("--model", "trained or fitted model")
    parser.add_input("--frames", "DEM frames of the slurries that it was trained on", nargs="+")
    parser.add_value("--input-frames", "frame numbers of the input", nargs="+", type=int)
    parser.add_value("--target-frame", "frame number of the target", type=int)
    parser.add_value("--phases", "names of the phases, in the order of their numbers", nargs="+")
    parser.add_value("--first-frame-seen", "number of the earliest last input frame that it was trained on", type=int)
    parser.add_input("--start-from", "model that the training went on with", required=False)
    parser.add_output("--trained-on", "what the model was trained on (JSON)")


def describe(args: Namespace) -> dict:
    """What the model was trained on."""
    last = max(args.input_frames)
    read = [read_state(path, last, range(args.first_frame_seen, last)) for path in args.frames]
    ranges = training_range((each.state for each in read), [value for each in read for value in each.earlier_g_cm3])
    recipes, started = distinct([recipe_of(each.physics) for each in read]), {}
    if args.start_from:
        started = {"model_sha256": checksum(args.start_from)}
        if known := read_trained_on(beside(args.start_from)):
            started["recipes"] = known["recipes"]
            recipes = distinct([*known["recipes"], *recipes])
            ranges = merged([{name: Range(**limits) for name, limits in known["range"].items()}, ranges])
    return {
        "surrogate": args.surrogate,
        "model_sha256": checksum(Path(args.model)),
        "slurries": [each.slurry for each in read],
        "input_frames": args.input_frames,
        "target_frame": args.target_frame,
        "phases": args.phases,
        "recipes": recipes,
        "range": {name: asdict(each) for name, each in ranges.items()},
        **({"started_from": started} if started else {}),
    }


def main(args: Namespace) -> None:
    """Describe the model."""
    write_trained_on(args.trained_on, describe(args))


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
