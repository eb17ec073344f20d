"""The check before any job: what is shipped passes, what one mistake means for others, and earlier results."""

import json
import re
from pathlib import Path

import jsonschema
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from configurations import HEADER, ROOT, SCALES, copy_tables, load, merged, nested, shipped
from slurrycast.config import configuration
from slurrycast.config.configuration import ConfigurationError, Slurry, changed_physics, check, physics, read_slurries
from slurrycast.dem.recipe import particle_counts, particle_types
from slurrycast.runtime.files import InputError


@pytest.fixture(autouse=True)
def in_empty_project(tmp_path, monkeypatch):
    """A working directory with the shipped slurry tables and no results."""
    copy_tables(tmp_path)
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def config() -> dict:
    return load("config")


# ---- what is shipped


@pytest.mark.parametrize("scale", ["config", *SCALES])
def test_shipped_configurations_have_no_problems(scale):
    assert check(shipped(scale)) == []


@pytest.mark.parametrize("scale", SCALES)
def test_scales_hold_only_differences_and_their_own_name(scale):
    def leaves(value, path=()):
        if isinstance(value, dict):
            return [leaf for key, item in value.items() for leaf in leaves(item, (*path, key))]
        return [(path, value)]

    base, override = dict(leaves(load("config"))), leaves(load(scale))
    assert [path for path, value in override if base.get(path) == value] == []
    assert load(scale)["run"] == {"name": scale}


def test_slurry_tables_have_the_intended_sizes():
    slurries = read_slurries("config/slurries.tsv")
    masses = {role: [s.mass_units for s in slurries if s.role == role] for role in ("train", "test")}
    assert masses == {"train": [1, 1, 2, 2, 2.6, 3, 3, 4], "test": [3, 1, 1, 2, 2, 5, 4]}
    assert {s.id: s.thickness_ratio for s in slurries if s.role == "test"} == (
        dict.fromkeys("12367", 2.0) | dict.fromkeys("45", 1.2)
    )
    tiny = read_slurries("config/slurries_tiny.tsv")
    assert [s.role for s in tiny] == ["train"] * 3 + ["test"] * 2 + ["validation", "new"]
    assert {s.thickness_ratio for s in tiny} == {1.0}


@pytest.mark.parametrize("name", ["config", "slurries"])
def test_schemas_are_valid_and_refuse_unknown_keys_at_every_level(name):
    schema = configuration.schema(name)
    jsonschema.Draft202012Validator.check_schema(schema)

    def sections(rule):
        if rule.get("type") == "object":
            yield rule
        for item in [
            *rule.get("properties", {}).values(),
            *rule.get("patternProperties", {}).values(),
            *([rule["items"]] if "items" in rule else []),
        ]:
            assert "type" in item and "description" in item
            yield from sections(item)

    for section in sections(schema):
        assert section["additionalProperties"] is False
        assert section.get("required", []) == list(section.get("properties", {}))


def test_readme_is_in_step_with_schema_and_configuration():
    readme = (ROOT / "config" / "README.md").read_text(encoding="utf-8")
    assert readme.partition(configuration.GENERATED)[2] == configuration.reference()


def test_readme_has_every_configuration_with_its_scale():
    """In its table, between the name of the file and what it is for."""
    lines = (ROOT / "config" / "README.md").read_text(encoding="utf-8").splitlines()
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines if line.startswith("| `")]
    for path in sorted((ROOT / "config").glob("*.yaml")):
        config = shipped(path.stem)
        (row,) = (row for row in rows if f"`{path.name}`" in row[0])
        types = particle_types(config["formulation"]["phases"])
        particles = particle_counts(types, config["formulation"]["unit_mass_pg"]).sum()
        steps, step_us = config["dem"]["steps"], config["dem"]["timestep_us"]
        (network,) = {"neighbours", "vgg16"} & set(config["surrogate"]["names"])
        expected = [f"{particles:,}".replace(",", " "), f"{steps:,}".replace(",", " "), f"{step_us:.0e}"]
        assert row[1:4] == [*expected[:2], expected[2].replace("e-0", "e-")], path.name
        epochs = str(config["surrogate"][network]["epochs"])
        assert row[4] == (epochs if network == "vgg16" else f"{epochs} of `{network}`"), path.name


# ---- several mistakes, and mistakes that only show together


