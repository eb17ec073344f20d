"""Compare predicted with simulated final coordinates, for any number of surrogates and slurries.

In: pairs of frame stores (HDF5): a predicted structure, and the DEM frames of the same slurry with the target frame.
Out: a table (CSV) of one row for each pair and axis (x, y, z, all) with MSE (um2), MAE (um) and R2 of the unwrapped
coordinates less their mean, and the same with suffix _true_box for the prediction rescaled to the DEM's box.
"""

from slurrycast.analysis.errors import AXES, coordinate_errors, true_box_errors
from slurrycast.data.frames import FrameStore, read_frames
from slurrycast.data.tables import write_table
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.costs import measured_cost

MEASURES = ("mse_um2", "mae_um", "r2")
COLUMNS = ("surrogate", "slurry", "axis", *MEASURES, *(f"{measure}_true_box" for measure in MEASURES))


def error_rows(predicted: FrameStore, dem: FrameStore, target_frame: int) -> list[dict]:
    """Rows of the table for one prediction; InputError if the two files hold different particles."""
    predicted.check_same_particles(dem)
    target_um, predicted_um = dem.position_um(target_frame), predicted.position_um(predicted.last)
    edges_um = dem.box(target_frame)[1], predicted.box(predicted.last)[1]
    predicted_box = coordinate_errors(target_um, predicted_um)
    true_box = true_box_errors(target_um, predicted_um, *edges_um)
    return [
        {name: predicted.attributes[name] for name in ("surrogate", "slurry")}
        | {"axis": axis}
        | vars(predicted_box[axis])
        | {f"{name}_true_box": value for name, value in vars(true_box[axis]).items()}
        for axis in AXES
    ]


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_predictions(required=False)
    parser.add_output("--table", "table of errors (CSV)")
    parser.add_output("--cost", "cost record (JSON)")


def main(args: Namespace) -> None:
    """Compare every pair and write the table."""
    with measured_cost(args.cost, "compare_coordinates"):
        rows = []
        for predicted_path, dem_path in zip(args.predicted, args.frames, strict=True):
            with read_frames(predicted_path) as predicted, read_frames(dem_path) as dem:
                rows += error_rows(predicted, dem, args.target_frame)
        write_table(args.table, rows, columns=COLUMNS)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
