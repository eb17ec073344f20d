"""Train one surrogate on the training set.

In: the training set (HDF5; lengths in um) and the surrogate's settings (JSON).
Out: the model with the weights of the best validation epoch, and the learning curves (CSV: epoch, loss, mae, val_loss,
val_mae; um2 for the mean squared errors `loss`, um for the mean absolute errors `mae`).

A killed training continues from the work folder, which is removed at the end.
"""

import argparse
import json
import shutil
from pathlib import Path

from slurrycast import surrogates
from slurrycast.costs import measured_cost
from slurrycast.dataset import read_training_set
from slurrycast.files import run_main


def parse_args() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--surrogate", required=True, help=f"label of one of: {', '.join(surrogates.NAMES)}")
    parser.add_argument("--dataset", required=True, type=Path, help="in: training set (HDF5)")
    parser.add_argument(
        "--settings",
        required=True,
        type=json.loads,
        help="JSON; of a VGG16: epochs, batch_size, learning_rate, threads",
    )
    parser.add_argument("--seed", required=True, type=int, help="of the initial weights and the order of the batches")
    parser.add_argument("--work", required=True, type=Path, help="folder for the checkpoint; removed at the end")
    parser.add_argument("--model", required=True, type=Path, help="out: trained model (.keras)")
    parser.add_argument("--history", required=True, type=Path, help="out: learning curves (CSV)")
    parser.add_argument("--cost", required=True, type=Path, help="out: cost record (JSON)")
    return parser.parse_args()


def main() -> None:
    """Train and write model, history and cost."""
    args = parse_args()
    label = surrogates.parse(args.surrogate)
    with measured_cost(args.cost, "train_surrogate", surrogate=args.surrogate) as cost:
        training_set = read_training_set(args.dataset)
        settings = {**args.settings, **label.settings, "seed": args.seed}
        spent = surrogates.load(label.name).fit(training_set, settings, args.model, args.history, args.work)
        cost.particles = len(training_set)
        cost.wall_s += spent["earlier_wall_s"]
        cost.cpu_s += spent["earlier_cpu_s"]
    shutil.rmtree(args.work, ignore_errors=True)


if __name__ == "__main__":
    run_main(main)
