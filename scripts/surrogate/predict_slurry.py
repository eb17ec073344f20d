"""Predict the equilibrated microstructure of one slurry from its input frames and nothing later, or from its recipe.

In: the slurry's frame store (HDF5), and what the surrogate needs beside it: a model, the packing fraction that gives
the final box, or the restart file from which it goes on with the DEM. A surrogate that starts from the recipe has its
inputs (JSON) in place of frames.
Out: predicted unwrapped coordinates (um) with the box that the surrogate's rule gives, as a frame store of one frame,
and their spread (um) if the surrogate gives one. The rule and its scale are attributes of the file.
"""

import contextlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from slurrycast import surrogates
from slurrycast.data.final_box import scale_to_packing_fraction
from slurrycast.data.frames import Frame, Particles, read_frames, write_frames
from slurrycast.data.periodic import to_scaled
from slurrycast.dem.lammps_run import Launcher, steps_per_frame
from slurrycast.dem.particles import particles_of, total_volume_um3
from slurrycast.dem.recipe import random_start
from slurrycast.runtime.command_line import Namespace, Parser, input_file, run_main
from slurrycast.runtime.costs import measured_cost
from slurrycast.runtime.files import InputError, RunError
from slurrycast.runtime.work_folder import work_folder
from slurrycast.surrogates.base import Surrogate
from slurrycast.surrogates.prediction import Continuation, PredictionInput


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_value("--surrogate", f"label of one of: {', '.join(surrogates.NAMES)}")
    parser.add_value("--settings", "JSON: the surrogate's settings", type=json.loads)
    parser.add_input("--frames", "frame store of the slurry", required=False)
    parser.add_value("--input-frames", "frame numbers of the input", nargs="*", type=int)
    parser.add_value("--target-frame", "frame number that the prediction stands for", type=int)
    meaning = "names of the phases, in the order of their numbers in training (default: as in the slurry)"
    parser.add_value("--phases", meaning, nargs="+", default=None)
    parser.add_output("--predicted", "predicted microstructure, HDF5")
    parser.add_output("--cost", "cost record, JSON")
    learned = parser.add_argument_group("of a surrogate that learned")
    learned.add_argument("--model", type=input_file, help="in: trained or fitted model")
    learned.add_argument("--adopted", action="store_true", help="the model was trained in another run")
    box = parser.add_argument_group("of one that takes its box from the training slurries")
    box.add_argument("--packing", type=input_file, help="in: JSON of measure_packing.py")
    recipe = parser.add_argument_group("of one that starts from the recipe or goes on with the DEM")
    recipe.add_argument("--inputs", type=input_file, help="in: JSON of generate_inputs.py")
    going_on = parser.add_argument_group("of one that goes on with the DEM")
    going_on.add_argument("--restart", type=input_file, help="in: LAMMPS restart file of the last input frame")
    going_on.add_argument("--coefficients", type=input_file, help="in: pair_coeff lines of the real forces")
    going_on.add_argument("--work", type=Path, help="work folder; kept with the logs if LAMMPS fails")
    parser.add_lammps(going_on)
    parser.needs(needed_options)


def needed_options(args: Namespace) -> list[str]:
    """Names of the options that the surrogate needs beside those that all need."""
    surrogate = surrogates.parse(args.surrogate).surrogate
    needs = {
        "model": surrogate.is_learned,
        "packing": surrogate.needs_packing_fraction,
        "frames": not surrogate.from_recipe,
        "inputs": surrogate.from_recipe or surrogate.continues_dem,
    }
    needs |= dict.fromkeys(("restart", "coefficients", "work"), surrogate.continues_dem)
    return [name for name, is_needed in needs.items() if is_needed]


@dataclass(frozen=True)
class Start:
    """What is known of a slurry before it is predicted: its particles, the input frames, and where they come from.

    `numbered` are the same particles with the numbers that phases have in training.
    """

    particles: Particles
    numbered: Particles
    frames: tuple[Frame, ...]
    attributes: Mapping[str, str | int | float]


def start_of(args: Namespace, surrogate: Surrogate) -> Start:
    """Read the input frames, or scatter the particles of the recipe."""
    if surrogate.from_recipe:
        inputs = json.loads(args.inputs.read_text(encoding="utf-8"))
        type, position_um, edges_um = random_start(inputs, surrogate.name)
        particles = particles_of(inputs["types"], np.arange(1, len(type) + 1), type)
        scaled, not_counted = to_scaled(position_um, -edges_um / 2, edges_um), np.full(len(type), -1, dtype=np.int32)
        frame = Frame(0, 0, 0.0, position_um, scaled, not_counted, -edges_um / 2, edges_um)
        attributes = {"slurry": inputs["slurry"]} | {name: json.dumps(inputs[name]) for name in ("physics", "seeds")}
        return Start(particles, particles, (frame,), attributes)
    with read_frames(args.frames) as store:
        numbered = store.particles_of(args.phases) if args.phases else store.particles
        return Start(store.particles, numbered, tuple(store.frame(k) for k in args.input_frames), store.attributes)


