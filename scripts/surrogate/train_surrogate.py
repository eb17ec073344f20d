"""Train one surrogate on the training set.

In: the training set (HDF5; lengths in um), or for a surrogate that learns from frames the frame stores of the training
slurries; the surrogate's settings (JSON); and a model (.keras) to go on with, if the training is not to start anew.
Out: the model, and the learning curves (CSV: epoch, loss, mae, val_loss,
val_mae; um2 for the mean squared errors `loss`, um for the mean absolute errors `mae`).

A killed training continues from the work folder. The folder keeps the finished model: a workflow that is killed before
it has taken note of the outputs asks for them again. Where an epoch does not depend on their number, it also keeps the
last checkpoint: with more `epochs` the training goes on.
"""

import hashlib
import importlib.metadata
import json
import shutil
from collections.abc import Mapping
from functools import partial
from pathlib import Path

from slurrycast import surrogates
from slurrycast.data.dataset import TrainingSet, read_training_set
from slurrycast.data.trajectories import Trajectory, read_trajectories
from slurrycast.runtime import dependencies
from slurrycast.runtime.command_line import Namespace, Parser, input_file, named_file, run_main
from slurrycast.runtime.costs import measured_cost, spent_so_far
from slurrycast.runtime.files import checksum, moved_into_place
from slurrycast.runtime.work_folder import work_folder
from slurrycast.surrogates.base import Surrogate
from slurrycast.surrogates.checkpoint import without_epochs


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_value("--surrogate", f"label of one of: {', '.join(surrogates.NAMES)}")
    parser.add_value("--settings", "JSON; of a VGG16: epochs, batch_size, learning_rate, threads", type=json.loads)
    parser.add_input("--start-from", "trained model to go on with (.keras); the optimiser is fresh", required=False)
    parser.add_value("--seed", "of the initial weights and the order of the batches", type=int)
    parser.add_value("--work", "work folder: the checkpoint, then the finished model", type=Path)
    parser.add_output("--model", "trained model (.keras)")
    parser.add_output("--history", "learning curves (CSV)")
    parser.add_output("--cost", "cost record (JSON)")
    samples = parser.add_argument_group("of a surrogate that learns from samples")
    samples.add_argument("--dataset", type=input_file, help="in: training set (HDF5)")
    samples.add_argument(
        "--held-out",
        nargs="*",
        default=[],
        type=named_file,
        help="in: data sets of held-out slurries, name=path (HDF5)",
    )
    frames = parser.add_argument_group("of one that learns from frames")
    frames.add_argument("--frames", nargs="+", type=input_file, help="in: frame stores of the training slurries (HDF5)")
    frames.add_argument(
        "--validation-frames", nargs="*", default=[], type=input_file, help="in: those of slurries to test on (HDF5)"
    )
    frames.add_argument("--input-frames", nargs="+", type=int, help="frame numbers of the input")
    frames.add_argument("--target-frame", type=int, help="frame number of the target")
    frames.add_argument("--phases", nargs="+", help="names of the phases, in the order of their numbers")
    needed = {"samples": ["dataset"], "frames": ["frames", "input_frames", "target_frame", "phases"]}
    parser.needs(lambda args: needed[surrogates.parse(args.surrogate).surrogate.learns_from])


def read_data(
    surrogate: Surrogate, args: Namespace, settings: Mapping
) -> tuple[TrainingSet | tuple[list[Trajectory], list[Trajectory]], int]:
    """Data to train the surrogate on, as `Surrogate.train` takes them, and the number of training particles."""
    if surrogate.learns_from == "samples":
        training_set = read_training_set(args.dataset)
        return training_set, len(training_set)
    slurries = read_trajectories(args.frames, partial(surrogate.needed_frames, settings), args.phases)
    needed = partial(surrogate.needed_frames, settings, moved=False)
    validation = read_trajectories(args.validation_frames, needed, args.phases)
    return (slurries, validation), sum(len(slurry.particles) for slurry in slurries)


def learned_from(args: Namespace) -> list[Path]:
    """Files that the result depends on."""
    start = [args.start_from] if args.start_from else []
    if args.dataset:
        return [args.dataset, *(path for _, path in args.held_out), *start]
    return [*args.frames, *args.validation_frames, *start]


def code_versions(surrogate: str) -> list[str]:
    """What the result depends on beside data and settings: modules of the package, as checksums, and libraries."""
    files = [
        checksum(dependencies.ROOT / path)
        for path in dependencies.modules("scripts/surrogate/train_surrogate.py", surrogate)
    ]
    packages = importlib.metadata.packages_distributions()  # TensorFlow has several, of which one is installed
    libraries = sorted({name for library in ("keras", "tensorflow") for name in packages.get(library, [])})
    return files + [f"{name} {importlib.metadata.version(name)}" for name in libraries]


def main(args: Namespace) -> None:
    """Train in the work folder, then move model and history from there."""
    label = surrogates.parse(args.surrogate)
    settings = {**args.settings, **label.settings, "seed": args.seed}
    surrogate, sources = label.surrogate, learned_from(args)
    if args.start_from:
        settings["start_from"] = str(args.start_from)
    if surrogate.learns_from == "frames":
        settings |= {"input_frames": args.input_frames, "target_frame": args.target_frame, "phases": args.phases}
    fixed = without_epochs(settings) if surrogate.goes_on else settings
    known = [*map(checksum, sources), args.surrogate, fixed, *code_versions(label.name)]
    part = f"epochs_{settings['epochs']}"
    identity = hashlib.sha256(json.dumps(known).encode()).hexdigest()
    with work_folder(args.work, identity) as work, measured_cost(args.cost, "train_surrogate", args.surrogate) as cost:
        data, cost.particles = read_data(surrogate, args, settings)
        model, history = work.path / "model.keras", work.path / "history.csv"
        if work.finished(part):
            print(f"[{args.surrogate}] trained by an earlier attempt")
            earlier = work.cost(part)
        else:
            held_out = {name: read_training_set(path) for name, path in args.held_out}
            more = {"held_out": held_out} if held_out else {}
            earlier = surrogate.train(data, settings, work.path, **more)
            spent = {clock: earlier[clock] + seconds for clock, seconds in spent_so_far().items()}
            work.record(part, [model.name, history.name], spent)
            if not surrogate.goes_on:
                for checkpoint in work.path.glob("checkpoint*.h5"):  # not before: a kill would lose what they hold
                    checkpoint.unlink()
        cost.wall_s += earlier["wall_s"]
        cost.cpu_s += earlier["cpu_s"]
        for made, place in ((model, args.model), (history, args.history)):
            with moved_into_place(place) as part:
                try:
                    part.hardlink_to(made)
                except OSError:  # a file system without links
                    shutil.copyfile(made, part)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
