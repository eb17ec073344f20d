"""The training range: closed forms, recipes that round differently, and the script on small slurries."""

import itertools
import json

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from script_runs import refusal, run_script, written
from slurrycast.analysis.training_range import (
    RATIO_TOLERANCE,
    Range,
    State,
    Value,
    class_slack,
    compare,
    compare_with_training,
    mean_value,
    quantities,
    training_range,
)
from slurrycast.data.frames import Particles
from slurrycast.dem.recipe import particle_counts, particle_types
from slurrycast.runtime.costs import read_cost
from slurrycast.surrogates.trained_on import read_trained_on
from structures import frame, write_store


def phase(density_g_cm3: float, mass_fraction: float, sizes: dict[float, float]) -> dict:
    """A phase of these number fractions by diameter in um."""
    classes = [{"diameter_um": diameter, "number_fraction": fraction} for diameter, fraction in sizes.items()]
    return {"density_g_cm3": density_g_cm3, "mass_fraction": mass_fraction, "size_classes": classes}


PHASES = {"BDPD": phase(0.8, 0.13, {1.1: 1.0}), "NiO": phase(6.67, 0.87, {0.5: 0.2, 0.7: 0.7, 1.3: 0.1})}
EXACT = ("particles", "shortest_edge_um", "longest_edge_um", "density_g_cm3", "density_g_cm3_BDPD", "density_g_cm3_NiO")
OF_ONE_CLASS = ("mean_radius_um_BDPD",)


def recipe(mass_pg: float, phases: dict = PHASES) -> Particles:
    """Particles of a slurry of this mass."""
    types = particle_types(phases)
    counts = particle_counts(types, mass_pg)

    def column(name: str) -> np.ndarray:
        return np.repeat([getattr(t, name) for t in types], counts)

    return Particles(
        id=np.arange(1, counts.sum() + 1),
        type=column("type"),
        phase=column("phase_index"),
        size_class=column("size_class"),
        radius_um=column("diameter_um") / 2,
        mass_pg=column("mass_pg"),
        phase_names=tuple(phases),
    )


def slurry(mass_pg: float, edges_um: tuple = (3.0, 3.0, 6.0), phases: dict = PHASES) -> State:
    types = particle_types(phases)
    density_g_cm3 = float(recipe(mass_pg, phases).mass_pg.sum() / np.prod(edges_um))
    return State(types, particle_counts(types, mass_pg), np.array(edges_um), density_g_cm3)


def test_quantities_are_what_they_say():
    particles, values = recipe(200.0), quantities(slurry(200.0, (3.0, 4.0, 6.0)))
    expected = {
        "particles": len(particles),
        "shortest_edge_um": 3,
        "longest_edge_um": 6,
        "density_g_cm3": particles.mass_pg.sum() / 72,
        "thickness_ratio": 2,
        "fraction_BDPD": (particles.phase == 1).mean(),
        "fraction_NiO": (particles.phase == 2).mean(),
        "mean_radius_um": particles.radius_um.mean(),
        "mean_radius_um_BDPD": 0.55,
        "density_g_cm3_BDPD": 0.8,
        "mean_radius_um_NiO": particles.radius_um[particles.phase == 2].mean(),
        "density_g_cm3_NiO": 6.67,
    }
    assert list(values) == list(expected)
    assert {name: values[name].value for name in values} == pytest.approx(expected, rel=1e-12)
    for name, value in values.items():
        assert (value.low == value.value == value.high) == (name in (*EXACT, *OF_ONE_CLASS))
        assert value.low <= value.value <= value.high


def test_range_of_a_fraction_has_a_closed_form():
    """n of N particles and the other phase, each to half a particle: (n -+ 1/2) / N, whatever the other one does."""
    share = mean_value(np.array([1.0, 0.0]), np.array([30, 70]), np.array([0.5, 0.5]))
    assert (share.value, share.low, share.high) == pytest.approx((0.3, 29.5 / 100, 30.5 / 100))
    # three phases: the other two together may have one particle more or less
    share = mean_value(np.array([0.0, 1.0, 0.0]), np.array([30, 30, 40]), np.full(3, 0.5))
    assert (share.low, share.high) == pytest.approx((29.5 / 100.5, 30.5 / 99.5))


