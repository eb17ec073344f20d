"""Train one surrogate on the training set.

In: the training set (HDF5; lengths in um) and the surrogate's settings (JSON).
Out: the model with the weights of the best validation epoch, and the learning curves (CSV: epoch, loss, mae, val_loss,
val_mae; um2 for the mean squared errors `loss`, um for the mean absolute errors `mae`).

A killed training continues from the work folder. The folder keeps the finished model: a workflow that is killed before
it has taken note of the outputs asks for them again.
"""

import argparse
import hashlib
import json
import shutil
from pathlib import Path

from slurrycast import surrogates
from slurrycast.command_line import Parser, input_file, run_main
from slurrycast.costs import measured_cost, spent_so_far
from slurrycast.dataset import read_training_set
from slurrycast.files import checksum, moved_into_place
from slurrycast.work_folder import work_folder


def parse_args() -> argparse.Namespace:
    """Read the command line."""
    parser = Parser(__doc__)
    parser.add_argument("--surrogate", required=True, help=f"label of one of: {', '.join(surrogates.NAMES)}")
    parser.add_argument("--dataset", required=True, type=input_file, help="in: training set (HDF5)")
    parser.add_argument(
        "--settings",
        required=True,
        type=json.loads,
        help="JSON; of a VGG16: epochs, batch_size, learning_rate, threads",
    )
    parser.add_argument("--seed", required=True, type=int, help="of the initial weights and the order of the batches")
    parser.add_argument("--work", required=True, type=Path, help="work folder: the checkpoint, then the finished model")
    parser.add_argument("--model", required=True, type=Path, help="out: trained model (.keras)")
    parser.add_argument("--history", required=True, type=Path, help="out: learning curves (CSV)")
    parser.add_argument("--cost", required=True, type=Path, help="out: cost record (JSON)")
    return parser.parse_args()


def main() -> None:
    """Train in the work folder, then move model and history from there."""
    args = parse_args()
    label = surrogates.parse(args.surrogate)
    settings = {**args.settings, **label.settings, "seed": args.seed}
    identity = hashlib.sha256(json.dumps([checksum(args.dataset), args.surrogate, settings]).encode()).hexdigest()
    with work_folder(args.work, identity) as work, measured_cost(args.cost, "train_surrogate", args.surrogate) as cost:
        training_set = read_training_set(args.dataset)
        model, history = work.path / args.model.name, work.path / args.history.name
        if work.finished("training"):
            print(f"[{args.surrogate}] trained by an earlier attempt")
            earlier = work.cost("training")
        else:
            fit = surrogates.load(label.name).fit
            earlier = fit(training_set, settings, model, history, work.path)
            spent = {clock: earlier[clock] + own for clock, own in spent_so_far().items()}
            work.record("training", [model.name, history.name], spent)
        cost.particles = len(training_set)
        cost.wall_s += earlier["wall_s"]
        cost.cpu_s += earlier["cpu_s"]
        for made, place in ((model, args.model), (history, args.history)):
            with moved_into_place(place) as part:
                try:
                    part.hardlink_to(made)
                except OSError:  # a file system without links
                    shutil.copyfile(made, part)


if __name__ == "__main__":
    run_main(main)
