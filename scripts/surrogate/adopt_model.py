"""Use a model that was trained elsewhere: copy it to where the workflow looks for it.

The workflow has checked that it fits.

In: a trained model (.keras), and history.csv and trained_on.json beside it if there are any.
Out: the model, its learning curves (CSV; without rows if there are none, or they are another program's), and what it
was trained on (an empty JSON mapping where nothing is known).
"""

import csv
import shutil
from pathlib import Path

from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.costs import measured_cost
from slurrycast.runtime.files import moved_into_place, write_text
from slurrycast.surrogates.trained_on import beside, read_trained_on, write_trained_on

COLUMNS = ["epoch", "loss", "mae", "val_loss", "val_mae"]


def read_history(path: Path) -> str:
    """Learning curves of a model as CSV; without rows if the file is missing or is another program's."""
    none = ",".join(COLUMNS) + "\n"
    if not path.exists():
        return none
    try:
        text = path.read_text(encoding="utf-8")
        header, *rows = csv.reader(text.splitlines())
        if set(COLUMNS) <= set(header) and all(
            len([float(cell or "nan") for cell in row]) == len(header) for row in rows
        ):
            return text
    except ValueError:  # no number, no header, or another encoding
        pass
    print(f"{path}: not used: must be a table (CSV) of numbers with the columns {', '.join(COLUMNS)}")
    return none


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_value("--surrogate", "label under which the model is used")
    parser.add_input("--trained", "trained model (.keras)")
    parser.add_output("--model", "the same model (.keras)")
    parser.add_output("--history", "its learning curves (CSV)")
    parser.add_output("--trained-on", "what it was trained on (JSON)")
    parser.add_output("--cost", "cost record (JSON)")


def main(args: Namespace) -> None:
    """Copy the model and what came with it."""
    with measured_cost(args.cost, "adopt_model", surrogate=args.surrogate):
        with moved_into_place(args.model) as part:
            shutil.copyfile(args.trained, part)
        write_text(args.history, read_history(args.trained.with_name("history.csv")))
        write_trained_on(args.trained_on, read_trained_on(beside(args.trained)) or {})
    print(f"{args.surrogate}: {args.trained} is used as it is")


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