@given(
    st.lists(st.tuples(st.floats(0.1, 3), st.integers(0, 50), st.floats(0, 2)), min_size=1, max_size=5).filter(
        lambda groups: all(count > slack for _, count, slack in groups[:1])
    )
)
def test_range_of_a_mean_is_that_of_all_corners(groups):
    values, counts, slack = (np.array(column, dtype=float) for column in zip(*groups, strict=True))
    ends = zip(np.maximum(counts - slack, 0), counts + slack, strict=True)
    means = [np.dot(corner, values) / np.sum(corner) for corner in itertools.product(*ends)]
    mean = mean_value(values, counts, slack)
    assert (mean.low, mean.high) == pytest.approx((min(means), max(means)), rel=1e-9)


def test_rounding_that_types_allow():
    """One size class takes the rounding of its phase; of k classes each has up to 1 - 1/k of a particle more."""
    np.testing.assert_allclose(class_slack(np.array([1, 2, 2, 3, 3, 3])), [0.5, 1, 1, 7 / 6, 7 / 6, 7 / 6])


@given(st.floats(20, 2000), st.floats(20, 2000))
def test_slurries_of_one_recipe_have_one_composition(mass_pg, training_mass_pg):
    """However their whole particles round it, down to a handful of them; types that are missing in one too."""
    found = compare_with_training(slurry(mass_pg), training_range([slurry(training_mass_pg)]))
    outside = {name for name, values in found.items() if values.outside}
    assert outside <= {"particles", "shortest_edge_um", "longest_edge_um", "density_g_cm3"}


@pytest.mark.parametrize(
    ("binder", "oxide", "outside"),
    [
        ({"mass_fraction": 0.16}, {"mass_fraction": 0.84}, {"fraction_BDPD", "fraction_NiO", "mean_radius_um"}),
        (phase(0.8, 0.13, {1.3: 1.0}), {}, {"fraction_BDPD", "fraction_NiO", "mean_radius_um_BDPD"}),
        ({}, {"density_g_cm3": 6.5}, {"density_g_cm3_NiO"}),
        ({}, phase(6.67, 0.87, {0.5: 0.2, 0.7: 0.5, 1.3: 0.3}), {"mean_radius_um_NiO"}),
    ],
)
def test_another_recipe_is_outside(binder, oxide, outside):
    own = slurry(2000.0, phases={"BDPD": PHASES["BDPD"] | binder, "NiO": PHASES["NiO"] | oxide})
    found = compare_with_training(own, training_range([slurry(2000.0), slurry(1000.0)]))
    assert outside <= {name for name, values in found.items() if values.outside}


def test_a_phase_that_one_side_lacks_is_outside_by_its_fraction():
    more = {**PHASES, "8YSZ": phase(5.96, 0.3, {0.7: 1.0})}
    for own, training, value in ((more, PHASES, 0.0), (PHASES, more, None)):
        found = compare_with_training(slurry(500.0, phases=own), training_range([slurry(500.0, phases=training)]))
        assert found["fraction_8YSZ"].outside and "mean_radius_um_8YSZ" not in found
        assert (found["fraction_8YSZ"].training_max == 0) == (value == 0.0)
    both = training_range([slurry(500.0, phases=phases) for phases in (more, PHASES)])
    found = compare_with_training(slurry(500.0, phases=more), both)
    assert not any(values.outside for values in found.values())
    assert found["fraction_8YSZ"].training_min == 0