@pytest.mark.parametrize("value", [None, [], 3, "text"])
def test_configuration_that_is_no_mapping(value):
    (line,) = check(value)
    assert re.match(r"configuration = .*: must be a section with run, slurries", line)


def test_keys_that_yaml_does_not_read_as_text(config):
    config["formulation"]["phases"][8] = config["formulation"]["phases"].pop("8YSZ")
    config["report"][False] = 1
    lines = check(config)
    assert "formulation.phases: key 8 is not text: put it in quotes" in lines
    assert "report: key false is not text: put it in quotes" in lines


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
        configuration.checked_slurries(config)
    assert error.value.lines == lines and isinstance(error.value, InputError)


def test_checked_slurries_returns_the_table(config):
    assert configuration.checked_slurries(config) == read_slurries("config/slurries.tsv")


def test_one_phase_of_one_size_and_any_names_pass(config):
    config["formulation"]["phases"] = {
        "A1": {
            "mass_fraction": 1,
            "density_g_cm3": 4.0,
            "size_classes": [{"diameter_um": 1, "number_fraction": 1}],
        }
    }
    config["analysis"]["rdf_pair"] = ["A1", "A1"]
    assert check(config) == []


def test_fractions_written_as_rounded_thirds_pass(config):
    classes = [{"diameter_um": d, "number_fraction": 0.3333333} for d in (0.6, 0.8, 1.0)]
    config["formulation"]["phases"]["NiO"]["size_classes"] = classes
    assert check(config) == []


def test_training_slurries_are_needed_unless_a_model_is_given(config):
    Path("new.tsv").write_text(HEADER + "N1\tnew\t2\t1\t7\n")
    config["slurries"] = "new.tsv"
    assert check(config) == ["new.tsv: no slurry of role train: must be at least one unless surrogate.model is given"]
    Path("model.keras").write_bytes(b"")
    config["surrogate"]["model"] = "model.keras"
    assert check(config) == []
    config["surrogate"]["names"] = []
    assert check(config) == ["surrogate.names = []: must be a list of labels of surrogates, each once"]


def test_something_to_predict_is_needed(config):
    Path("train.tsv").write_text(HEADER + "T1\ttrain\t2\t1\t7\nV1\tvalidation\t2\t1\t8\n")
    config["slurries"] = "train.tsv"
    assert check(config) == ["train.tsv: no slurry of role test or new: must be at least one"]


def test_a_bad_row_is_not_reported_as_a_missing_role_too(config):
    Path("bad.tsv").write_text(HEADER + "T1\ttrain\t2\t1\t7\nN1\tnew\t-2\t1\t8\n")
    config["slurries"] = "bad.tsv"
    assert check(config) == ["bad.tsv line 3: mass_units = -2.0: must be a number above 0 and at most 100"]


def test_a_model_that_the_run_itself_writes_is_refused(config):
    """Its rule would delete it before it copies it."""
    model = Path("results/demo/models/vgg16/model.keras")
    model.parent.mkdir(parents=True)
    model.write_bytes(b"")
    config["surrogate"]["model"] = f"./{model}"
    assert check(config) == [
        'surrogate.model = "./results/demo/models/vgg16/model.keras": must lie outside results/demo/models, '
        "which this run writes: choose another run.name"
    ]
    config["run"]["name"] = "new_slurry"
    assert check(config) == []


@pytest.mark.parametrize("names", [["linear"], ["affine"], ["vgg16", "vgg16_box"]])
def test_a_model_is_of_one_keras_surrogate(config, names):
    Path("model.keras").touch()
    config["surrogate"] |= {"names": names, "model": "model.keras", "packing_fraction": 0.66}
    config["report"]["pictures"] = []
    config["evaluation"]["surrogates"] = []
    (line,) = check(config)
    assert line.endswith("must hold one surrogate with a Keras model, the one that surrogate.model is of")


def test_a_model_without_its_box_needs_the_packing_fraction(config):
    Path("model.keras").touch()
    config["surrogate"] |= {"names": ["affine", "vgg16_box"], "model": "model.keras"}
    config["report"]["pictures"] = []
    config["evaluation"]["surrogates"] = []
    (line,) = check(config)
    assert line.startswith("surrogate.packing_fraction = null: must be a number for vgg16_box with surrogate.model")
    config["surrogate"]["packing_fraction"] = 0.66
    assert check(config) == []


