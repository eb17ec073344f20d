"""Training sets of one slurry for tests."""

import numpy as np

from slurrycast.data.dataset import TrainingSet, split
from slurrycast.data.features import FEATURE_NAMES


def one_slurry(
    features: np.ndarray, targets: np.ndarray, edges_um: np.ndarray, final_edges_um: np.ndarray, share: float = 0.2
) -> TrainingSet:
    """Samples (n, frames, 6) and targets (n, 3) of a slurry T1 with edges (frames, 3) and final ones (3,)."""
    n, n_frames, _ = features.shape
    return TrainingSet(
        features=features,
        targets=targets,
        slurry_index=np.zeros(n, dtype=int),
        slurries=("T1",),
        particle_id=np.arange(n),
        is_validation=split(n, share, seed=1),
        feature_names=FEATURE_NAMES,
        input_frames=tuple(range(11 - n_frames, 11)),
        target_frame=120,
        input_edges_um=edges_um[None],
        target_edges_um=final_edges_um[None],
    )
