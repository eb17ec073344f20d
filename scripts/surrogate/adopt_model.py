"""Use a model that was trained elsewhere: check that it fits this run, and copy it to where the workflow looks for it.

In: a trained model (.keras), and history.csv and trained_on.json beside it if there are any.
Out: the model, its learning curves (CSV with no rows where none are known), and what it was trained on (an empty JSON
mapping where nothing is known).
"""

import shutil

from slurrycast import surrogates
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.costs import measured_cost
from slurrycast.runtime.files import InputError, checksum, moved_into_place, write_text
from slurrycast.surrogates.stored_model import input_shapes, stored_layers
from slurrycast.surrogates.trained_on import beside, read_trained_on, write_trained_on


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_value("--surrogate", "label under which the model is used")
    parser.add_input("--trained", "trained model (.keras)")
    parser.add_value("--input-frames", "frame numbers of the input", nargs="+", type=int)
    parser.add_output("--model", "the same model (.keras)")
    parser.add_output("--history", "its learning curves (CSV)")
    parser.add_output("--trained-on", "what it was trained on (JSON)")
    parser.add_output("--cost", "cost record (JSON)")


def _listed(shapes: dict[str, tuple[int | None, ...]]) -> str:
    return ", ".join(" x ".join(map(str, shape)) for shape in shapes.values())


def main(args: Namespace) -> None:
    """Check and copy."""
    label = surrogates.parse(args.surrogate)
    with measured_cost(args.cost, "adopt_model", surrogate=args.surrogate):
        try:
            layers = stored_layers(args.trained)
            shapes = input_shapes(layers)
        except (InputError, KeyError, TypeError) as error:
            raise InputError(f"surrogate.models: {error}") from error
        expected = label.surrogate.input_shapes(len(args.input_frames), label.settings)
        # a network with one input may call it as it likes
        named = shapes if len(shapes) > 1 else dict.fromkeys(expected, *shapes.values())
        if any(named.get(name) != shape for name, shape in expected.items()):
            raise InputError(
                f"surrogate.models: {args.trained} takes inputs of shape {_listed(shapes)}, "
                f"{args.surrogate} needs {_listed(expected)}"
            )
        if not label.surrogate.knows(layers):
            raise InputError(
                f"surrogate.models: {args.trained} is no model of {label.name}, or one of an earlier version: "
                "train it again"
            )
        with moved_into_place(args.model) as part:
            shutil.copyfile(args.trained, part)
        history = args.trained.with_name("history.csv")
        rows = history.read_text() if history.exists() else "epoch,loss,mae,val_loss,val_mae\n"
        write_text(args.history, rows)
        known = read_trained_on(beside(args.trained))
        if known and known["model_sha256"] != checksum(args.trained):
            raise InputError(f"{beside(args.trained)}: is of another model than {args.trained.name} beside it")
        write_trained_on(args.trained_on, known or {})
    print(f"{args.surrogate}: {args.trained} is used as it is")


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
