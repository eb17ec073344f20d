"""Who is better, or whether it is a tie, and how far structures are off in units of the scatter between DEM runs."""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from slurrycast.report.page import listed, pair_name

# A mean difference over the slurries counts if it is more than so many of its standard errors.
STANDARD_ERRORS = 2
FEWEST_TO_JUDGE = 3
TIE_RULE = (
    f"A tie means: the mean of the paired differences over the test slurries is within {STANDARD_ERRORS} of its "
    f"standard errors, taken from the scatter over these slurries, of which it takes at least {FEWEST_TO_JUDGE}."
)


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


# what is unwelcome comes first
JUDGED_WORDS = {"worse": "worse", "better": "better", "tie": "a tie", None: "too few slurries to judge"}


def judged_list(verdicts: Mapping[str, str | None]) -> str:
    """Text of verdicts by what they are about, the worse first: "worse in a; a tie in b and c"."""
    parts = []
    for verdict, words in JUDGED_WORDS.items():
        those = [about for about, own in verdicts.items() if own == verdict]
        if those:
            parts.append(f"{words} in {listed(those)}")
    return "; ".join(parts)


def deviations(structure_errors: pd.DataFrame) -> pd.DataFrame:
    """Rows of tables/structure_errors.csv with `deviation`, |value - dem_value|, and `in_sd`, it over replica_sd.

    `in_sd` is NaN where the scatter between replicas is zero or not known.
    """
    deviation = (structure_errors.value - structure_errors.dem_value).abs()
    scatter = structure_errors.replica_sd.where(structure_errors.replica_sd > 0)
    return structure_errors.assign(deviation=deviation, in_sd=deviation / scatter)


QUANTITY_NAMES = {
    "density_g_cm3": "density (g/cm³)",
    "overlap_mean": "mean overlap",
    "overlap_max": "largest overlap",
    "packing_nominal": "packing fraction, nominal",
    "packing_union": "packing fraction, union",
    "perturbation_floor_um2": "perturbation floor (µm²)",
}


def quantity_name(quantity: str) -> str:
    """Name of a quantity of the tables in words: "RDF, NiO-8YSZ" of `rdf_NiO-8YSZ`."""
    kind, _, pair = quantity.partition("_")
    kinds = {"rdf": "RDF", "coordination": "coordination"}
    return f"{kinds[kind]}, {pair_name(pair)}" if kind in kinds else QUANTITY_NAMES.get(quantity, quantity)
