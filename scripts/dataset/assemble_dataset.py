"""Assemble a data set: the input frames and the target frame of every particle of the training slurries, or of others.

In: frame stores of the slurries (HDF5).
Out: features (n, frames, 6), targets (n, 3) in um, slurry index, particle ids, the random split into training and
validation, and the box edges (um) of each slurry at these frames, as HDF5.
"""

from slurrycast.data.dataset import assemble, write_training_set
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.costs import measured_cost


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--frames", "frame stores of the slurries", nargs="+")
    parser.add_value("--input-frames", "frame numbers of the input", nargs="+", type=int)
    parser.add_value("--target-frame", "frame number of the target", type=int)
    parser.add_value("--phases", "names of the phases, in the order of their numbers", nargs="+")
    parser.add_value("--validation-share", "share of the particles, 0 to 1", type=float)
    parser.add_value("--seed", "seed of the split", type=int)
    parser.add_output("--dataset", "data set, HDF5")
    parser.add_output("--cost", "cost record, JSON")


def main(args: Namespace) -> None:
    """Assemble and write."""
    with measured_cost(args.cost, "assemble_dataset") as cost:
        frames = args.input_frames, args.target_frame
        data = assemble(args.frames, args.phases, *frames, args.validation_share, args.seed)
        cost.particles = len(data)
        write_training_set(args.dataset, data, args.seed)
    print(f"{cost.particles} samples of {len(data.slurries)} slurries: {', '.join(data.slurries)}")


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
