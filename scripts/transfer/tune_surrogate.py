"""Train a surrogate on a few slurries of a recipe, fine-tuned or from scratch, and predict others of it.

In: the frame stores (HDF5) of the slurries to train on, none to ask the stored model as it is, and of those to predict;
settings of the training (JSON); the stored model (.keras), if the training starts from one; the packing fraction of the
recipe (JSON), and the noise of the DEM (CSV) with the floor of perturbed runs.
Out: a table (CSV) of one row a predicted slurry: surrogate, start ("fine_tuned" or "from_scratch"), number of slurries
trained on, slurry, and errors and skill as in tables/skill.csv.

A killed training continues from the work folder, which is removed at the end.
"""

import hashlib
import json
import shutil
from collections.abc import Mapping
from functools import partial
from pathlib import Path

import numpy as np

from slurrycast import surrogates
from slurrycast.analysis.errors import deviation_um
from slurrycast.data.dataset import TrainingSet, assemble
from slurrycast.data.final_box import scale_to_packing_fraction
from slurrycast.data.frames import read_frames
from slurrycast.data.tables import write_table
from slurrycast.data.trajectories import Trajectory, read_trajectories
from slurrycast.dem.particles import total_volume_um3
from slurrycast.evaluation.noise import Noise, read_noise, skill
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.costs import measured_cost
from slurrycast.runtime.files import checksum
from slurrycast.runtime.work_folder import work_folder
from slurrycast.surrogates.affine import Affine
from slurrycast.surrogates.base import Surrogate
from slurrycast.surrogates.prediction import PredictionInput


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_value("--surrogate", f"label of one of: {', '.join(surrogates.NAMES)}")
    parser.add_value("--settings", "JSON: those of the surrogate", type=json.loads)
    parser.add_value("--seed", "of the initial weights and the order of the batches", type=int)
    parser.add_input("--start-from", "trained model to go on with (.keras)", required=False)
    parser.add_input("--frames", "DEM frames of the slurries to train on", nargs="*")
    parser.add_input("--predicted", "DEM frames of the slurries to predict", nargs="+")
    parser.add_value("--input-frames", "frame numbers of the input", nargs="+", type=int)
    parser.add_value("--target-frame", "frame number of the target", type=int)
    parser.add_value("--phases", "names of the phases, in the order of their numbers", nargs="+")
    parser.add_value("--validation-share", "share of the particles, 0 to 1", type=float)
    parser.add_input("--packing", "JSON of measure_packing.py")
    parser.add_input("--noise", "tables/noise.csv")
    parser.add_value("--work", "work folder", type=Path)
    parser.add_output("--table", "table of predicted slurries (CSV)")
    parser.add_output("--cost", "cost record (JSON)")
    nothing = "--frames or --start-from: at least one is needed"
    parser.add_check(lambda args: None if args.frames or args.start_from else nothing)


def read_data(
    surrogate: Surrogate, args: Namespace, settings: Mapping
) -> TrainingSet | tuple[list[Trajectory], list[Trajectory]]:
    """Data to train the surrogate on, as `Surrogate.train` takes them."""
    if surrogate.learns_from == "samples":
        frames = args.input_frames, args.target_frame
        return assemble(args.frames, args.phases, *frames, args.validation_share, args.seed)
    return read_trajectories(args.frames, partial(surrogate.needed_frames, settings), args.phases), []


def error_row(path: Path, surrogate: Surrogate, model: Path, settings: Mapping, args: Namespace, noise: Noise) -> dict:
    """Predict a slurry: its errors, those of the affine map, and the skill."""
    fraction = float(json.loads(args.packing.read_text(encoding="utf-8"))["mean"])
    with read_frames(path) as store:
        particles, target_um = store.particles_of(args.phases), store.position_um(args.target_frame)
        frames = tuple(store.frame(k) for k in args.input_frames)
        slurry = str(store.attributes["slurry"])
    last_um = frames[-1].edges_um
    final_edges_um = last_um * scale_to_packing_fraction(fraction, total_volume_um3(particles), last_um)
    inputs = PredictionInput(slurry, particles, frames, final_edges_um)
    predictions = surrogate.predict(inputs, model, settings), Affine().predict(inputs, None, {})
    mse_um2, affine_um2 = (float(np.mean(deviation_um(target_um, each.position_um) ** 2)) for each in predictions)
    floor_um2 = noise.floor_um2(len(particles))
    errors = {"mse_um2": mse_um2, "mse_affine_um2": affine_um2, "floor_um2": floor_um2}
    return {"slurry": slurry, **errors, "skill": skill(mse_um2, affine_um2, floor_um2)}


def main(args: Namespace) -> None:
    """Train in the work folder, predict and write the table."""
    label = surrogates.parse(args.surrogate)
    surrogate, start = label.surrogate, {"start_from": str(args.start_from)} if args.start_from else {}
    settings = {**args.settings, **label.settings, **start, "seed": args.seed}
    settings |= {"input_frames": args.input_frames, "target_frame": args.target_frame}
    sources = [*args.frames, *([args.start_from] if args.start_from else [])]
    identity = hashlib.sha256(json.dumps([*map(checksum, sources), args.surrogate, settings]).encode()).hexdigest()
    with measured_cost(args.cost, "tune_surrogate", args.surrogate) as cost:
        with work_folder(args.work, identity) as work:
            model = args.start_from
            if args.frames:
                earlier = surrogate.train(read_data(surrogate, args, settings), settings, work.path)
                cost.wall_s, cost.cpu_s = earlier["wall_s"], earlier["cpu_s"]
                model = work.path / "model.keras"
            kind = {"surrogate": args.surrogate, "start": "fine_tuned" if args.start_from else "from_scratch"}
            kind["slurries"] = len(args.frames)
            noise = read_noise(args.noise)
            rows = [kind | error_row(path, surrogate, model, settings, args, noise) for path in args.predicted]
            write_table(args.table, rows)
        shutil.rmtree(args.work)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
