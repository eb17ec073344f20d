"""The new surrogate of docs/surrogates.md, added as the document says and run beside another one."""

import re
import textwrap

import pytest
import yaml

from checkouts import copy_checkout, snakemake
from configurations import HEADER, ROOT
from slurrycast.data.tables import read_table

SLURRIES = HEADER + "T1\ttrain\t1\t1\t1101\n1\ttest\t1\t1\t2101\n"


@pytest.mark.slow
def test_the_documented_surrogate_stands_in_the_tables(tmp_path):
    project = copy_checkout(tmp_path / "project")
    document = (ROOT / "docs" / "surrogates.md").read_text(encoding="utf-8")
    steps = document.partition("## To add one")[2]
    blocks = re.findall(r"^ +```(\w+)\n(.*?)^ +```$", steps, re.MULTILINE | re.DOTALL)
    assert [language for language, _ in blocks] == ["python", "text", "yaml", "text"]
    module, name, settings, command = (textwrap.dedent(block) for _, block in blocks)
    place, registry = re.findall(r"`(scripts/\S+\.py)`:", steps)
    (project / place).write_text(module, encoding="utf-8")
    text = (project / registry).read_text(encoding="utf-8")
    assert text.count("NAMES = (\n") == 1
    (project / registry).write_text(text.replace("NAMES = (\n", f"NAMES = (\n    {name}"), encoding="utf-8")
    (project / "drift.yaml").write_text(settings, encoding="utf-8")
    snakemake(project, "--dry-run", "--configfile", "drift.yaml")  # over the demo scale

    fewer = {
        "slurries": "few.tsv",
        "evaluation": {"surrogates": [], "replicated": ["1"]},
        "convergence": {"slurry": "T1"},
    }
    (project / "few.tsv").write_text(SLURRIES, encoding="utf-8")
    (project / "few.yaml").write_text(yaml.safe_dump(fewer), encoding="utf-8")
    files = command.partition("--configfile ")[2].split()
    snakemake(project, "tables", "--configfile", *files, "few.yaml")

    tables = project / "results" / "drift" / "tables"
    for table in ("coordinate_errors", "rdf_errors", "density_volume", "speedup"):
        assert {"affine", "drift"} <= set(read_table(tables / f"{table}.csv").surrogate), table
    errors = read_table(tables / "coordinate_errors.csv")
    assert errors.notna().all(axis=None)
    assert len(errors[errors.surrogate == "drift"]) == len(errors[errors.surrogate == "affine"]) > 0
