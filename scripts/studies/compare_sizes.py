"""Test why predictions of large slurries fail: the time scale of the barostat, or coordinates outside the training's?

In: DEM frames, run.json and thermo.csv of all slurries that were run to the end, of them those of role train and those
that were predicted; predicted and relaxed structures; tables/equilibrium.csv.
Out: a table (CSV) of one row a surrogate and predicted slurry: shrink_time_us is when the box edge is 0.75 of its first
value (empty if it never is), last_input_density_g_cm3 the density of the DEM at the last input frame, outside_share the
share of the coordinates at that frame beyond the range that those of the training slurries have there on the same axis,
predicted_volume_error and relaxed_volume_error the volume of the box over that of the DEM's end less 1, and
coordinate_volume_error the same for the box that follows from the predicted coordinates by their least-squares scale,
whatever rule gave the predicted box. And a table of one row: the barostat, the exponent b of shrink time = a
particles^b by least squares of the logarithms over all slurries that shrink so far, its standard error, and their
number.
"""

import json
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pandas as pd

from slurrycast.data.final_box import scale_of_prediction
from slurrycast.data.frames import FrameStore, read_frames
from slurrycast.data.tables import read_equilibrium, read_table, write_table
from slurrycast.evaluation.power_law import power_law
from slurrycast.evaluation.size import outside_share, shrink_time_us
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.files import InputError, write_text

FROM_EQUILIBRIUM = ["role", "mass_units", "thickness_ratio", "particles"]


def shrinking(runs: list[Path], thermos: list[Path], equilibrium: pd.DataFrame) -> pd.DataFrame:
    """Properties of the DEM of each slurry, by its id: FROM_EQUILIBRIUM, barostat, shrink_time_us."""
    rows = {}
    for run_path, thermo_path in zip(runs, thermos, strict=True):
        run, thermo = json.loads(run_path.read_text(encoding="utf-8")), read_table(thermo_path)
        rows[run["slurry"]] = {
            "barostat": run["physics"]["dem"]["barostat"],
            "shrink_time_us": shrink_time_us(thermo.time_us.to_numpy(), thermo.lx_um.to_numpy()),
        }
    known = equilibrium.set_index("slurry")[FROM_EQUILIBRIUM]
    if missing := [slurry for slurry in rows if slurry not in known.index]:
        raise InputError(f"slurries {', '.join(missing)}: not in the table of equilibrium")
    return known.join(pd.DataFrame.from_dict(rows, orient="index"), how="inner")


def clock(slurries: pd.DataFrame) -> pd.DataFrame:
    """Table of the fitted exponent, from what `shrinking` returns."""
    shrunk = slurries.dropna(subset=["shrink_time_us"])
    exponent, standard_error = power_law(shrunk.particles.to_numpy(), shrunk.shrink_time_us.to_numpy())
    row = {"barostat": slurries.barostat.iloc[0], "slurries": len(shrunk), "exponent": exponent}
    return pd.DataFrame([row | {"standard_error": standard_error}])


def coordinate_range_um(stores: list[FrameStore], frame: int) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest coordinate (3,) of all slurries at one frame."""
    positions_um = np.concatenate([store.position_um(frame) for store in stores])
    return positions_um.min(axis=0), positions_um.max(axis=0)


def volume_errors(predicted: FrameStore, relaxed: FrameStore, dem: FrameStore, last_input: int, target: int) -> dict:
    """Relative errors of the volume of one prediction; InputError if the files hold different structures."""
    for store in (predicted, relaxed):
        store.check_same_particles(dem)
    if relaxed.attributes["surrogate"] != predicted.attributes["surrogate"]:
        raise InputError(f"{relaxed.path}: {relaxed.attributes['surrogate']}, not the surrogate of {predicted.path}")
    end_um3 = dem.volume_um3(target)
    scale = scale_of_prediction(predicted.position_um(predicted.last), dem.position_um(last_input))
    return {
        "predicted_volume_error": predicted.volume_um3(predicted.last) / end_um3 - 1,
        "relaxed_volume_error": relaxed.volume_um3(relaxed.last) / end_um3 - 1,
        "coordinate_volume_error": scale**3 * dem.volume_um3(last_input) / end_um3 - 1,
    }


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--frames", "DEM frames of the training and predicted slurries", nargs="+")
    parser.add_input("--run-json", "run.json of slurries run to the end", nargs="+")
    parser.add_input("--thermo", "thermo.csv of the same, in order", nargs="+")
    parser.add_input("--predicted", "predicted structures (HDF5)", nargs="+")
    parser.add_input("--relaxed", "the same relaxed, in order (HDF5)", nargs="+")
    parser.add_tables("equilibrium")
    parser.add_value("--last-input-frame", "number of the last input frame", type=int)
    parser.add_value("--target-frame", "number of the final DEM frame", type=int)
    parser.add_output("--table", "table of surrogates and slurries (CSV)")
    parser.add_output("--clock", "table of the fitted exponent (CSV)")
    parser.as_many_of_each("run_json", "thermo")
    parser.as_many_of_each("predicted", "relaxed")


def main(args: Namespace) -> None:
    """Compare and write both tables."""
    frame = args.last_input_frame
    with ExitStack() as opened:
        slurries = shrinking(args.run_json, args.thermo, read_equilibrium(args.equilibrium))
        stores = {}
        for path in args.frames:
            store = opened.enter_context(read_frames(path))
            stores[str(store.attributes["slurry"])] = store
        training = [store for slurry, store in stores.items() if slurries.role.get(slurry) == "train"]
        if not training:
            raise InputError("--frames: no slurry of role train, so there is no range of coordinates to compare with")
        range_um = coordinate_range_um(training, frame)
        rows = []
        for predicted_path, relaxed_path in zip(args.predicted, args.relaxed, strict=True):
            with read_frames(predicted_path) as predicted, read_frames(relaxed_path) as relaxed:
                slurry = str(predicted.attributes["slurry"])
                if slurry not in stores or slurry not in slurries.index:
                    raise InputError(f"{predicted_path}: slurry {slurry}: no --frames and --run-json of it")
                dem = stores[slurry]
                rows.append(
                    {"surrogate": predicted.attributes["surrogate"], "slurry": slurry}
                    | slurries.loc[slurry].to_dict()
                    | {
                        "last_input_density_g_cm3": dem.density_g_cm3(frame),
                        "outside_share": outside_share(dem.position_um(frame), *range_um),
                    }
                    | volume_errors(predicted, relaxed, dem, frame, args.target_frame)
                )
        write_table(args.table, rows, digits=6)
        fitted = clock(slurries)
        write_text(args.clock, fitted.to_csv(index=False, float_format="%.6f"))
    row = fitted.iloc[0]
    print(
        f"{row.barostat}: shrink time ~ particles^{row.exponent:.3f} +- {row.standard_error:.1g} over "
        f"{row.slurries:.0f} slurries"
    )


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
