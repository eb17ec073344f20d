"""The frame store: particles and frames of one slurry as an H5MD file, and the only code that knows its layout.

H5MD 1.1 (de Buyl, Colberg & Höfling, Comput. Phys. Commun. 185, 1546 (2014)) with one particle group, `slurry`:

    particles/slurry/position/{value, step, time}              unwrapped coordinates (frames, n, 3), um
    particles/slurry/scaled_position/{value, step, time}       the same in box edges, from the lower corner
    particles/slurry/coordination/{value, step, time}          contacts of each particle, (frames, n)
    particles/slurry/position_spread/{value, step, time}       only of predictions with an uncertainty: standard
                                                               deviation of each coordinate (frames, n, 3), um
    particles/slurry/box/edges/{value, step, time}             (frames, 3), um
    particles/slurry/box/lower/{value, step, time}             lower corner, (frames, 3), um; H5MD has no place for it
    particles/slurry/{id, type, species, size_class, radius, mass}      (n,); species is the phase
    parameters/frame_numbers                                   (frames,)

Every array has its unit as attribute `units`. H5MD calls it `unit`, but MDAnalysis refuses to read a file with a `unit`
that it does not know, and it knows neither um nor us. Attributes of `parameters` hold where the frames come from.
"""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from slurrycast.runtime.files import InputError, check_unchanged, hdf5_moved_into_place

GROUP = "particles/slurry"
# What h5py and numpy raise for an HDF5 file of another layout: a name that is missing, a group in place of an array,
# text in place of numbers.
NOT_AS_EXPECTED = (OSError, KeyError, AttributeError, TypeError, ValueError, RuntimeError)


@dataclass(frozen=True)
class Particles:
    """The properties of n particles that do not change with time: arrays (n,), sorted by id.

    `phase` counts from 1 in the order of `phase_names`, `size_class` from 1 within a phase, `type` is the LAMMPS atom
    type (one per phase and size class).
    """

    id: np.ndarray
    type: np.ndarray
    phase: np.ndarray
    size_class: np.ndarray
    radius_um: np.ndarray
    mass_pg: np.ndarray
    phase_names: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.id)

    def in_phase(self, name: str) -> np.ndarray:
        """Mask (n,) of the particles of phase `name`."""
        return self.phase == self.phase_names.index(name) + 1


@dataclass(frozen=True)
class Frame:
    """One instant: unwrapped `position_um` (n, 3), `scaled_position` (n, 3), `coordination` (n,) and the box.

    `position_spread_um` (n, 3) is only there for a prediction that states its uncertainty.
    """

    number: int
    step: int
    time_us: float
    position_um: np.ndarray
    scaled_position: np.ndarray
    coordination: np.ndarray
    lower_um: np.ndarray
    edges_um: np.ndarray
    position_spread_um: np.ndarray | None = None


