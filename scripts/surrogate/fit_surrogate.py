"""Fit one surrogate whose parameters follow from the training set in closed form.

In: the training set (HDF5; lengths in um) and the surrogate's settings (JSON).
Out: the model (JSON) with its errors on the training and validation samples, and those of the affine map.
"""

import json

from slurrycast import surrogates
from slurrycast.data.dataset import read_training_set
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.costs import measured_cost


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_value("--surrogate", f"label of one of: {', '.join(surrogates.NAMES)}")
    parser.add_input("--dataset", "training set (HDF5)")
    parser.add_value("--settings", "JSON; linear has none: {}", type=json.loads)
    parser.add_value("--seed", "of whatever the fit draws; linear draws nothing", type=int)
    parser.add_output("--model", "fitted model (JSON)")
    parser.add_output("--cost", "cost record (JSON)")


def main(args: Namespace) -> None:
    """Fit and write model and cost."""
    label = surrogates.parse(args.surrogate)
    with measured_cost(args.cost, "fit_surrogate", surrogate=args.surrogate) as cost:
        training_set = read_training_set(args.dataset)
        settings = {**args.settings, **label.settings, "seed": args.seed}
        model = label.surrogate.fit(training_set, settings, args.model)
        cost.particles = len(training_set)
    print(f"[{args.surrogate}] {json.dumps(model)}")


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