def test_what_needs_no_training_slurries(config):
    def asked():
        return [label for label in config["surrogate"]["names"] if configuration.without_training(config, label)]

    assert asked() == ["persistence", "vgg16"]
    config["surrogate"]["packing_fraction"] = 0.66
    assert asked() == ["persistence", "affine", "vgg16"]
    assert not configuration.without_training(config, "vgg16_box")
    assert configuration.without_training(config, "early_dem_x2")


def test_driven_dem_needs_no_training_slurries_where_the_packing_fraction_is_given(config):
    """It goes on with the DEM as early_dem does, but the box has to come from somewhere."""
    config["surrogate"]["packing_fraction"] = None
    assert not configuration.without_training(config, "driven_dem")
    config["surrogate"]["packing_fraction"] = 0.66
    assert configuration.without_training(config, "driven_dem")


def test_first_frame_seen_goes_back_where_a_surrogate_moves_its_windows(config):
    config["learning"]["input_frames"] = [7, 8, 9, 10]
    config["surrogate"]["neighbours"]["earlier_frames"] = 2
    assert configuration.first_frame_seen(config, "neighbours") == 8
    assert configuration.first_frame_seen(config, "neighbours_f18") == 16
    assert configuration.first_frame_seen(config, "vgg16") == 10
    assert configuration.first_frame_seen(config, "linear") == 10


def test_order_of_keys_is_that_of_the_schema_but_for_phases(config):
    def backwards(value):
        if isinstance(value, dict):
            return {key: backwards(value[key]) for key in reversed(value)}
        return [backwards(item) for item in value] if isinstance(value, list) else value

    ordered = configuration.in_order(config)
    assert ordered == config and json.dumps(ordered) == json.dumps(config)
    phases = list(config["formulation"]["phases"])
    ordered = configuration.in_order(backwards(config))
    assert ordered == config and list(ordered["formulation"]["phases"]) == phases[::-1]
    ordered["formulation"]["phases"] = {phase: ordered["formulation"]["phases"][phase] for phase in phases}
    assert json.dumps(ordered) == json.dumps(config)


def test_relaxation_steps_of_a_label_go_before_those_of_its_surrogate(config):
    config["relaxation"] |= {"steps": 3500, "steps_of": {"neighbours": 2000, "neighbours_f18": 1500}}
    steps = [
        configuration.own_relaxation_steps(config, label)
        for label in ("affine", "neighbours", "neighbours_f18", "neighbours_f06")
    ]
    assert steps == [3500, 2000, 1500, 2000]
    config["relaxation"]["steps_of"] = {"early_dem": 1000}  # a name that is no label without a variant
    assert check(config) == []
    assert configuration.own_relaxation_steps(config, "early_dem_x2") == 1000


# ---- runs that follow from the table


def test_replicas_differ_from_their_slurry_in_id_role_and_seed_alone(config):
    slurries = read_slurries(config["slurries"])
    runs = configuration.replicas(config, slurries)
    assert [run.id for run in runs] == [f"{slurry}_r{k}" for slurry in "26" for k in range(1, 6)]
    assert {run.role for run in runs} == {"replica"}
    assert len({run.seed for run in [*runs, *slurries]}) == len(runs) + len(slurries)
    slurry = next(slurry for slurry in slurries if slurry.id == "6")
    ours, theirs = physics(config, runs[-1]), physics(config, slurry)
    assert ours.pop("slurry") == theirs.pop("slurry") | {"seed": runs[-1].seed}
    assert ours == theirs


def test_timestep_runs_end_at_the_same_time_with_the_same_frames(config):
    runs = configuration.timestep_runs(config, read_slurries(config["slurries"]))
    assert [run.id for run in runs[::3]] == ["V1_dt100ps_s1", "V1_dt500ps_s1", "V1_dt1000ps_s1", "V1_dt2000ps_s1"]
    assert len({run.seed for run in runs}) == config["convergence"]["seeds"]
    for run in runs:
        dem = physics(config, run)["dem"]
        assert dem["steps"] * dem["timestep_us"] == pytest.approx(120)
        assert dem["thermo_every_steps"] * dem["timestep_us"] == pytest.approx(1)
        assert dem["frames"] == config["dem"]["frames"]
        assert dem["steps"] % (dem["frames"] - 1) == 0


