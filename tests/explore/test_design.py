"""Designs: their bounds and sums, that they fill the ranges evenly, and that they are repeatable."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from configurations import load
from script_runs import run_script
from slurrycast.explore.design import DIGITS, design, farthest
from slurrycast.explore.inputs import InputSpace, bounded_shares

RANGES = load("explore")["explore"]["ranges"]
ROUNDING = 1.01 * 10**-DIGITS


@st.composite
def spaces(draw) -> InputSpace:
    """Two to five mass fractions about some composition, and up to two other inputs."""
    n = draw(st.integers(2, 5))
    parts = np.array(draw(st.lists(st.floats(0.1, 1), min_size=n, max_size=n)))
    total = draw(st.sampled_from([1.0, 0.8]))
    shares = parts / parts.sum() * total
    down, up = (np.array(draw(st.lists(st.floats(0.05, 0.5), min_size=n, max_size=n))) for _ in range(2))
    ends = zip(shares * (1 - down), shares * (1 + up), strict=True)
    ranges = {f"mass_fraction_{name}": pair for name, pair in zip("ABCDE", ends, strict=False)}
    ranges |= dict.fromkeys(draw(st.sets(st.sampled_from(["size_factor_A", "solvent_mass_fraction"]))), (0.2, 0.7))
    return InputSpace.of_ranges(ranges, total)


@settings(max_examples=30, deadline=None)
@given(spaces(), st.integers(3, 40), st.integers(1, 1000))
def test_designs_keep_ranges_and_sums_and_begin_with_smaller_ones(space, points, seed):
    table = design(space, points, 2, 3, seed)
    values = table[list(space.names)].to_numpy()
    assert (values >= space.lower - ROUNDING * len(values[0])).all()
    assert (values <= space.upper + ROUNDING * len(values[0])).all()
    assert np.allclose(values[:, space.shares].sum(axis=1), space.share_total, atol=1e-9)
    assert table.id.is_unique and list(table.confirm).count("yes") == 3
    assert table.equals(design(space, points, 2, 3, seed))
    half = design(space, points // 2, 0, 0, seed)
    assert table.drop(columns="confirm")[: points // 2].equals(half.drop(columns="confirm"))


def test_shares_are_uniform_on_the_bounded_simplex():
    """As those of uniform triples whose fourth share is what is left, where that is within its bounds too."""
    lower, upper = np.array([[0.05, 0.4, 0.25, 0.05], [0.2, 0.65, 0.45, 0.1]])
    rng = np.random.default_rng(1)
    tried = rng.uniform(lower, upper, (200_000, 4))
    tried[:, 3] = 1 - tried[:, :3].sum(axis=1)
    accepted = tried[(tried[:, 3] >= lower[3]) & (tried[:, 3] <= upper[3])]
    found = bounded_shares(rng.random((len(accepted), 3)), lower, upper, 1.0)
    for level in (0.1, 0.5, 0.9):
        assert np.quantile(found, level, axis=0) == pytest.approx(np.quantile(accepted, level, axis=0), abs=1e-3)
    assert np.cov(found.T) == pytest.approx(np.cov(accepted.T), abs=3e-5)


def test_points_fill_every_input_evenly():
    """The shipped ranges: one of 64 points in each 64th of a size factor, whose distribution is uniform."""
    space = InputSpace.of_ranges(RANGES, 1.0)
    table = design(space, 64, 0, 0, 7)
    share = (table.size_factor_NiO - RANGES["size_factor_NiO"][0]) / np.diff(RANGES["size_factor_NiO"])
    assert sorted((share * 64).astype(int)) == list(range(64))
    assert len(space.names) >= 5


def test_confirmed_recipes_are_far_from_the_centre_and_from_each_other():
    corners = np.array([[0.5, 0.5], [0.0, 0.1], [1.0, 1.0], [0.95, 1.0], [1.0, 0.0]])
    assert farthest(corners, np.array([0.5, 0.5]), 3) == [2, 4, 1]


def test_the_same_seed_gives_the_same_file(tmp_path):
    options = {"ranges": json.dumps(RANGES), "share_total": 1.0, "points": 8, "replicas": 2, "confirmations": 1}
    files = [tmp_path / f"{name}.csv" for name in "abc"]
    for path, seed in zip(files, (1, 1, 2), strict=True):
        done = run_script("write_design", **options, seed=seed, table=path)
        assert done.returncode == 0, done.stderr
    same, again, other = (path.read_text() for path in files)
    assert same == again != other
    assert same.splitlines()[0] == "id,confirm," + ",".join(RANGES)