def test_exact_quantities_are_outside_by_the_last_digit():
    edge_um = np.nextafter(3.0, 4.0)
    training = [slurry(500.0), slurry(300.0)]
    training = training_range(training)
    assert not any(values.outside for values in compare_with_training(slurry(500.0), training).values())
    found = compare_with_training(slurry(500.0, (3.0, 3.0, np.nextafter(6.0, 7.0))), training)
    assert {name for name, values in found.items() if values.outside} <= {"longest_edge_um", "density_g_cm3"}
    assert found["longest_edge_um"].outside
    assert compare_with_training(slurry(500.0, (edge_um, edge_um, 6.0)), training)["shortest_edge_um"].outside


def test_size_and_shape_outside():
    training = [slurry(300.0), slurry(500.0, (3.0, 3.0, 3.6))]
    found = compare_with_training(slurry(700.0, (3.0, 3.0, 7.5)), training_range(training))
    assert found["particles"].outside
    assert found["particles"].value > found["particles"].training_max > found["particles"].training_min
    assert (found["thickness_ratio"].training_min, found["thickness_ratio"].training_max) == pytest.approx((1.2, 2))
    assert found["thickness_ratio"].outside
    assert found["longest_edge_um"].outside


@pytest.mark.parametrize(("factor", "outside"), [(1 + RATIO_TOLERANCE, False), (1 + 4 * RATIO_TOLERANCE, True)])
def test_rounding_of_the_thickness_ratio(factor, outside):
    found = compare_with_training(slurry(500.0, (3.0, 3.0, 6.0 * factor)), training_range([slurry(500.0)]))
    assert found["thickness_ratio"].outside == outside


def test_ranges_that_touch_are_inside():
    training = Range(training_min=1.0, training_max=2.0, low=0.9, high=2.2)
    for value, outside in (
        (Value(0.85, 0.8, 0.9), False),
        (Value(0.85, 0.8, 0.899), True),
        (Value(1.5, 1.5, 1.5), False),
        (Value(2.3, 2.2, 2.4), False),
        (Value(2.3, 2.21, 2.4), True),
    ):
        found = compare(value, training)
        assert (found.value, found.training_min, found.training_max) == (value.value, 1.0, 2.0)
        assert found.outside == outside


def test_mean_radius_counts_a_type_that_is_missing():
    """One particle in ten would be of the third class: a slurry of two particles has none of it."""
    few = slurry(8.0)
    assert 0 in few.counts
    value = quantities(few)["mean_radius_um"]
    assert value.value == pytest.approx(recipe(8.0).radius_um.mean())
    assert value.low < value.value < value.high


def physics_of(phases: dict = PHASES) -> str:
    """Physics of a slurry, as its frame store keeps it."""
    return json.dumps({"formulation": {"phases": phases, "order": list(phases)}, "force_field": {"friction": 0.1}})


@pytest.fixture
def frames_of(tmp_path):
    """Write frame 10 of a slurry."""

    def write(name: str, mass_pg: float, edges_um: tuple = (3.0, 3.0, 6.0), phases: dict = PHASES, number: int = 10):
        particles = recipe(mass_pg, phases)
        frames = [frame(number, np.zeros((len(particles), 3)), np.array(edges_um))]
        return write_store(tmp_path / f"{name}.h5", frames, particles, slurry=name, physics=physics_of(phases))

    return write


@pytest.fixture
def outputs(tmp_path) -> dict:
    """Options for what the script writes."""
    return {"table": tmp_path / "training_range.csv", "cost": tmp_path / "cost.json"}


