"""The check before any job: what is shipped passes, and all problems are reported at once, before anything starts."""

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest
import yaml

from checkouts import copy_checkout, snakemake
from configurations import BEHIND, HEADER, ROOT, SCALES, load, merged, nested, read_slurries, scaled, shipped
from slurrycast.config.configuration import ConfigurationError, check, checked_slurries, in_order
from slurrycast.config.dem_checks import replicated_pairs
from slurrycast.config.physics import physics
from slurrycast.runtime.files import InputError

pytestmark = pytest.mark.usefixtures("in_empty_project")


@pytest.mark.parametrize("scale", ["config", *SCALES])
def test_shipped_configurations_have_no_problems(scale):
    assert check(shipped(scale)) == []


@pytest.mark.parametrize("factor", [0.1, 10])
def test_particles_may_be_of_another_size(factor):
    """With as many of them and, but for the scale, the same motion."""
    config = scaled(shipped("recipe"), factor)
    config["dem"]["pressure_damping_us"] *= factor
    config["evaluation"]["surrogates"] = ["neighbours"]  # whose cutoff follows them
    assert check(config) == []


@pytest.mark.parametrize("scale", [scale for scale in SCALES if scale not in BEHIND])  # that one is to be changed
def test_scales_hold_only_differences_and_a_name_for_each(scale):
    def leaves(value, path=()):
        if isinstance(value, dict):
            return [leaf for key, item in value.items() for leaf in leaves(item, (*path, key))]
        return [(path, value)]

    base, override = dict(leaves(load("config"))), leaves(load(scale))
    assert [path for path, value in override if base.get(path) == value] == []
    assert load(scale).get("run") == (None if scale == "tape" else {"name": scale})  # that one goes with others


def test_all_problems_are_reported_at_once(config):
    changes = {
        "run.name": "..",
        "dem.timestep_us": "1e-4",
        "dem.steps": 60001,
        "dem.frame": 121,
        "formulation.phases.NiO.mass_fraction": 0.6,
        "surrogate.names": ["vgg61"],
        "learning.target_frame": 500,
        "slurries": "bad.tsv",
    }
    for path, value in changes.items():
        config = merged(config, nested(path, value))
    Path("bad.tsv").write_text(HEADER + "A\ttrain\t1\t1\t1\nB\tnone\t0\t1\t1\nC\ttest\t0.1\t1\t3\n")
    lines = check(config)
    beginnings = [
        'run.name = ".."',
        'dem.timestep_us = "1e-4"',
        "dem.frame: unknown key",
        'bad.tsv line 3: role = "none"',
        "bad.tsv line 3: mass_units = 0.0",
        "bad.tsv line 3: seed = 1: must differ from line 2",
        "formulation.phases: mass fractions",
        "formulation.unit_mass_pg: slurry C ends",
        "dem.steps = 60001",
        "learning.target_frame = 500",
        "surrogate.names: 'vgg61'",
        'report.pictures: "vgg16"',
    ]
    for beginning in beginnings:
        assert len([line for line in lines if line.startswith(beginning)]) == 1, (beginning, lines)
    assert len(lines) == len(beginnings), lines
    with pytest.raises(ConfigurationError) as error:
        checked_slurries(config)
    assert error.value.lines == lines and isinstance(error.value, InputError)


def test_checked_slurries_returns_the_table(config):
    assert checked_slurries(config) == read_slurries("config/slurries.tsv")


@pytest.fixture(scope="module")
def project(tmp_path_factory) -> Path:
    """A checkout, in it a bad slurry table, and a slurry that was run with another time step under the name tiny."""
    folder = copy_checkout(tmp_path_factory.mktemp("a bäd project"))
    (folder / "s.tsv").write_text(HEADER + "T1\ttrain\t1\t1\n\nA\ttest\t1\t1\t1\nA\ttest\t1\t1\t2\n")
    slurry = read_slurries(ROOT / "config" / "slurries_tiny.tsv")[0]
    run = folder / "results" / "tiny" / "dem" / slurry.id / "run.json"
    run.parent.mkdir(parents=True)
    run.write_text(json.dumps({"physics": physics(merged(shipped("tiny"), nested("dem.timestep_us", 0.001)), slurry)}))
    return folder