def test_damping_time_for_the_mass_of_a_slurry(config):
    one, five = (Slurry(id_, "test", units, 2.0, 1) for id_, units in (("a", 1), ("b", 5)))
    damping_us = config["dem"]["pressure_damping_us"]
    assert physics(config, five)["dem"]["pressure_damping_us"] == damping_us
    config["dem"]["pressure_damping_exponent"] = -0.3
    assert physics(config, one)["dem"]["pressure_damping_us"] == damping_us
    assert physics(config, five)["dem"]["pressure_damping_us"] == pytest.approx(damping_us * 5**-0.3)
    assert "pressure_damping_exponent" not in physics(config, one)["dem"]


@pytest.mark.parametrize("id_", ["6_r1", "V1_dt100ps_s1"])
def test_a_slurry_may_not_be_named_like_a_run_that_follows_from_another(config, id_):
    table = Path(config["slurries"])
    table.write_text(table.read_text() + f"{id_}\ttest\t1\t1.0\t77\n")
    (line,) = check(config)
    assert f"its run {id_} is named like a slurry of the table: rename that slurry" in line


# ---- slurry table


def test_table_that_is_no_text_or_no_file():
    Path("s.tsv").write_bytes(b"\xff\xfe\x00")
    for path in ("s.tsv", "config", "missing.tsv", "nul\0"):
        with pytest.raises(InputError, match="cannot be read"):
            read_slurries(path)


def test_columns_in_any_order_with_byte_order_mark_and_windows_line_ends():
    text = "\ufeffseed\tid\trole\tthickness_ratio\tmass_units\r\n7\t a_1 \tnew\t1.5\t2e0\r\n\r\n"
    Path("s.tsv").write_bytes(text.encode("utf-8"))
    assert read_slurries("s.tsv") == [Slurry("a_1", "new", 2.0, 1.5, 7)]


CELLS = st.one_of(st.sampled_from(["T1", "train", "1", "2.5", "", '"', "new", "1e9"]), st.text(max_size=8))
TABLES = st.one_of(
    st.text(),
    st.text().map(HEADER.__add__),
    st.lists(st.lists(CELLS, min_size=4, max_size=6).map("\t".join)).map(lambda rows: HEADER + "\n".join(rows)),
)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=150, deadline=None)
@given(TABLES)
@example(HEADER + '"\t\n"')
@example(HEADER + "T1\ttrain\t1\t1\t\N{ARABIC-INDIC DIGIT ONE}")
def test_any_text_is_read_or_refused_in_lines_that_name_the_file(text):
    Path("any.tsv").write_text(text, encoding="utf-8", newline="")
    try:
        slurries = read_slurries("any.tsv")
    except InputError as error:
        assert error.lines and all(line.startswith("any.tsv") and len(line.splitlines()) == 1 for line in error.lines)
    else:
        assert slurries and all(re.fullmatch(r"[A-Za-z0-9_]+", s.id) and s.mass_units > 0 for s in slurries)


ROWS = st.builds(
    Slurry,
    id=st.from_regex(r"[A-Za-z0-9_]{1,50}", fullmatch=True),
    role=st.sampled_from(["train", "validation", "test", "new"]),
    mass_units=st.floats(1e-6, 100),
    thickness_ratio=st.floats(0.01, 100),
    seed=st.integers(1, 2**31 - 1),
)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(st.lists(ROWS, min_size=1, max_size=5, unique_by=(lambda s: s.id, lambda s: s.seed)))
def test_good_tables_are_read_as_written(slurries):
    rows = [f"{s.id}\t{s.role}\t{s.mass_units!r}\t{s.thickness_ratio!r}\t{s.seed}\n" for s in slurries]
    Path("good.tsv").write_text(HEADER + "".join(rows))
    assert read_slurries("good.tsv") == slurries


# ---- physics of existing results


@pytest.fixture
def run(config):
    """DEM results of the shipped configuration for two of its slurries, as the workflow stores them."""
    for slurry in read_slurries("config/slurries.tsv")[:2]:
        path = Path("results/demo/dem", slurry.id, "run.json")
        path.parent.mkdir(parents=True)
        path.write_text(json.dumps({"physics": physics(config, slurry)}, sort_keys=True))
    return config