class FrameStore:
    """Frames of one slurry, read from the file one at a time; `k` is always a frame number of the run (0 to 120)."""

    def __init__(self, path: Path, file: h5py.File) -> None:
        self.path = path
        group = file[GROUP]
        self._file, self._group = file, group
        self.attributes = {name: value for name, value in file["parameters"].attrs.items() if name != "phases"}
        self.particles = Particles(
            *(group[name][:] for name in ("id", "type", "species", "size_class", "radius", "mass")),
            phase_names=tuple(str(name) for name in file["parameters"].attrs["phases"]),
        )
        self.frame_numbers = file["parameters/frame_numbers"][:]
        self.steps = group["position/step"][:]
        self.times_us = group["position/time"][:]
        self._check()
        self._row = {int(number): row for row, number in enumerate(self.frame_numbers)}

    def _check(self) -> None:
        """Refuse arrays whose shapes or kinds do not belong together; ValueError says which."""
        n, frames = len(self.particles.id), len(self.frame_numbers)
        shapes = {name: (n,) for name, _, _ in _STATIC}
        shapes |= dict.fromkeys(("frame_numbers", "position/step", "position/time"), (frames,))
        for name, _, _ in _TIME_DEPENDENT:
            if name not in _OPTIONAL or name in self._group:
                frame_shape = (3,) if name.startswith("box/") else (n,) if name == "coordination" else (n, 3)
                shapes[f"{name}/value"] = (frames, *frame_shape)
        for name, shape in shapes.items():
            array = self.frame_numbers if name == "frame_numbers" else self._group[name]
            if array.shape != shape or array.dtype.kind not in "iuf" or not n or not frames:
                raise ValueError(f"{name} holds {array.dtype} of shape {array.shape}, expected are numbers of {shape}")

    def particles_of(self, phases: Sequence[str]) -> Particles:
        """Its particles with the numbers of `phases`, which may be more than theirs, in the order of these names.

        What learns from slurries of several recipes needs one number for one phase. InputError for a phase that is not
        among them.
        """
        own = self.particles.phase_names
        unknown = [name for name in own if name not in phases]
        if unknown:
            raise InputError(f"{self.path}: phase {unknown[0]}: must be one of {', '.join(phases)}")
        numbers = np.array([phases.index(name) + 1 for name in own])
        return dataclasses.replace(self.particles, phase=numbers[self.particles.phase - 1], phase_names=tuple(phases))

    @property
    def last(self) -> int:
        """Number of the last frame."""
        return int(self.frame_numbers[-1])

    def _at(self, name: str, k: int) -> np.ndarray:
        if k not in self._row:
            held = f"{self.frame_numbers[0]} to {self.last}"
            raise InputError(f"{self.path}: frame {k} is not in the file, which holds frames {held}")
        return self._values(name, self._row[k])

    def _values(self, name: str, rows: int | slice) -> np.ndarray:
        try:
            return self._group[f"{name}/value"][rows]
        except NOT_AS_EXPECTED as error:
            raise _unreadable(self.path, error) from error

    def position_um(self, k: int) -> np.ndarray:
        """Unwrapped coordinates (n, 3) in um at frame `k`, in the box of that frame."""
        return self._at("position", k)

    def scaled_position(self, k: int) -> np.ndarray:
        """Unwrapped coordinates (n, 3) at frame `k` in units of the box edges, from the lower corner."""
        return self._at("scaled_position", k)

    def coordination(self, k: int) -> np.ndarray:
        """Number of contacts of each particle (n,) at frame `k`."""
        return self._at("coordination", k)

    def position_spread_um(self, k: int) -> np.ndarray | None:
        """Standard deviation (n, 3) in um that a prediction expects of each coordinate; None where there is none."""
        return self._at("position_spread", k) if "position_spread" in self._group else None

    def box(self, k: int) -> tuple[np.ndarray, np.ndarray]:
        """Lower corner (3,) and edges (3,) of the box in um at frame `k`."""
        return self._at("box/lower", k), self._at("box/edges", k)

    def frame(self, k: int) -> Frame:
        """All of frame `k`."""
        held = {field: self._at(name, k) for name, field, _ in _TIME_DEPENDENT if name in self._group}
        row = self._row[k]
        return Frame(k, int(self.steps[row]), float(self.times_us[row]), **held)

    def all_edges_um(self) -> np.ndarray:
        """Edges (frames, 3) of the box in um at every frame of the file, in their order."""
        return self._values("box/edges", slice(None))

    def volume_um3(self, k: int) -> float:
        """Volume of the box at frame `k` in um3."""
        return float(np.prod(self._at("box/edges", k)))

    def check_same_particles(self, other: "FrameStore") -> None:
        """InputError unless `other` holds the same particles of the same slurry."""
        slurry = self.attributes["slurry"]
        if slurry != other.attributes["slurry"] or not np.array_equal(self.particles.id, other.particles.id):
            raise InputError(f"{self.path}: slurry {slurry}, not the particles of {other.path}")

    def density_g_cm3(self, k: int) -> float:
        """Mass of all particles over the volume of the box at frame `k`; 1 pg/um3 = 1 g/cm3."""
        return float(self.particles.mass_pg.sum() / self.volume_um3(k))

    def __enter__(self) -> "FrameStore":
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()


