"""Write the tables of the documentation from the reference results.

A table in a Markdown file stands between two markers:

    <!-- table: NAME -->
    <!-- end of table -->

This script replaces what stands between them by the table of that name, a function of one of the modules beside it. It
reads results/reference and config, and writes README.md, docs/*.md and results/reference/README.md. With --check it
writes nothing, and fails if a file would change: `make tables` mends that.
"""

import argparse
import re
import sys
from collections.abc import Callable
from inspect import getmembers, isfunction

import pandas as pd

import evaluation_tables
import explore_tables
import neighbours_tables
import published_tables
import running_tables
import tape_tables
import transfer_tables
from reference_results import MISSING, ROOT

PAGES = ("README.md", "docs/*.md", "results/reference/README.md")
MARKED = re.compile(r"(<!-- table: (\w+) -->\n).*?(<!-- end of table -->)", re.DOTALL)
MARKER = re.compile(r"<!-- (?:table: |end of table)")

TABLES: dict[str, Callable[[], pd.DataFrame]] = {
    name: function
    for module in (
        evaluation_tables,
        explore_tables,
        neighbours_tables,
        published_tables,
        running_tables,
        tape_tables,
        transfer_tables,
    )
    for name, function in getmembers(module, isfunction)
    if function.__module__ == module.__name__ and not name.startswith("_")
}


def markdown(frame: pd.DataFrame) -> str:
    """Table in Markdown with the columns of `frame` as header; what is missing is a dash."""
    cells = [list(frame.columns), ["---"] * len(frame.columns)]
    cells += frame.astype(object).where(frame.notna(), MISSING).to_numpy().tolist()
    return "".join(f"| {' | '.join(row)} |\n" for row in cells)


def fill(text: str) -> str:
    """Return the text of a page with its tables written anew.

    ValueError if a marker has no partner, or names a table that is not registered.
    """
    marked = MARKED.findall(text)
    if len(MARKER.findall(text)) != 2 * len(marked):
        raise ValueError("a marker of a table has no partner")
    if unknown := sorted({name for _, name, _ in marked} - set(TABLES)):
        raise ValueError(f"no table {', '.join(unknown)}")
    return MARKED.sub(lambda match: match[1] + markdown(TABLES[match[2]]()) + match[3], text)


def main() -> None:
    """Write all tables, or check that they are written."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="write nothing; fail if a table would change")
    check = parser.parse_args().check
    changed = []
    for path in (path for pattern in PAGES for path in sorted(ROOT.glob(pattern))):
        text = path.read_text(encoding="utf-8")
        try:
            filled = fill(text)
        except ValueError as error:
            sys.exit(f"error: {path.relative_to(ROOT)}: {error}")
        if filled != text:
            changed.append(str(path.relative_to(ROOT)))
            if not check:
                path.write_text(filled, encoding="utf-8")
    if check and changed:
        sys.exit(f"error: {', '.join(changed)}: tables differ from the reference results; run `make tables`")


if __name__ == "__main__":
    main()
