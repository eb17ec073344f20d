"""Calibrate the spread of a surrogate on its predictions of the validation slurries.

In: pairs of frame stores (HDF5): a predicted structure with a spread, and the DEM frames of the same slurry with the
target frame.
Out: JSON with the surrogate, levels, factors (by which spreads are multiplied so that |error| <= factor x spread holds
for the share `level` of coordinates), slurries, and the number of coordinates.
"""

from slurrycast.evaluation.uncertainty import calibrate, read_judged
from slurrycast.runtime.command_line import Namespace, Parser, run_main


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_predictions(required=True)
    parser.add_output("--calibration", "factors (JSON)")


def main(args: Namespace) -> None:
    """Calibrate and write."""
    calibration = calibrate(read_judged(args.predicted, args.frames, args.target_frame))
    calibration.write(args.calibration)
    pairs = zip(calibration.levels, calibration.factors, strict=True)
    factors = ", ".join(f"{level:.0%} within {factor:.4g} x spread" for level, factor in pairs)
    print(f"[{calibration.surrogate}] {factors}, of {calibration.coordinates} coordinates")


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
