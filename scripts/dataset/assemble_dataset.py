"""Assemble a data set: the input frames and the target frame of every particle of the training slurries, or of others.

In: frame stores of the slurries (HDF5).
Out: features (n, frames, 6), targets (n, 3) in um, slurry index, particle ids, the random split into training and
validation, and the box edges (um) of each slurry at these frames, as HDF5.
"""

import numpy as np

from slurrycast.data.dataset import TrainingSet, split, write_training_set
from slurrycast.data.features import FEATURE_NAMES, particle_history
from slurrycast.data.frames import read_frames
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
        features, targets, ids, names, input_edges_um, target_edges_um = [], [], [], [], [], []
        for path in args.frames:
            with read_frames(path) as store:
                frames = [store.frame(k) for k in args.input_frames]
                features.append(particle_history(store.particles_of(args.phases), frames))
                input_edges_um.append([frame.edges_um for frame in frames])
                target_edges_um.append(store.box(args.target_frame)[1])
                targets.append(store.position_um(args.target_frame))
                ids.append(store.particles.id)
                names.append(str(store.attributes["slurry"]))
        cost.particles = sum(map(len, ids))
        write_training_set(
            args.dataset,
            TrainingSet(
                features=np.concatenate(features),
                targets=np.concatenate(targets),
                slurry_index=np.repeat(np.arange(len(ids)), [len(i) for i in ids]),
                slurries=tuple(names),
                particle_id=np.concatenate(ids),
                is_validation=split(cost.particles, args.validation_share, args.seed),
                feature_names=FEATURE_NAMES,
                input_frames=tuple(args.input_frames),
                target_frame=args.target_frame,
                input_edges_um=np.array(input_edges_um),
                target_edges_um=np.array(target_edges_um),
            ),
            args.seed,
        )
    print(f"{cost.particles} samples of {len(names)} slurries: {', '.join(names)}")


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
