"""Compute the skill of predictions: 0 as good as the affine map, 1 as near as one perturbed run.

In: pairs of frame stores (HDF5): a predicted structure, and the DEM frames of the same slurry with the target frame;
the surrogate `affine` among them for every slurry. The noise of the DEM (CSV), with the floor of perturbed runs.
Out: a table (CSV) of one row a pair: mse_um2 of the unwrapped coordinates less their mean over particles and axes, that
of `affine`, the floor of the replicated slurry nearest in size, and
skill = 1 - (MSE - floor) / (MSE of affine - floor).
"""

from pathlib import Path

import pandas as pd

from slurrycast.data.frames import read_frames
from slurrycast.data.tables import write_table
from slurrycast.evaluation.noise import Noise, final_mse_um2, read_noise, skill
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.files import InputError

COLUMNS = ("surrogate", "slurry", "mse_um2", "mse_affine_um2", "floor_um2", "skill")
REFERENCE = "affine"


def error_row(predicted_path: Path, dem_path: Path, target_frame: int, noise: Noise) -> dict:
    """Error of one prediction, and the floor of its slurry."""
    with read_frames(predicted_path) as predicted, read_frames(dem_path) as dem:
        return {
            "surrogate": str(predicted.attributes["surrogate"]),
            "slurry": str(predicted.attributes["slurry"]),
            "mse_um2": final_mse_um2(predicted, dem, target_frame),
            "floor_um2": noise.floor_um2(len(dem.particles)),
        }


def with_skill(rows: list[dict]) -> pd.DataFrame:
    """Table of all rows; InputError if `affine` is missing for a slurry."""
    affine_um2 = {row["slurry"]: row["mse_um2"] for row in rows if row["surrogate"] == REFERENCE}
    for row in rows:
        if row["slurry"] not in affine_um2:
            raise InputError(f"--predicted: no {REFERENCE} of slurry {row['slurry']}, which skill is measured against")
        row["mse_affine_um2"] = affine_um2[row["slurry"]]
        row["skill"] = skill(row["mse_um2"], row["mse_affine_um2"], row["floor_um2"])
    return pd.DataFrame(rows, columns=COLUMNS)


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_predictions(required=False)
    parser.add_input("--noise", "noise of the DEM (CSV)")
    parser.add_output("--table", "table of skills (CSV)")


def main(args: Namespace) -> None:
    """Compute the skill of every prediction and write the table."""
    noise = read_noise(args.noise)
    pairs = zip(args.predicted, args.frames, strict=True)
    table = with_skill([error_row(predicted, dem, args.target_frame, noise) for predicted, dem in pairs])
    write_table(args.table, table)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
