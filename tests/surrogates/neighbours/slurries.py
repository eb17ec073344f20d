"""Slurries of random particles, and what the network makes of them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import tensorflow as tf

import structures
from slurrycast.data.frames import Frame, Particles
from slurrycast.data.trajectories import Trajectory
from slurrycast.surrogates.neighbours import Neighbours
from slurrycast.surrogates.neighbours.network import build
from slurrycast.surrogates.prediction import PredictionInput

SETTINGS = {
    "members": 2,
    "epochs": 3,
    "learning_rate": 5e-2,
    "weight_decay": 1e-2,
    "layers": 2,
    "width": 8,
    "vectors": 4,
    "cutoff_diameters": 2.0,
    "earlier_frames": 1,
    "intermediate_targets": [0.08],  # at the next frame
    "input_frames": [8, 9, 10],
    "target_frame": 120,
    "threads": 1,
    "seed": 5,
}
EDGES_UM = np.array([4.2, 4.2, 6.3])
SHRINKAGE = (1.3, 1.25, 1.22)  # of the edges at three input frames
PHASES = ("BDPD", "NiO", "8YSZ")
SHAPE = {"n_scalars": 11, "n_past": 2, "shares": [0.5, 1.0], "width": 8, "n_vectors": 4, "cutoff": 2.0}


def slurry(n=60, seed=0) -> tuple[np.ndarray, np.ndarray]:
    """Features (n, 3, 6) of particles that drift while their box shrinks, and edges (3, 3)."""
    rng = np.random.default_rng(seed)
    scaled = rng.uniform(-0.5, 0.5, (n, 3)) + np.cumsum(rng.normal(0, 0.01, (3, n, 3)), axis=0)
    edges_um = np.array(SHRINKAGE)[:, None] * EDGES_UM
    static = np.column_stack([rng.integers(1, 4, n), rng.uniform(0.25, 0.55, n)])
    frames = [
        np.column_stack([static, place * edge_um, rng.integers(0, 9, n)])
        for place, edge_um in zip(scaled, edges_um, strict=True)
    ]
    return np.stack(frames, axis=1), edges_um


def particles_of(history: np.ndarray) -> Particles:
    return structures.particles(history[:, 0, 0].astype(int), history[:, 0, 1], PHASES, mass_pg=1.0)


def frame(number: int, place_um: np.ndarray, contacts: np.ndarray, edges_um: np.ndarray) -> Frame:
    at_rest = structures.frame(number, place_um, edges_um, step=500 * number)
    return replace(at_rest, coordination=contacts.astype(int))


def frames_of(history: np.ndarray, edges_um: np.ndarray, first: int = 8) -> tuple[Frame, ...]:
    return tuple(frame(first + k, history[:, k, 2:5], history[:, k, 5], edges_um[k]) for k in range(history.shape[1]))


def trajectory(name: str, seed: int) -> Trajectory:
    """A slurry whose particles drift for five frames, and then go back to where they came from, and farther."""
    rng = np.random.default_rng(seed)
    drift = rng.normal(0, 0.01, (60, 1, 3)) * np.arange(5)[:, None]
    scaled = rng.uniform(-0.5, 0.5, (60, 1, 3)) + drift
    edges_um = np.array([1.35, *SHRINKAGE, 1.2])[:, None] * EDGES_UM
    static = np.broadcast_to(
        np.column_stack([rng.integers(1, 4, 60), rng.uniform(0.25, 0.55, 60)])[:, None], (60, 5, 2)
    )
    history = np.concatenate([static, scaled * edges_um, rng.integers(0, 9, (60, 5, 1))], axis=2)
    end = frame(120, (scaled[:, 0] - drift[:, -1]) * EDGES_UM, history[:, 0, 5], EDGES_UM)
    frames = {f.number: f for f in (*frames_of(history, edges_um, 7), end)}
    known_um = {k: frames[k].edges_um if k in frames else EDGES_UM for k in range(7, 121)}
    return Trajectory(name, particles_of(history), frames, known_um)


def train(settings: dict, folder: Path, validation=("V1",), compiled=False) -> dict[str, float]:
    """Train on two slurries; for so few steps compiling them takes longest, so it is left out unless asked for."""
    slurries = [trajectory(name, seed) for seed, name in enumerate(("T1", "T2"), start=1)]
    tf.config.run_functions_eagerly(not compiled)
    try:
        return Neighbours().train((slurries, [trajectory(name, 3) for name in validation]), settings, folder)
    finally:
        tf.config.run_functions_eagerly(False)


def prediction_input(
    history: np.ndarray, edges_um: np.ndarray, final_edges_um: np.ndarray = EDGES_UM
) -> PredictionInput:
    return PredictionInput("1", particles_of(history), frames_of(history, edges_um), final_edges_um)


def answer(model, *asked, **settings):
    prediction = Neighbours().predict(prediction_input(*asked), model, {**SETTINGS, **settings})
    return prediction.position_um, prediction.spread_um


def random_network():
    """A network of three layers whose weights say something."""
    network = build(**{**SHAPE, "shares": [0.5, 0.8, 1.0]}, name="net")
    for weights in network.weights:
        weights.assign(np.random.default_rng(0).normal(0, 0.3, weights.shape))
    return network