def test_unchanged_physics_passes(run):
    assert check(run) == []


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("dem.executable", "/opt/lammps/lmp"),
        ("dem.launcher", "srun"),
        ("dem.ranks", 4),
        ("dem.max_rayleigh_share", 0.5),
        ("dem.max_density_drift", 0.1),
        ("dem.impact_speed_um_us", 0.2),
        ("formulation.expected_density_g_cm3", 2.3),
        ("surrogate.vgg16.epochs", 3),
        ("relaxation.steps", 10),
    ],
)
def test_settings_that_the_dem_does_not_depend_on_may_change(run, path, value):
    assert check(merged(run, nested(path, value))) == []


def test_role_may_change(run):
    table = Path("config/slurries.tsv")
    table.write_text(table.read_text().replace("T1\ttrain", "T1\ttest"))
    assert check(run) == []


@pytest.mark.parametrize(
    ("path", "value", "difference"),
    [
        ("dem.timestep_us", 0.001, "dem.timestep_us = 0.002, the configuration has 0.001"),
        ("dem.segment_frames", 12, "dem.segment_frames = 6, the configuration has 12"),
        ("formulation.unit_mass_pg", 800, "formulation.unit_mass_pg = 773.5, the configuration has 800"),
        ("force_field.granular_hertz.friction", 0, "granular_hertz.friction = 0.015, the configuration has 0"),
        (
            "formulation.phases.BDPD.size_classes",
            [{"diameter_um": 1.2, "number_fraction": 1.0}],
            "BDPD.size_classes[0].diameter_um = 1.1, the configuration has 1.2",
        ),
    ],
)
def test_changed_physics_is_refused_in_one_line(run, path, value, difference):
    changed = merged(run, nested(path, value))
    (line,) = check(changed)
    assert line.startswith("results/demo: the DEM of slurry T1 was run with ") and difference in line
    assert line.endswith(": choose another run.name, or set run.overwrite: true to compute it anew")
    assert "more)" not in line
    assert check(merged(changed, {"run": {"overwrite": True}})) == []
    assert check(merged(changed, {"run": {"name": "other"}})) == []


def test_several_changes_are_counted_in_the_one_line(run):
    changes = {"dem": {"steps": 120000, "skin_um": 0.1}, "force_field": {"granular_hertz": {"friction": 0.1}}}
    (line,) = check(merged(run, changes))
    assert "friction = 0.015, the configuration has 0.1 (and 2 more): choose" in line


@pytest.mark.parametrize(
    ("row", "difference"),
    [
        ("T1\ttrain\t1.5\t1.0\t1001", "slurry.mass_units = 1.0, the configuration has 1.5"),
        ("T1\ttrain\t1\t1.1\t1001", "slurry.thickness_ratio = 1.0, the configuration has 1.1"),
        ("T1\ttrain\t1\t1.0\t1111", "slurry.seed = 1001, the configuration has 1111"),
    ],
)
def test_changed_slurry_row_is_refused(run, row, difference):
    table = Path("config/slurries.tsv")
    table.write_text(table.read_text().replace("T1\ttrain\t1\t1.0\t1001", row))
    (line,) = check(run)
    assert f"the DEM of slurry T1 was run with {difference}: choose" in line


def test_renamed_and_reordered_phases_are_refused(run):
    phases = run["formulation"]["phases"]
    run["formulation"]["phases"] = dict(reversed(phases.items()))
    (line,) = check(run)
    assert 'formulation.order = ["BDPD", "NiO", "8YSZ"], the configuration has ["8YSZ", "NiO", "BDPD"]' in line
    run["analysis"]["rdf_pair"] = ["Ni", "8YSZ"]
    run["formulation"]["phases"] = {"Ni": phases["NiO"], "8YSZ": phases["8YSZ"], "BDPD": phases["BDPD"]}
    (line,) = check(run)
    assert "was run without formulation.phases.Ni.mass_fraction, the configuration has 0.52 (and " in line


@pytest.mark.parametrize("text", ["", "{", "[]", "{}", "null", '{"physics": '])
def test_corrupt_record_of_a_run_is_refused_in_one_line(run, text):
    Path("results/demo/dem/T2/run.json").write_text(text)
    (line,) = check(run)
    assert line.startswith("results/demo/dem/T2/run.json: does not say with which settings it was run: choose another")


def test_changed_physics_reads_the_folder_that_it_is_given(run):
    slurries = read_slurries("config/slurries.tsv")
    run["dem"]["skin_um"] = 0.2
    assert changed_physics(run, slurries, "results/none") == []
    assert len(changed_physics(run, slurries, "results/demo")) == 1
