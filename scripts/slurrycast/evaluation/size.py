"""What the size of a slurry changes: how fast its box shrinks, and how far its coordinates reach. Pure numpy."""

import numpy as np

SHRUNK_SHARE = 0.75  # a box edge of this share of its start marks how fast a run shrinks


def shrink_time_us(times_us: np.ndarray, edge_um: np.ndarray) -> float:
    """Time at which a box edge first is SHRUNK_SHARE of its first value.

    Parameters
    ----------
    times_us, edge_um
        Times (rows,), rising, and the edge at each of them; it is taken as linear in between.

    Returns
    -------
    Time in us; NaN if the edge never is so short.
    """
    mark_um = SHRUNK_SHARE * edge_um[0]
    rows_below = np.flatnonzero(edge_um <= mark_um)
    if len(rows_below) == 0:
        return np.nan
    around = slice(rows_below[0] - 1, rows_below[0] + 1)
    return float(np.interp(-mark_um, -edge_um[around], times_us[around]))  # np.interp wants rising abscissae


def outside_share(position_um: np.ndarray, lowest_um: np.ndarray, highest_um: np.ndarray) -> float:
    """Share of the coordinates (n, 3) in um outside the range from `lowest_um` to `highest_um` (3,) of their axis."""
    return float(np.mean((position_um < lowest_um) | (position_um > highest_um)))
