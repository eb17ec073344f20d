"""Use a model that was trained elsewhere: check that it fits this run, and copy it to where the workflow looks for it.

In: a trained model (.keras), and the history.csv beside it if there is one.
Out: the model and its learning curves (CSV with no rows where none are known).
"""

import json
import shutil
import zipfile
from pathlib import Path

from slurrycast import surrogates
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.costs import measured_cost
from slurrycast.runtime.files import InputError, moved_into_place, write_text


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_value("--surrogate", "label under which the model is used")
    parser.add_input("--trained", "trained model (.keras)")
    parser.add_value("--input-frames", "frame numbers of the input", nargs="+", type=int)
    parser.add_output("--model", "the same model (.keras)")
    parser.add_output("--history", "its learning curves (CSV)")
    parser.add_output("--cost", "cost record (JSON)")


def read_architecture(path: Path) -> tuple[dict[str, tuple[int | None, ...]], set[str]]:
    """Shapes of a model's inputs by name, without the batch, and classes of its layers; InputError if it is none."""
    try:
        with zipfile.ZipFile(path) as archive:
            layers = json.loads(archive.read("config.json"))["config"]["layers"]
        inputs = [layer["config"] for layer in layers if layer["class_name"] == "InputLayer"]
        shapes = {config["name"]: tuple(config["batch_shape"][1:]) for config in inputs}
        return shapes, {layer["class_name"] for layer in layers}
    except (OSError, KeyError, ValueError, TypeError, IndexError, zipfile.BadZipFile) as error:
        raise InputError(f"surrogate.models: {path} is no Keras model ({error})") from error


def _listed(shapes: dict[str, tuple[int | None, ...]]) -> str:
    return ", ".join(" x ".join(map(str, shape)) for shape in shapes.values())


def main(args: Namespace) -> None:
    """Check and copy."""
    label = surrogates.parse(args.surrogate)
    with measured_cost(args.cost, "adopt_model", surrogate=args.surrogate):
        shapes, layers = read_architecture(args.trained)
        expected = label.surrogate.input_shapes(len(args.input_frames), label.settings)
        # a network with one input may call it as it likes
        named = shapes if len(shapes) > 1 else dict.fromkeys(expected, *shapes.values())
        if any(named.get(name) != shape for name, shape in expected.items()):
            raise InputError(
                f"surrogate.models: {args.trained} takes inputs of shape {_listed(shapes)}, "
                f"{args.surrogate} needs {_listed(expected)}"
            )
        if label.surrogate.model_layer not in (None, *layers):
            raise InputError(
                f"surrogate.models: {args.trained} is no model of {label.name}, or one of an earlier version: "
                "train it again"
            )
        with moved_into_place(args.model) as part:
            shutil.copyfile(args.trained, part)
        history = args.trained.with_name("history.csv")
        rows = history.read_text() if history.exists() else "epoch,loss,mae,val_loss,val_mae\n"
        write_text(args.history, rows)
    print(f"{args.surrogate}: {args.trained} is used as it is")


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
