"""Numbers of the section on green tapes: properties of the tapes of each source, and how far they are from the DEM."""

from collections.abc import Mapping

import pandas as pd

from slurrycast.evaluation.verdicts import mean_difference
from slurrycast.report.names import tape_quantity
from slurrycast.report.results import Results

# shown in this order, if the tapes have them
QUANTITIES = (
    "green_density",
    "shrinkage",
    "thickness",
    "share_ceramic_union",
    "share_organic_union",
    "share_void_union",
    "share_ceramic_filled",
    "coordination_",
    "contacts_",
    "percolation_",
    "pore_size_",
    "ceramic_share_sd_",
    "tortuosity_z_",
)


def shown_quantities(tapes: pd.DataFrame) -> list[str]:
    """Quantities of the tapes that are shown, in their order; percolation through the thickness alone."""
    known = [
        name for name in dict.fromkeys(tapes.quantity) if not name.startswith("percolation_") or name.endswith("z")
    ]
    return [name for start in QUANTITIES for name in known if name.startswith(start)]


def tapes(results: Results) -> Mapping | None:
    """Rows of the table, one a quantity: means over the test slurries, or all if none is one; None where nothing dries.

    Differences are means over the test slurries of a source's tape less the DEM's, with half of the width of their
    interval.
    """
    table = results.microstructure
    if table is None:
        return None
    rows = []
    dried = table[table.stage == "tape"]
    if results.test:
        dried = dried[dried.slurry.isin(results.test)]
    sources = list(dict.fromkeys(dried.source))
    compared = [source for source in sources if source != "dem" and "dem" in sources]
    units = dried.drop_duplicates("quantity").set_index("quantity").unit
    for quantity in shown_quantities(dried):
        of_quantity = dried[dried.quantity == quantity].set_index("slurry")
        name = tape_quantity(quantity, units[quantity])
        means = [of_quantity[of_quantity.source == source].value.mean() for source in sources]
        differences = []
        for source in compared:
            of_source = of_quantity[of_quantity.source == source]
            mean = mean_difference(of_source.value - of_source.dem_value)
            differences += [mean.mean, (mean.upper - mean.lower) / 2]
        rows.append([name, *means, *differences])
    return {
        "rows": rows,
        "sources": sources,
        "compared": compared,
        "green": {source: _mean(dried, source, "green_density") for source in sources},
        "shrinkage": {source: _mean(dried, source, "shrinkage") for source in sources},
        "slurries": list(dict.fromkeys(dried.slurry)),
    }


def _mean(dried: pd.DataFrame, source: str, quantity: str) -> float:
    return dried[(dried.source == source) & (dried.quantity == quantity)].value.mean()