def test_script_writes_the_table(frames_of, outputs):
    training = [frames_of("T1", 300.0), frames_of("T2", 500.0, (3.0, 3.0, 7.0))]
    predicted = [frames_of("V1", 300.0), frames_of("007", 700.0, (3.0, 3.0, 6.5))]
    options = {"training": training, "predicted": predicted, "roles": ["validation", "test"], "last_input_frame": 10}
    rows = written("check_training_range", **options, **outputs)
    said = run_script("check_training_range", **options, **outputs).stdout
    assert said == "[007] outside the training range: particles, density_g_cm3\n"
    columns = ["slurry", "role", "model", "quantity", "value", "training_min", "training_max", "outside"]
    assert list(rows.columns) == columns
    assert list(zip(rows.slurry, rows.role, strict=True)) == [("V1", "validation")] * 12 + [("007", "test")] * 12
    assert set(rows.model) == {"this run"}
    assert set(rows.outside[rows.slurry == "V1"]) == {"no"}
    own = rows[rows.slurry == "007"].set_index("quantity")
    assert set(own.index[own.outside == "yes"]) == {"particles", "density_g_cm3"}
    counts = [len(recipe(mass_pg)) for mass_pg in (700.0, 300.0, 500.0)]
    assert own.loc["particles", ["value", "training_min", "training_max"]].tolist() == counts
    assert own.loc["longest_edge_um", ["value", "training_min", "training_max"]].tolist() == [6.5, 6, 7]
    assert read_cost(outputs["cost"]).stage == "check_training_range"


def test_densities_of_earlier_frames_belong_to_the_range():
    training = [slurry(500.0), slurry(500.0, (3.0, 3.0, 5.5))]
    looser = slurry(500.0, (3.0, 3.0, 6.6))
    assert compare_with_training(looser, training_range(training))["density_g_cm3"].outside
    least = looser.density_g_cm3 * 0.99
    found = compare_with_training(looser, training_range(training, [least, training[0].density_g_cm3]))["density_g_cm3"]
    assert (found.outside, found.training_min, found.training_max) == (False, least, training[1].density_g_cm3)
    assert compare_with_training(looser, training_range(training, [least]))["longest_edge_um"].outside  # nothing else


def test_script_reads_the_densities_of_earlier_frames(tmp_path, outputs):
    """Of a slurry that gets denser from frame 8 to 10; the other one is at frame 10 as dense as that at 9."""
    nowhere_um = np.zeros((len(recipe(300.0)), 3))
    for name, numbers in (("T1", (8, 9, 10)), ("2", (10,))):
        frames = []
        for number in numbers:
            edges_um = np.array([3.0, 3.0, {8: 6.4, 9: 6.2, 10: 6.0 if name == "T1" else 6.2}[number]])
            frames.append(frame(number, nowhere_um, edges_um))
        write_store(tmp_path / f"{name}.h5", frames, recipe(300.0), slurry=name, physics=physics_of())
    options = {"training": tmp_path / "T1.h5", "predicted": tmp_path / "2.h5", "roles": "test", "last_input_frame": 10}
    for first, outside in ((8, "no"), (9, "no"), (10, "yes")):
        rows = written("check_training_range", **options, **outputs, first_frame_seen=first).set_index("quantity")
        assert rows.outside["density_g_cm3"] == outside
    done = run_script("check_training_range", **options, **outputs, first_frame_seen=11)
    assert done.returncode == 2
    assert done.stderr == "error: --first-frame-seen 11: must be from 0 to --last-input-frame 10\n"


def test_script_refuses_what_does_not_fit(frames_of, outputs, tmp_path):
    options = {"training": frames_of("T1", 300.0), "last_input_frame": 10, **outputs}
    other = write_store(tmp_path / "1.h5", [frame(10, np.zeros((2, 3)), np.ones(3))], slurry="1")
    late = frames_of("2", 300.0, number=11)
    for path, said in (
        (other, "does not say which recipe the slurry is of"),
        (late, "frame 10 is not in the file, which holds frames 11 to 11"),
    ):
        assert refusal("check_training_range", predicted=path, roles="test", **options) == f"error: {path}: {said}\n"
    said = run_script("check_training_range", predicted=late, roles=["test", "new"], **options).stderr
    assert said.endswith("1 --predicted but 2 --roles: one each is needed\n")


