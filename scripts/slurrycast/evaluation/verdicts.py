"""Who is better, or whether it is a tie, and how far structures are off in units of the scatter between DEM runs."""

from collections.abc import Collection, Mapping

import numpy as np
import pandas as pd

# A mean difference over the slurries counts if it is more than so many of its standard errors.
STANDARD_ERRORS = 2
FEWEST_TO_JUDGE = 3
VERDICTS = ("worse", "better", "tie", None)  # what is unwelcome comes first


def judged(differences: pd.Series) -> str | None:
    """Say whether errors less those of the reference, slurry by slurry, make it "better", "worse" or a "tie".

    A tie is a mean difference within `STANDARD_ERRORS` of its own standard errors over the slurries; None where there
    are less than `FEWEST_TO_JUDGE` of them.
    """
    known = differences.dropna()
    if len(known) < FEWEST_TO_JUDGE:
        return None
    if abs(known.mean()) <= STANDARD_ERRORS * known.std() / np.sqrt(len(known)):
        return "tie"
    return "better" if known.mean() < 0 else "worse"


def outcome(verdicts: Collection[str | None]) -> str:
    """What several verdicts say together.

    "tie" where all are a tie, "nothing" where nothing is better, "unknown" where none could be judged, else "mixed".
    """
    if set(verdicts) <= {"tie", "worse"}:
        return "tie" if set(verdicts) == {"tie"} else "nothing"
    return "unknown" if set(verdicts) == {None} else "mixed"


def by_verdict(verdicts: Mapping[str, str | None]) -> list[tuple[str | None, list[str]]]:
    """Group verdicts by quantity into (verdict, quantities), the worse first: [("worse", ["density"]), ...]."""
    return [
        (verdict, [quantity for quantity, judgement in verdicts.items() if judgement == verdict])
        for verdict in VERDICTS
        if verdict in verdicts.values()
    ]


def deviations(structure_errors: pd.DataFrame) -> pd.DataFrame:
    """Rows of tables/structure_errors.csv with `deviation`, |value - dem_value|, and `in_sd`, it over replica_sd.

    `in_sd` is NaN where the scatter between replicas is zero or not known.
    """
    deviation = (structure_errors.value - structure_errors.dem_value).abs()
    scatter = structure_errors.replica_sd.where(structure_errors.replica_sd > 0)
    return structure_errors.assign(deviation=deviation, in_sd=deviation / scatter)