def files_of(project: Path) -> list[Path]:
    """All files but those that Snakemake and Python keep for themselves."""
    return sorted(path for path in project.rglob("*") if not {".snakemake", "__pycache__"} & {*path.parts})


SEVERAL = {"run": {"name": "größe"}, "slurries": "s.tsv", "dem": {"steps": 60001, "temperature_k": float("nan")}}


@pytest.mark.parametrize(
    ("override", "lines"),
    [
        (
            SEVERAL,
            [
                "run.name = \"größe\": must be text of at most 100 letters, digits, '.', '_' and '-', without '-' at "
                "its start, other than '.', '..', 'README.md' and 'reference'",
                "dem.temperature_k = NaN: must be a number at least 1 and at most 100000",
                "s.tsv line 2: 4 cells: must be 5, separated by tabs",
                's.tsv line 5: id = "A": must differ from line 4',
                "dem.steps = 60001: must be a multiple of dem.frames - 1 = 120",
            ],
        ),
        (
            shipped("tiny"),
            [
                "results/tiny: the DEM of slurry T1 was run with dem.timestep_us = 0.001, the configuration has 0.002: "
                "choose another run.name, or set run.overwrite: true to compute it anew"
            ],
        ),
    ],
    ids=["several problems", "results of another recipe"],
)
def test_snakemake_prints_the_lines_before_any_job(project, override, lines):
    (project / "bad.yaml").write_text(yaml.safe_dump(override, allow_unicode=True, sort_keys=False), encoding="utf-8")
    before = files_of(project)
    printed = snakemake(project, "--configfile", "bad.yaml", fails=True)  # no dry run: nothing may start
    assert "\n".join(["", *lines, "Nothing was run.", ""]) in printed
    assert re.search("Traceback|jobs? to be|rule ", printed) is None
    assert files_of(project) == before


def test_snakemake_names_file_and_lines_of_repeated_keys(project):
    """In a profile and behind --configfile; the profile of the workflow is no configuration file."""
    (project / "profile.yaml").write_text("jobs: 2\nset-resources:\n  a:\n    mem: 1\n    mem: 2\n")
    (project / "twice.yaml").write_text("surrogate: {vgg16: {epochs: 5}}\nsurrogate: {vgg16: {epochs: 2}}\n")
    printed = snakemake(project, "--workflow-profile", "profile.yaml", "--configfile", "twice.yaml", "-n", fails=True)
    once = "must be given once in a section"
    lines = [
        f"twice.yaml line 2: key surrogate was given in line 1: {once}",
        f"profile.yaml line 5: key mem was given in line 4: {once}",
    ]
    assert "\n".join(["", *lines, "Nothing was run.", ""]) in printed
    assert re.search("Traceback|jobs? to be|rule ", printed) is None


@pytest.mark.parametrize("profile", ["default", "slurm"])
def test_snakemake_names_a_configuration_file_in_another_encoding(project, profile):
    """Before Snakemake opens it, which it does before the Snakefile."""
    (project / "latin.yaml").write_bytes("run:\n  name: größe\n".encode("latin-1"))
    executor = ["--executor", "local"] if profile == "slurm" else []  # its plugin need not be installed
    printed = snakemake(project, "--workflow-profile", profile, *executor, "--configfile", "latin.yaml", fails=True)
    assert printed.endswith("\nlatin.yaml line 2: byte 0xf6 is not UTF-8: must be saved as UTF-8\nNothing was run.\n")
    assert "Traceback" not in printed