def test_table_reads_back_as_it_was_compared(frames_of, outputs):
    """9 digits in the table do not decide what is outside: the numbers are compared before."""
    path = frames_of("T1", 300.0)
    options = {"training": path, "predicted": path, "roles": "new", "last_input_frame": 10}
    rows = written("check_training_range", **options, **outputs)
    assert set(rows.outside) == {"no"}
    pd.testing.assert_series_equal(rows.value, rows.training_min, check_names=False)


def test_a_model_carries_its_range_to_another_run(frames_of, outputs, tmp_path):
    """As if the training slurries were there, and a slurry outside is said."""
    model = tmp_path / "model.keras"
    model.write_bytes(b"weights")
    training = [frames_of("T1", 300.0), frames_of("T2", 500.0, phases={**PHASES, "8YSZ": phase(5.96, 0.3, {0.7: 1.0})})]
    described = tmp_path / "trained_on.json"
    options = {"model": model, "frames": training, "input_frames": [9, 10], "target_frame": 120, "first_frame_seen": 10}
    options |= {"phases": ["BDPD", "NiO", "8YSZ"]}
    done = run_script("describe_model", surrogate="vgg16", **options, trained_on=described)
    assert done.returncode == 0, done.stderr
    known = read_trained_on(described)
    assert [list(recipe["phases"]) for recipe in known["recipes"]] == [["BDPD", "NiO"], ["BDPD", "NiO", "8YSZ"]]
    assert (known["slurries"], known["input_frames"], known["surrogate"]) == (["T1", "T2"], [9, 10], "vgg16")
    assert known["phases"] == options["phases"]
    assert "started_from" not in known
    further = tmp_path / "further.json"
    for frames, start in ((training[1], {"start_from": model}), (training, {})):  # the model is of both
        options = {"model": model, "input_frames": [9, 10], "target_frame": 120, "first_frame_seen": 10}
        options |= {"phases": known["phases"], "frames": frames, "trained_on": further}
        assert run_script("describe_model", surrogate="vgg16", **options, **start).returncode == 0
        tuned = read_trained_on(further)
        assert (tuned["recipes"], tuned["range"]) == (known["recipes"], known["range"])
        start = {"model_sha256": known["model_sha256"], "recipes": known["recipes"]} if start else None
        assert tuned.get("started_from") == start
    asked = {"predicted": [frames_of("6", 900.0)], "roles": "test", "last_input_frame": 10, **outputs}
    here = written("check_training_range", training=training, **asked)
    there = written("check_training_range", models=f"vgg16={described}", **asked)
    assert set(there.model) == {"vgg16"} and set(there.outside) == {"yes", "no"}
    pd.testing.assert_frame_equal(here.drop(columns="model"), there.drop(columns="model"))
    said = run_script("check_training_range", models=f"vgg16={described}", **asked).stdout
    assert said == "[6] outside the training range of vgg16: particles, density_g_cm3\n"
    denser = tmp_path / "7.h5"  # as the training slurries at the last frame of the model, which this run goes beyond
    frames = [frame(k, np.zeros((len(recipe(300.0)), 3)), np.full(3, edge_um)) for k, edge_um in ((10, 6.0), (18, 3.0))]
    write_store(denser, frames, recipe(300.0), slurry="7", physics=physics_of())
    later = {"predicted": denser, "roles": "test", "last_input_frame": 18}
    rows = written("check_training_range", models=f"vgg16={described}", **asked | later).set_index("quantity")
    assert rows.value["longest_edge_um"] == 6.0
    described.write_text(json.dumps(known | {"input_frames": [17, 18]}))
    described.with_name(".checksums").joinpath("trained_on.json.sha256").unlink()
    models = {"models": f"vgg16={described}", **asked}
    assert written("check_training_range", **models | {"roles": "new"}).empty
    assert "frame 18 is not in the file" in run_script("check_training_range", **models).stderr
    described.write_text("{}")
    assert written("check_training_range", models=f"vgg16={described}", **asked).empty
    assert "vgg16: the model does not say what it was trained on" in (
        run_script("check_training_range", models=f"vgg16={described}", **asked).stdout
    )
