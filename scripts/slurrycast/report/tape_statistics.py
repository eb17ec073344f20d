"""Numbers of the sections on green tapes: properties of the tapes of each source, and how far they are from the DEM."""

from collections.abc import Mapping, Sequence

import pandas as pd

from slurrycast.evaluation.verdicts import DIFFERS, EQUIVALENT, judge, judged_tape_rows, mean_difference
from slurrycast.report.evaluation_results import Evaluation
from slurrycast.report.names import measure_name, tape_quantity
from slurrycast.report.results import Results
from slurrycast.report.verdict_statistics import counted

# shown in this order, if the tapes have them
QUANTITIES = (
    "green_density",
    "shrinkage",
    "thickness",
    "share_ceramic_union",
    "share_organic_union",
    "share_void_union",
    "share_ceramic_filled",
    "share_nonceramic_filled",
    "coordination_",
    "contacts_",
    "percolation_",
    "pore_size_",
    "ceramic_share_sd_",
    "tortuosity_",
)


def shown_quantities(tapes: pd.DataFrame) -> list[str]:
    """Quantities of the tapes that are shown, in their order; percolation through the thickness alone."""
    known = [
        name for name in dict.fromkeys(tapes.quantity) if not name.startswith("percolation_") or name.endswith("z")
    ]
    return [name for start in QUANTITIES for name in known if name.startswith(start)]


def tapes(results: Results) -> Mapping | None:
    """Rows of the table, one a quantity: means over the test slurries, or all if none is one; None where nothing dries.

    `loosest` and `densest` are the tapes at the ends of friction, `nearest` that with the measured green density, None
    without one or if it lies beyond both. `green` and `shrinkage` are means by source; `void` and `density`, which is
    that of the slurries, are those of the first one. Differences are means over the test slurries of a source's tape
    less the DEM's, with half of the width of their interval, and the verdict. `counts` is what `_counts` makes of the
    verdicts.
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
    verdicts = judge(judged_tape_rows(dried, results.test))
    verdict_of = verdicts.set_index(["surrogate", "measure"]).verdict
    for quantity in shown_quantities(dried):
        of_quantity = dried[dried.quantity == quantity].set_index("slurry")
        row = [tape_quantity(quantity, units[quantity])]
        row += [of_quantity[of_quantity.source == source].value.mean() for source in sources]
        if compared:
            row.append(of_quantity[of_quantity.source == "dem"].replica_sd.mean())
        for source in compared:
            of_source = of_quantity[of_quantity.source == source]
            difference = of_source.value - of_source.dem_value
            interval = mean_difference(difference)
            row += [difference.mean(), (interval.upper - interval.lower) / 2, verdict_of.get((source, quantity))]
        rows.append(row)
    calibration = results.drying_calibration.assign(void=1 - results.drying_calibration.packing_fraction)
    return {
        "rows": rows,
        **dict(zip(("loosest", "densest"), calibration.to_dict("records"), strict=False)),
        "nearest": calibration.iloc[-1].to_dict() if len(calibration) > 2 else None,
        "sources": sources,
        "compared": compared,
        "counts": _counts(verdicts, compared),
        "green": {source: _mean(dried, source, "green_density") for source in sources},
        "shrinkage": {source: _mean(dried, source, "shrinkage") for source in sources},
        "void": _mean(dried, sources[0], "share_void_union"),
        "density": _mean(table[table.stage == "slurry"], sources[0], "density"),  # of the slurries
        "slurries": list(dict.fromkeys(dried.slurry)),
    }


def _mean(dried: pd.DataFrame, source: str, quantity: str) -> float:
    return dried[(dried.source == source) & (dried.quantity == quantity)].value.mean()


def _counts(verdicts: pd.DataFrame, surrogates: Sequence[str]) -> Mapping:
    """How many properties are judged and equivalent, and the names of those that differ, by surrogate."""
    counts = {}
    for surrogate in surrogates:
        judged, numbers = counted(verdicts, surrogate)
        counts[surrogate] = {
            "judged": len(judged),
            "equivalent": numbers[EQUIVALENT],
            "different": [measure_name(measure) for measure in judged.measure[judged.verdict == DIFFERS]],
        }
    return counts


def tape_verdicts(evaluation: Evaluation) -> Mapping | None:
    """Judged properties of tapes, one a row; None where none are judged.

    A row has the name, the mean of the DEM and the replica sd over the test slurries, and for each surrogate the mean
    difference in replica sd with half of its interval, and the verdict. `counts` is what `_counts` makes of these.
    """
    if evaluation.tape_verdicts is None:
        return None
    errors = evaluation.tested(evaluation.tape_errors)
    verdicts = evaluation.tape_verdicts.set_index(["surrogate", "measure"])
    of_all = pd.MultiIndex.from_product([verdicts.index.unique(level) for level in verdicts.index.names])
    verdicts = verdicts.reindex(of_all)  # a tape may be too thin for a measure that another one has
    surrogates = list(dict.fromkeys(evaluation.tape_verdicts.surrogate))
    units = errors.drop_duplicates("quantity").set_index("quantity").unit
    rows = []
    for measure in dict.fromkeys(evaluation.tape_verdicts.measure):
        of_measure = errors[errors.quantity == measure].drop_duplicates("slurry")
        row = [tape_quantity(measure, units[measure]), of_measure.dem_value.mean(), of_measure.replica_sd.mean()]
        for surrogate in surrogates:
            judged = verdicts.loc[surrogate, measure]
            row += [judged.mean_in_sd, (judged.upper_in_sd - judged.lower_in_sd) / 2, judged.verdict]
        rows.append(row)
    counts = _counts(evaluation.tape_verdicts, surrogates)
    return {"rows": rows, "surrogates": surrogates, "counts": counts}