def prediction_input_for(args: Namespace, surrogate: Surrogate, start: Start) -> PredictionInput:
    """What the surrogate is asked: the input frames, and what it needs beside them."""
    final_edges_um = continuation = None
    if surrogate.needs_packing_fraction:
        try:
            packing_fraction = float(json.loads(args.packing.read_text(encoding="utf-8"))["mean"])
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise InputError(f"{args.packing}: holds no mean packing fraction ({error})") from error
        last_um = start.frames[-1].edges_um
        final_edges_um = last_um * scale_to_packing_fraction(
            packing_fraction, total_volume_um3(start.particles), last_um
        )
    if surrogate.continues_dem:
        launcher = Launcher(args.executable, args.launcher, args.ranks)
        inputs = json.loads(args.inputs.read_text(encoding="utf-8"))
        continuation = Continuation(args.restart, args.coefficients, inputs, launcher, args.work)
    slurry = str(start.attributes["slurry"])
    return PredictionInput(slurry, start.numbered, start.frames, final_edges_um, continuation)


def advice(surrogate: Surrogate, adopted: bool) -> str:
    """What to do about a box that is too small, by where it comes from; empty if nothing is known to help."""
    if surrogate.needs_packing_fraction:
        return ": check surrogate.packing_fraction, or without it the densities of the training slurries"
    if adopted:
        return ": check that the one in surrogate.models was trained on this recipe, scale and input frames"
    return f": train longer (surrogate.{surrogate.name}.epochs)" if surrogate.is_trained else ""


def main(args: Namespace) -> None:
    """Predict and write."""
    label = surrogates.parse(args.surrogate)
    surrogate = label.surrogate
    working = work_folder(args.work) if surrogate.continues_dem else contextlib.nullcontext()
    with working, measured_cost(args.cost, "predict_slurry", args.surrogate) as cost:
        start = start_of(args, surrogate)
        inputs = prediction_input_for(args, surrogate, start)
        slurry = cost.slurry = inputs.slurry
        particles, cost.particles = start.particles, len(start.particles)
        prediction = surrogate.predict(inputs, args.model, {**args.settings, **label.settings})
        predicted_um, spread_um, last = prediction.position_um, prediction.spread_um, inputs.last
        source = args.model or args.surrogate
        if not np.isfinite(predicted_um).all():
            raise RunError(f"{source}: predicts coordinates of slurry {slurry} that are not finite")
        if spread_um is not None and not (np.isfinite(spread_um) & (spread_um > 0)).all():
            raise RunError(f"{source}: predicts spreads of slurry {slurry} that are not finite and above 0")
        edges_um = surrogate.box_rule.edges_um(inputs, prediction)
        scale = float(np.mean(edges_um / last.edges_um))
        if scale <= 0 or np.prod(edges_um) < total_volume_um3(particles):
            raise RunError(
                f"{source}: predicts a box {scale:.3g} times as wide as at frame {last.number} for slurry "
                f"{slurry}, which cannot hold its particles{advice(surrogate, args.adopted)}"
            )
        dem = json.loads(start.attributes["physics"])["dem"]
        step = steps_per_frame(dem) * args.target_frame
        frame = Frame(
            number=args.target_frame,
            step=step,
            time_us=step * dem["timestep_us"],
            position_um=predicted_um,
            scaled_position=to_scaled(predicted_um, -edges_um / 2, edges_um),
            coordination=np.full(cost.particles, -1, dtype=np.int32),  # not predicted
            lower_um=-edges_um / 2,
            edges_um=edges_um,
            position_spread_um=spread_um,
        )
        attributes = {
            **start.attributes,
            "surrogate": args.surrogate,
            "stage": "predicted",
            "box_rule": surrogate.box_rule.name,
            "box_scale": scale,
            "input_frames": args.input_frames,
        }
        write_frames(args.predicted, particles, [frame], attributes)
    box = " x ".join(f"{edge:.3f}" for edge in edges_um)
    print(f"[{slurry}] {args.surrogate}: box {box} um ({surrogate.box_rule.name})")


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
