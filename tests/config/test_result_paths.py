"""Ids of slurries and labels of surrogates: each file of the results has a path of its own, or the check says so."""

import re
from itertools import product
from pathlib import Path

import pytest
from hypothesis import HealthCheck, event, example, given, settings
from hypothesis import strategies as st

from configurations import HEADER, ROOT, load, read_slurries
from slurrycast.config.configuration import check
from slurrycast.config.derived_runs import replicas, timestep_runs

pytestmark = pytest.mark.usefixtures("in_empty_project")

OUTPUTS = r"(?ms)^ +output:\n(.*?)^ +(?:log|conda|priority|localrule|wildcard_constraints):"
LIKELY = ["1", "1_rdf", "box_1", "1_r1", "1_r1_rdf", "box_1_r1", "x2_1", "f02_1", "1_dt100ps_s1", "box_1_rdf", "1_work"]
IDS = st.sampled_from(LIKELY) | st.from_regex(r"[1_abdfmors]{1,8}", fullmatch=True)
LABELS = ["affine", "affine_f02", "vgg16", "vgg16_box", "vgg16_box_nobox", "early_dem_x2", "early_dem_x10_f02"]


def patterns() -> list[str]:
    """Every path with an id or a label that a rule writes, without the folder of the results: frames/{slurry}.h5."""
    texts = [path.read_text(encoding="utf-8") for path in (ROOT / "workflow" / "rules").rglob("*.smk")]
    outputs = "".join(output for text in texts for output in re.findall(OUTPUTS, text))
    paths = re.findall(r'(?:\{RESULTS\}/|reported\(\s*")([^"]+)"', outputs)
    single_braces = {re.sub(r"{+(\w+)}+", r"{\1}", path) for path in paths}
    return sorted(path for path in single_braces if re.search("{(slurry|surrogate|source)}", path))


PATTERNS = patterns()


def test_patterns_are_found():
    assert len(PATTERNS) > 30
    assert {"structure/{source}/{slurry}_rdf.csv", "figures/slurry_{surrogate}_{slurry}.png"} < set(PATTERNS)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=60, deadline=None)
@given(
    st.lists(IDS, min_size=2, max_size=4, unique=True),
    st.lists(st.sampled_from(LABELS), min_size=2, max_size=4, unique=True),
)
@example(["1", "1_rdf"], ["affine", "vgg16"])
@example(["1", "box_1"], ["vgg16", "vgg16_box"])
@example(["1", "box_1"], ["affine", "vgg16"])
@example(["1", "1_r1_rdf"], ["affine", "vgg16"])
@example(["box_1", "1_r1"], ["vgg16", "vgg16_box"])
@example(["1", "f02_1"], ["affine", "affine_f02"])
def test_each_path_belongs_to_one_rule_and_its_names_or_the_names_are_refused(ids, labels):
    roles = dict(zip(ids, ["test", "train", "validation", "new"], strict=False))
    rows = [f"{id}\t{role}\t2\t1\t{seed}\n" for seed, (id, role) in enumerate(roles.items(), 1)]
    Path("s.tsv").write_text(HEADER + "".join(rows))
    config = load("config") | {"slurries": "s.tsv", "report": {"pictures": labels[:1]}}
    config["surrogate"]["names"], config["evaluation"]["surrogates"] = labels[:1], labels[1:]
    config["evaluation"]["replicated"], config["convergence"]["slurry"] = ids[:1], ids[0]
    lines = check(config)
    if lines:
        event("refused")
        said = (": rename one", ": rename that slurry", "must not be logs, begin with work or end with _work")
        assert all(line.endswith(said) for line in lines), lines
        return
    table = read_slurries("s.tsv")
    runs = [run.id for run in [*table, *replicas(config, table), *timestep_runs(config, table)]]
    values = {"slurry": runs, "surrogate": labels, "source": ["dem", *labels], "steps": ["", "-50"], "k": ["7"]}
    values |= {"stage": ["slurry", "tape"], "start": ["fine_tuned", "from_scratch"], "number": ["0", "4"]}
    parts = {f"\\{{{name}\\}}": f"(?P<{name}>{'|'.join(texts)})" for name, texts in values.items()}
    regexes = {}  # as Snakemake makes them of the patterns and constraints
    for pattern in PATTERNS:
        regexes[pattern] = re.escape(pattern)
        for written, group in parts.items():
            regexes[pattern] = regexes[pattern].replace(written, group)
    for pattern in PATTERNS:
        names = re.findall(r"{(\w+)}", pattern)
        asked = values | {"surrogate": labels[:1]} if pattern.endswith(".png") else values  # only some have pictures
        for chosen in product(*map(asked.get, names)):
            wildcards = dict(zip(names, chosen, strict=True))
            path = pattern.format(**wildcards)
            matches = [(other, match) for other, regex in regexes.items() if (match := re.fullmatch(regex, path))]
            assert [(other, match.groupdict()) for other, match in matches] == [(pattern, wildcards)], path