def read_frames(path: str | Path) -> FrameStore:
    """Open a frame store; use it as a context manager. InputError if it is no such file, or not as it was written."""
    path = Path(path)
    check_unchanged(path)  # the HDF5 library may hang on a damaged file
    file = None
    try:
        file = h5py.File(path, "r")
        return FrameStore(path, file)
    except NOT_AS_EXPECTED as error:
        if file is not None:
            file.close()
        raise _unreadable(path, error) from error


def _unreadable(path: Path, error: Exception) -> InputError:
    return InputError(f"{path}: not a readable frame store ({' '.join(str(error).split())})")


# name in the file, field of Frame, unit
_TIME_DEPENDENT = (
    ("position", "position_um", "um"),
    ("scaled_position", "scaled_position", ""),
    ("coordination", "coordination", ""),
    ("position_spread", "position_spread_um", "um"),
    ("box/edges", "edges_um", "um"),
    ("box/lower", "lower_um", "um"),
)
_OPTIONAL = ("position_spread",)
_COMPRESSION = {"compression": "gzip", "shuffle": True, "fletcher32": True}
_STATIC = (
    ("id", "id", ""),
    ("type", "type", ""),
    ("species", "phase", ""),
    ("size_class", "size_class", ""),
    ("radius", "radius_um", "um"),
    ("mass", "mass_pg", "pg"),
)


def write_frames(
    path: str | Path, particles: Particles, frames: Iterable[Frame], attributes: Mapping[str, str | int | float]
) -> None:
    """Write a frame store, one frame after the other, in compressed, checksummed chunks of one frame each.

    Parameters
    ----------
    path
        The file, which is moved into place when it is complete.
    particles, frames
        The particles and their frames, in order.
    attributes
        Strings and numbers that say where the frames come from.

    Raises
    ------
    ValueError
        If some frames hold an optional quantity and others do not.
    """
    with hdf5_moved_into_place(path) as file:
        file.create_group("h5md").attrs["version"] = np.array([1, 1])
        for role, value in (("author", {}), ("creator", {"version": "1"})):
            file["h5md"].create_group(role).attrs.update({"name": "SlurryCast"} | value)
        group = file.create_group(GROUP)
        for name, field, unit in _STATIC:
            group[name] = getattr(particles, field)
            group[name].attrs["units"] = unit
        box = group.create_group("box")
        box.attrs["dimension"] = 3
        box.attrs["boundary"] = ["periodic"] * 3
        instants = []
        written = _TIME_DEPENDENT
        for count, frame in enumerate(frames):
            held = [(name, *rest) for name, *rest in _TIME_DEPENDENT if getattr(frame, rest[0]) is not None]
            if count == 0:
                written = held
            elif held != written:
                raise ValueError(f"{path}: frame {frame.number} does not hold the same quantities as the first one")
            for name, field, unit in written:
                value = np.asarray(getattr(frame, field))
                if count == 0:
                    shape = {"shape": (0, *value.shape), "maxshape": (None, *value.shape), "chunks": (1, *value.shape)}
                    compression = {} if name.startswith("box/") else _COMPRESSION
                    data = group.require_group(name).create_dataset("value", dtype=value.dtype, **shape, **compression)
                    data.attrs["units"] = unit
                data = group[f"{name}/value"]
                data.resize(count + 1, axis=0)
                data[count] = value
            instants.append((frame.number, frame.step, frame.time_us))
        numbers, steps, times_us = map(np.array, zip(*instants, strict=True))
        # One step and one time array, linked from every element as H5MD proposes.
        group["position/step"] = steps
        group["position/time"] = times_us
        group["position/time"].attrs["units"] = "us"
        for name, _, _ in written[1:]:
            group[f"{name}/step"] = group["position/step"]
            group[f"{name}/time"] = group["position/time"]
        file["parameters/frame_numbers"] = numbers
        file["parameters"].attrs.update(attributes)
        file["parameters"].attrs["phases"] = list(particles.phase_names)