def test_snakemake_names_a_default_configuration_in_another_encoding(project):
    path = project / "config" / "config.yaml"
    content = path.read_bytes()
    try:
        path.write_bytes("# größe\n".encode("latin-1") + content)
        printed = snakemake(project, fails=True)
    finally:
        path.write_bytes(content)
    assert "\nconfig/config.yaml line 1: byte 0xf6 is not UTF-8: must be saved as UTF-8\nNothing was run.\n" in printed
    assert "Traceback" not in printed


@pytest.mark.parametrize(
    ("phase", "classes", "pair"),
    [
        ("A1", [{"diameter_um": 1, "number_fraction": 1}], ["A1", "A1"]),  # one phase of one size and any name
        ("NiO", [{"diameter_um": d, "number_fraction": 0.3333333} for d in (0.6, 0.8, 1.0)], ["NiO", "NiO"]),
    ],
)
def test_one_phase_and_fractions_written_as_rounded_thirds_pass(config, phase, classes, pair):
    phases = {phase: {"mass_fraction": 1, "density_g_cm3": 4.0, "size_classes": classes}}
    config["formulation"]["phases"], config["analysis"]["rdf_pair"] = phases, pair
    config["drying"]["sources"] = []  # nothing dries
    assert check(config) == []


def test_a_phase_of_one_particle_has_no_rdf_with_itself(config):
    phases = config["formulation"]["phases"]
    for phase, mass_fraction in {"BDPD": 0.0007, "NiO": 0.6, "8YSZ": 0.3993}.items():
        phases[phase]["mass_fraction"] = mass_fraction
    config["formulation"]["expected_density_g_cm3"] = 3.5
    config["analysis"]["rdf_pair"] = ["BDPD", "NiO"]
    assert check(config) == []
    config["analysis"]["rdf_pair"] = ["BDPD", "BDPD"]
    assert check(config) == [
        'analysis.rdf_pair = ["BDPD", "BDPD"]: slurry 2 has 1 particle of BDPD: must be a phase with at least 2 '
        "(and 2 more slurries)"
    ]
    slurries = {slurry.id: slurry for slurry in read_slurries("config/slurries.tsv")}
    compared = [slurries[id] for id in ("2", "6")]
    assert list(replicated_pairs(config, compared, compared)) == []
    assert list(replicated_pairs(config, compared[:1], compared[:1])) == []
    assert list(replicated_pairs(config, compared[:1], compared)) == [
        'evaluation.replicated = ["2"]: no pair of particles BDPD-BDPD: must hold a slurry with one, as slurry 6 has,'
    ]


def test_each_pair_of_phases_of_a_compared_slurry_is_in_a_replicated_one(config):
    phases = config["formulation"]["phases"]
    for name in ("NiO", "8YSZ"):
        config["formulations"][name] = {
            "phases": {"BDPD": phases["BDPD"], name: phases[name] | {"mass_fraction": 0.87}}
        }
    slurries = {slurry.id: slurry for slurry in read_slurries("config/slurries.tsv")}
    halves = [replace(slurries["2"], id=name, formulation=name) for name in ("NiO", "8YSZ")]
    assert list(replicated_pairs(config, halves, halves)) == []
    assert list(replicated_pairs(config, halves, [*halves, slurries["6"]])) == [
        'evaluation.replicated = ["NiO", "8YSZ"]: no pair of particles NiO-8YSZ: must hold a slurry with one, as '
        "slurry 6 has,"
    ]


def test_order_of_keys_is_that_of_the_schema_but_for_phases(config):
    def backwards(value):
        if isinstance(value, dict):
            return {key: backwards(value[key]) for key in reversed(value)}
        return [backwards(item) for item in value] if isinstance(value, list) else value

    ordered = in_order(config)
    assert ordered == config and json.dumps(ordered) == json.dumps(config)
    phases = list(config["formulation"]["phases"])
    ordered = in_order(backwards(config))
    assert ordered == config and list(ordered["formulation"]["phases"]) == phases[::-1]
    ordered["formulation"]["phases"] = {phase: ordered["formulation"]["phases"][phase] for phase in phases}
    assert json.dumps(ordered) == json.dumps(config)
