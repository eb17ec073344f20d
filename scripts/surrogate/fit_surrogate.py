"""Fit one surrogate whose parameters follow from the training set in closed form.

In: the training set (HDF5; lengths in um) and the surrogate's settings (JSON).
Out: the model (JSON) with its mean squared errors on the training and validation samples (um2).
"""

import argparse
import json

from slurrycast import surrogates
from slurrycast.data.dataset import read_training_set
from slurrycast.runtime.command_line import Parser, run_main
from slurrycast.runtime.costs import measured_cost


def parse_args() -> argparse.Namespace:
    """Read the command line."""
    parser = Parser(__doc__)
    parser.add_argument("--surrogate", required=True, help=f"label of one of: {', '.join(surrogates.NAMES)}")
    parser.add_input("--dataset", "training set (HDF5)")
    parser.add_argument("--settings", required=True, type=json.loads, help="JSON; linear has none: {}")
    parser.add_argument("--seed", required=True, type=int, help="of whatever the fit draws; linear draws nothing")
    parser.add_output("--model", "fitted model (JSON)")
    parser.add_output("--cost", "cost record (JSON)")
    return parser.parse_args()


def main() -> None:
    """Fit and write model and cost."""
    args = parse_args()
    label = surrogates.parse(args.surrogate)
    with measured_cost(args.cost, "fit_surrogate", surrogate=args.surrogate) as cost:
        training_set = read_training_set(args.dataset)
        settings = {**args.settings, **label.settings, "seed": args.seed}
        model = label.surrogate.fit(training_set, settings, args.model)
        cost.particles = len(training_set)
    print(f"[{args.surrogate}] {json.dumps(model)}")


if __name__ == "__main__":
    run_main(main)
