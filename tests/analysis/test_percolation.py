"""Clusters without an end: constructed chains, and copies of the box put side by side."""

import numpy as np
import pytest

from slurrycast.analysis.percolation import percolating_shares
from slurrycast.analysis.structure import find_contacts

EDGES_UM = np.array([8.0, 6.0, 10.0])
LOWER_UM = -EDGES_UM / 2


def chain(*corners: tuple[float, float, float]) -> np.ndarray:
    """Places (n, 3) at most 0.9 apart on straight lines from corner to corner, without the last one."""
    legs = []
    for start, end in zip(np.array(corners[:-1], dtype=float), np.array(corners[1:], dtype=float), strict=True):
        steps = int(np.ceil(np.linalg.norm(end - start) / 0.9))
        legs.append(start + np.arange(steps)[:, None] / steps * (end - start))
    return np.concatenate(legs)


def shares(position_um: np.ndarray, chosen: np.ndarray | None = None) -> list[float]:
    """Percolating shares of spheres of radius 0.5 um, whose images do not matter."""
    images = np.random.default_rng(2).integers(-3, 4, position_um.shape) * EDGES_UM
    contacts = find_contacts(position_um + images, LOWER_UM, EDGES_UM, np.full(len(position_um), 0.5))
    chosen = np.ones(len(position_um), dtype=bool) if chosen is None else chosen
    return percolating_shares(position_um + images, EDGES_UM, contacts, chosen).tolist()


@pytest.mark.parametrize(
    ("corners", "spanned"),
    [
        ([(0, 0, 0), (0, 0, 10)], [0, 0, 1]),
        ([(0, 0, 0), (8, 0, 0)], [1, 0, 0]),
        ([(0, 0, 0), (2, 0, 5), (0, 0, 10)], [0, 0, 1]),
        # Through the upper face it comes back half a period aside, and meets itself after winding twice.
        ([(0, 0, 0), (4, 0, 10), (8, 0, 20)], [1, 0, 1]),
        ([(0, 0, 0), (4, 0, 10), (0, 0, 20)], [0, 0, 1]),
        # There and back through the upper face.
        ([(0, 0, 3), (0, 0, 7), (2, 0, 7), (2, 0, 3), (0, 0, 3)], [0, 0, 0]),
        ([(0, 0, 0), (0, 0, 8.5)], [0, 0, 0]),
    ],
)
def test_a_chain_spans_the_axes_along_which_it_has_no_end(corners, spanned):
    assert shares(chain(*corners)) == spanned
    alone = np.array([[-3.0, 2, 0]])
    n = len(chain(*corners))
    assert shares(np.concatenate([alone, chain(*corners)])) == pytest.approx(np.array(spanned) * n / (n + 1))


def test_only_contacts_among_the_chosen_connect():
    column = chain((0, 0, 0), (0, 0, 10))
    chosen = np.arange(len(column)) != 4
    assert shares(column, chosen) == [0, 0, 0]
    assert np.isnan(shares(column, np.zeros(len(column), dtype=bool))).all()


def shares_of_copies(position_um: np.ndarray, radius_um: float, axis: int, copies: int = 5) -> float:
    """Share of the spheres that are connected with another copy of themselves, in a box of so many periods."""
    n = len(position_um)
    shift = np.zeros((copies, 1, 3))
    shift[:, 0, axis] = np.arange(copies) * EDGES_UM[axis]
    many, edges = (position_um + shift).reshape(-1, 3), EDGES_UM.copy()
    edges[axis] *= copies
    difference = many[:, None] - many
    difference -= edges * np.round(difference / edges)
    touching = np.linalg.norm(difference, axis=2) < 2 * radius_um
    label = np.arange(len(many))
    while True:
        lowest = np.where(touching, label, len(label)).min(axis=1)  # of all that a sphere touches, itself included
        if np.array_equal(lowest, label):
            break
        label = lowest
    label = label.reshape(copies, n)
    return float(np.mean((label[1:] == label[0]).any(axis=0)))


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("radius_um", [0.62, 0.7])  # about the threshold
def test_shares_are_those_of_copies_side_by_side(seed, radius_um):
    position_um = LOWER_UM + np.random.default_rng(seed).random((150, 3)) * EDGES_UM
    contacts = find_contacts(position_um, LOWER_UM, EDGES_UM, np.full(150, radius_um))
    found = percolating_shares(position_um, EDGES_UM, contacts, np.ones(150, dtype=bool))
    assert found.tolist() == [shares_of_copies(position_um, radius_um, axis) for axis in range(3)]
