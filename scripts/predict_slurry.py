"""Predict the equilibrated microstructure of one slurry from its own input frames and nothing later.

In: the slurry's frame store (HDF5) and a trained model.
Out: predicted unwrapped coordinates (um) with the box that the surrogate's rule gives, as a frame store of one frame.
The rule and its scale are attributes of the file.
"""

import argparse

import numpy as np

from slurrycast import final_box, surrogates
from slurrycast.costs import measured_cost
from slurrycast.features import particle_history
from slurrycast.files import RunError, run_main
from slurrycast.frames import Frame, read_frames, write_frames
from slurrycast.periodic import to_scaled
from slurrycast.recipe import sphere_volume_um3


def parse_args() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--surrogate", required=True, help=f"one of: {', '.join(surrogates.NAMES)}")
    parser.add_argument("--model", required=True, help="in: trained model (.keras)")
    parser.add_argument("--frames", required=True, help="in: frame store of the slurry")
    parser.add_argument("--input-frames", required=True, nargs="+", type=int, help="frame numbers of the input")
    parser.add_argument("--target-frame", required=True, type=int, help="frame number that the prediction stands for")
    parser.add_argument("--predicted", required=True, help="out: predicted microstructure, HDF5")
    parser.add_argument("--cost", required=True, help="out: cost record, JSON")
    return parser.parse_args()


def main() -> None:
    """Predict and write."""
    args = parse_args()
    surrogate = surrogates.load(args.surrogate)
    with read_frames(args.frames) as store:
        slurry = str(store.attributes["slurry"])
        with measured_cost(args.cost, "predict_slurry", args.surrogate, slurry) as cost:
            cost.particles = len(store.particles)
            last = args.input_frames[-1]
            predicted_um = surrogate.predict(args.model, particle_history(store, args.input_frames))
            if not np.isfinite(predicted_um).all():
                raise RunError(f"{args.model}: predicts coordinates of slurry {slurry} that are not finite")
            scale = final_box.RULES[surrogate.BOX_RULE](predicted_um, store.position_um(last))
            lower_um, edges_um = (scale * length for length in store.box(last))
            particles_um3 = float(sphere_volume_um3(2 * store.particles.radius_um).sum())
            if scale <= 0 or np.prod(edges_um) < particles_um3:
                raise RunError(
                    f"{args.model}: predicts a box {scale:.3g} times as wide as at frame {last} for slurry {slurry}, "
                    f"which cannot hold its particles: train longer (surrogate.{args.surrogate}.epochs)"
                )
            frame = Frame(
                number=args.target_frame,
                # Frames are equally spaced, so the input frames tell when the target frame would be.
                step=int(store.steps[1]) * args.target_frame,
                time_us=float(store.times_us[1]) * args.target_frame,
                position_um=predicted_um,
                scaled_position=to_scaled(predicted_um, lower_um, edges_um),
                coordination=np.full(cost.particles, -1, dtype=np.int32),  # not predicted
                lower_um=lower_um,
                edges_um=edges_um,
            )
            attributes = {
                **store.attributes,
                "surrogate": args.surrogate,
                "stage": "predicted",
                "box_rule": surrogate.BOX_RULE,
                "box_scale": scale,
                "input_frames": args.input_frames,
            }
            write_frames(args.predicted, store.particles, [frame], attributes)
    print(
        f"[{slurry}] {args.surrogate}: box {' x '.join(f'{edge:.3f}' for edge in edges_um)} um ({surrogate.BOX_RULE})"
    )


if __name__ == "__main__":
    run_main(main)
