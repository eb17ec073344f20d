"""The training set: particles of the training slurries with their input frames and their target, as one HDF5 file.

    features        (n, frames, features), float64; lengths in um, coordinates unwrapped
    targets         (n, 3), float64; unwrapped x, y, z in um at the target frame
    slurry_index    (n,), place of the particle's slurry in the attribute `slurries`
    particle_id     (n,), id within that slurry
    is_validation   (n,), bool
    input_edges_um  (slurries, frames, 3), box edges of each slurry at its input frames
    target_edges_um (slurries, 3), box edges at the target frame

Boxes are centred at the origin, so coordinates over edges are scaled coordinates about the box centre.
Attributes: feature_names, slurries, input_frames, target_frame, seed (of the split).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from slurrycast.data.features import COORDINATES, FEATURE_NAMES, particle_history
from slurrycast.data.frames import read_frames
from slurrycast.runtime.files import InputError, check_unchanged, hdf5_moved_into_place

_SAMPLE_ARRAYS = ("features", "targets", "slurry_index", "particle_id", "is_validation")
_SLURRY_ARRAYS = ("input_edges_um", "target_edges_um")
_IN_UM = ("targets", *_SLURRY_ARRAYS)


@dataclass(frozen=True)
class TrainingSet:
    """Samples for learning, one a particle; see the module for shapes and units."""

    features: np.ndarray
    targets: np.ndarray
    slurry_index: np.ndarray
    slurries: tuple[str, ...]
    particle_id: np.ndarray
    is_validation: np.ndarray
    feature_names: tuple[str, ...]
    input_frames: tuple[int, ...]
    target_frame: int
    input_edges_um: np.ndarray
    target_edges_um: np.ndarray

    def __len__(self) -> int:
        return len(self.features)

    def affine_um(self) -> np.ndarray:
        """Places (n, 3) in um at the last input frame, scaled into the box of the slurry at the target frame."""
        scale = self.target_edges_um / self.input_edges_um[:, -1]
        return self.features[:, -1, COORDINATES] * scale[self.slurry_index]


def split(n: int, share: float, seed: int) -> np.ndarray:
    """Draw the validation samples.

    Parameters
    ----------
    n, share
        Number of samples, and the share of them to draw, 0 to 1; the number drawn is rounded.
    seed
        The same samples are drawn for the same seed.

    Returns
    -------
    Mask (n,), True for the samples drawn.

    Raises
    ------
    InputError
        Unless both parts get at least one sample.
    """
    drawn = round(share * n)
    if not 0 < drawn < n:
        raise InputError(f"validation_share: {share} of {n} samples leaves training or validation empty")
    mask = np.zeros(n, dtype=bool)
    mask[np.random.default_rng(seed).permutation(n)[:drawn]] = True
    return mask


def assemble(
    paths: Sequence[str | Path],
    phases: Sequence[str],
    input_frames: Sequence[int],
    target_frame: int,
    validation_share: float,
    seed: int,
) -> TrainingSet:
    """Collect the particles of slurries with their input frames and their target.

    Parameters
    ----------
    paths
        Frame stores of the slurries.
    phases
        Names of the phases of all slurries, in the order of their numbers.
    input_frames, target_frame
        Numbers of the frames.
    validation_share, seed
        Of the validation samples, see `split`.

    Raises
    ------
    InputError
        If a frame is missing, a slurry has another phase, or one part of the split is empty.
    """
    features, targets, ids, names, input_edges_um, target_edges_um = [], [], [], [], [], []
    for path in paths:
        with read_frames(path) as store:
            frames = [store.frame(k) for k in input_frames]
            features.append(particle_history(store.particles_of(phases), frames))
            input_edges_um.append([frame.edges_um for frame in frames])
            target_edges_um.append(store.box(target_frame)[1])
            targets.append(store.position_um(target_frame))
            ids.append(store.particles.id)
            names.append(str(store.attributes["slurry"]))
    return TrainingSet(
        features=np.concatenate(features),
        targets=np.concatenate(targets),
        slurry_index=np.repeat(np.arange(len(ids)), [len(i) for i in ids]),
        slurries=tuple(names),
        particle_id=np.concatenate(ids),
        is_validation=split(sum(map(len, ids)), validation_share, seed),
        feature_names=FEATURE_NAMES,
        input_frames=tuple(input_frames),
        target_frame=target_frame,
        input_edges_um=np.array(input_edges_um),
        target_edges_um=np.array(target_edges_um),
    )


def _check(path: str | Path, data: TrainingSet) -> None:
    n = len(data)
    shapes = {
        "features": (n, len(data.input_frames), len(data.feature_names)),
        "targets": (n, 3),
        **dict.fromkeys(_SAMPLE_ARRAYS[2:], (n,)),
        "input_edges_um": (len(data.slurries), len(data.input_frames), 3),
        "target_edges_um": (len(data.slurries), 3),
    }
    for name, shape in shapes.items():
        if getattr(data, name).shape != shape:
            raise InputError(f"{path}: {name} has shape {getattr(data, name).shape}, expected {shape}")
    for name in ("features", "targets"):
        bad = np.argwhere(~np.isfinite(getattr(data, name)))
        if len(bad):
            raise InputError(
                f"{path}: {name} must be finite, {len(bad)} values are not, the first in sample {bad[0][0]}"
            )
    for name in _SLURRY_ARRAYS:
        if not (getattr(data, name) > 0).all() or not np.isfinite(getattr(data, name)).all():
            raise InputError(f"{path}: {name} must be finite and above 0")
    if data.is_validation.dtype != bool or data.is_validation.all() or not data.is_validation.any():
        raise InputError(f"{path}: is_validation must be true for some samples and false for others")
    if data.slurry_index.min() < 0 or data.slurry_index.max() >= len(data.slurries):
        raise InputError(f"{path}: slurry_index must be 0 to {len(data.slurries) - 1}")


def write_training_set(path: str | Path, data: TrainingSet, seed: int) -> None:
    """Write `data`, compressed; `seed` is that of the split. InputError for wrong shapes or non-finite values."""
    _check(path, data)
    with hdf5_moved_into_place(path) as file:
        for name in _SAMPLE_ARRAYS + _SLURRY_ARRAYS:
            file.create_dataset(name, data=getattr(data, name), compression="gzip", shuffle=True)
        for name in _IN_UM:
            file[name].attrs["unit"] = "um"
        for name in ("feature_names", "slurries", "input_frames", "target_frame"):
            file.attrs[name] = getattr(data, name)
        file.attrs["seed"] = seed


def read_training_set(path: str | Path) -> TrainingSet:
    """Read what `write_training_set` wrote. InputError for another or a changed file, or data that it would refuse."""
    check_unchanged(path)  # the HDF5 library may hang on a damaged file
    try:
        with h5py.File(path) as file:
            data = TrainingSet(
                **{name: file[name][:] for name in _SAMPLE_ARRAYS + _SLURRY_ARRAYS},
                slurries=tuple(str(name) for name in file.attrs["slurries"]),
                feature_names=tuple(str(name) for name in file.attrs["feature_names"]),
                input_frames=tuple(int(frame) for frame in file.attrs["input_frames"]),
                target_frame=int(file.attrs["target_frame"]),
            )
        _check(path, data)
    except InputError:
        raise
    except (OSError, KeyError, AttributeError, TypeError, ValueError, RuntimeError) as error:
        raise InputError(f"{path}: not a readable training set ({' '.join(str(error).split())})") from error
    return data
