"""Measure the quality of spreads: which share of the errors their intervals cover, and whether they rank the errors.

In: pairs of frame stores (HDF5): a predicted structure with a spread, and the DEM frames of the same slurry with the
target frame; the calibration (JSON) of each surrogate.
Out: a table (CSV), one row for each pair and level:
    role                validation, for the slurries that the factor is calibrated on, or test
    level, factor       the share of coordinates to be covered, and the factor that does so on the validation slurries
    coverage            share of coordinates whose |error| is at most factor x spread
    rank_correlation    Spearman's, of a particle's spread (root mean square over axes) and the length of its error
    mean_spread_um, rms_error_um    over all coordinates
"""

import json
from collections.abc import Mapping, Sequence

import pandas as pd

from slurrycast.data.tables import write_table
from slurrycast.evaluation.uncertainty import (
    Calibration,
    Judged,
    coverage,
    rank_correlation,
    read_calibration,
    read_judged,
)
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.files import InputError

COLUMNS = (
    *("surrogate", "slurry", "role", "level", "factor", "coverage"),
    *("rank_correlation", "mean_spread_um", "rms_error_um"),
)


def uncertainty_table(
    judged: Sequence[Judged], calibrations: Sequence[Calibration], roles: Mapping[str, str]
) -> pd.DataFrame:
    """Table of all predictions; InputError if the calibration of a surrogate or the role of a slurry is missing."""
    by_surrogate = {calibration.surrogate: calibration for calibration in calibrations}
    rows = []
    for one in judged:
        if one.surrogate not in by_surrogate:
            raise InputError(f"--calibrations: none of surrogate {one.surrogate}")
        if one.slurry not in roles:
            raise InputError(f"--roles: slurry {one.slurry} has none")
        calibration = by_surrogate[one.surrogate]
        of_all_levels = {
            "rank_correlation": rank_correlation(one.spread_um, one.error_um),
            "mean_spread_um": one.spread_um.mean(),
            "rms_error_um": (one.error_um**2).mean() ** 0.5,
        }
        names = {"surrogate": one.surrogate, "slurry": one.slurry, "role": roles[one.slurry]}
        for level, factor in zip(calibration.levels, calibration.factors, strict=True):
            interval = {"level": level, "factor": factor, "coverage": coverage(one.scores, factor)}
            rows.append(names | interval | of_all_levels)
    return pd.DataFrame(rows, columns=COLUMNS)


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_predictions(required=True)
    parser.add_input("--calibrations", "calibration of each surrogate (JSON)", nargs="+")
    parser.add_value("--roles", "JSON: role of each slurry", type=json.loads)
    parser.add_output("--table", "table of the uncertainty (CSV)")


def main(args: Namespace) -> None:
    """Measure every prediction and write the table."""
    calibrations = [read_calibration(path) for path in args.calibrations]
    judged = read_judged(args.predicted, args.frames, args.target_frame)
    table = uncertainty_table(judged, calibrations, args.roles)
    write_table(args.table, table)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
