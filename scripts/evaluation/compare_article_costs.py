"""Set the costs that the reference article reports, term by term, beside those measured here.

In: tables/speedup.csv and tables/equilibrium.csv, which says which slurries are of role test.
Out: a table (CSV) of one row for each surrogate and term: slurries (number of those of role test), unit, article (its
number; empty where it gives none), article_says (what it leaves open), and ours, of wall time: the median over the
slurries; a part of a whole is that of the sums over the slurries. The reference article ran on other machines, at
another scale.
"""

import pandas as pd

from slurrycast.data.tables import read_equilibrium, read_table, write_table
from slurrycast.evaluation.speedup import HYBRID_PARTS
from slurrycast.report import reference_article as article
from slurrycast.runtime.command_line import Namespace, Parser, run_main

NOT_REPORTED = "not reported"


def terms(speedup: pd.DataFrame) -> pd.DataFrame:
    """Columns term, unit, article, article_says, ours of one surrogate, from its rows (wall_s) of speedup.csv."""
    total, median = (values(numeric_only=True) for values in (speedup.sum, speedup.median))
    input_share = article.INPUT_STEPS / article.STEPS
    claimed = article.FULL_DEM_MIN / article.HYBRID_MIN
    with_input_dem = article.FULL_DEM_MIN / (article.HYBRID_MIN + input_share * article.FULL_DEM_MIN)
    without_input_dem = (speedup.dem / (speedup.hybrid - speedup.run_slurry_to_input)).median()
    measured_share = 100 * total.run_slurry_to_input / total.dem
    beyond_input = "if its hybrid time leaves out the DEM to the last input frame"
    equal_steps = f"{beyond_input} and every step costs the same"
    rows = [
        ("full DEM", "min", article.FULL_DEM_MIN, "", median.dem / 60),
        ("hybrid", "min", article.HYBRID_MIN, "about; which stages it counts is not stated", median.hybrid / 60),
        ("full DEM / hybrid", "", claimed, "which stages the hybrid counts is not stated", median.ratio),
        ("the same without the DEM to the last input frame", "", claimed, beyond_input, without_input_dem),
        ("the same with the DEM to the last input frame", "", with_input_dem, equal_steps, median.ratio),
        ("DEM to equilibrium / hybrid", "", None, NOT_REPORTED, median.ratio_to_equilibrium),
        (
            "DEM to the last input frame / full DEM",
            "%",
            100 * input_share,
            "share of its steps; of its time not reported",
            measured_share,
        ),
    ]
    for stage, name in HYBRID_PARTS.items():
        says = article.HYBRID_PART_CLAIMS.get(stage, NOT_REPORTED)
        rows.append((f"share of hybrid: {name}", "%", None, says, 100 * total[stage] / total.hybrid))
    return pd.DataFrame(rows, columns=["term", "unit", "article", "article_says", "ours"])


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_tables("speedup", "equilibrium")
    parser.add_output("--table", "table (CSV)")


def main(args: Namespace) -> None:
    """Read, compare, write."""
    speedup, equilibrium = read_table(args.speedup), read_equilibrium(args.equilibrium)
    test = equilibrium.slurry[equilibrium.role == "test"]
    wall = speedup[(speedup.clock == "wall_s") & speedup.slurry.isin(test)]
    tables = []
    for surrogate, rows in wall.groupby("surrogate", sort=False):
        table = terms(rows)
        table.insert(0, "surrogate", surrogate)
        table.insert(1, "slurries", len(rows))
        tables.append(table)
    write_table(args.table, pd.concat(tables), digits=6)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
