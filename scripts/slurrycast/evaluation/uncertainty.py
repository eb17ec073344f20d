"""How reliable the spread that a surrogate gives is: does it rank the errors, and what do its intervals cover?

A spread is the standard deviation expected of each coordinate. It is calibrated on the validation slurries: spreads are
multiplied by a factor for each level so that |error| <= factor x spread holds for that share of the coordinates. The
quantile is that of split conformal prediction with the score |error| / spread (Angelopoulos & Bates, arXiv:2107.07511,
sections 1 and 2.3), each validation slurry with the same weight.

The guarantee of conformal prediction is for further coordinates of the same slurries. For those of another slurry, a
level of 90 % needs at least 9 validation slurries (Lee, Barber & Willett, arXiv:2306.06342), so the coverage on the
test slurries is measured.
"""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from slurrycast.data.frames import FrameStore, read_frames
from slurrycast.evaluation.noise import final_deviation_um
from slurrycast.runtime.files import InputError, write_text

LEVELS = (0.5, 0.9)
_ROUNDING = 1e-12  # of sums of weights, far below the weight of one coordinate


@dataclass(frozen=True)
class Judged:
    """A prediction with its error: spread_um and error_um, both (n, 3)."""

    surrogate: str
    slurry: str
    spread_um: np.ndarray
    error_um: np.ndarray

    @property
    def scores(self) -> np.ndarray:
        """|error| / spread of all coordinates, (3 n,)."""
        return (np.abs(self.error_um) / self.spread_um).ravel()


def judge(predicted: FrameStore, dem: FrameStore, target_frame: int) -> Judged:
    """Spread and error of one prediction, as `noise.final_deviation_um` takes the error.

    Parameters
    ----------
    predicted
        Frame store of the prediction.
    dem, target_frame
        Frame store of the DEM, and the number of the frame to compare with.

    Raises
    ------
    InputError
        If the prediction has no spread, or one that is not finite and above 0, or is of other particles.
    """
    surrogate, slurry = (str(predicted.attributes.get(name, "-")) for name in ("surrogate", "slurry"))
    spread_um = predicted.position_spread_um(predicted.last)
    if spread_um is None:
        raise InputError(f"{predicted.path}: has no spread, surrogate {surrogate} did not give one")
    if not (np.isfinite(spread_um) & (spread_um > 0)).all():
        raise InputError(f"{predicted.path}: has spreads that are not finite and above 0")
    return Judged(surrogate, slurry, spread_um, final_deviation_um(predicted, dem, target_frame))


def read_judged(predicted: Sequence[Path], dem: Sequence[Path], target_frame: int) -> list[Judged]:
    """`judge` each predicted structure by the DEM frames in the same place. InputError if a file is not readable."""
    judged = []
    for predicted_path, dem_path in zip(predicted, dem, strict=True):
        with read_frames(predicted_path) as structure, read_frames(dem_path) as run:
            judged.append(judge(structure, run, target_frame))
    return judged


# ---- calibration


def conformal_factor(scores: Sequence[np.ndarray], level: float) -> float:
    """Smallest score that the share `level` of coordinates does not exceed.

    Parameters
    ----------
    scores
        Scores |error| / spread, one array (coordinates,) for each slurry.
    level
        Share of the coordinates, 0 to 1.

    Raises
    ------
    InputError
        If there are too few coordinates for the level.

    Notes
    -----
    Of N coordinates in m slurries, each has the weight N / (N + 1) / (m n) in a slurry of n coordinates. The rest,
    1 / (N + 1), is the weight of the next coordinate, whose score may exceed all. For one slurry this is the score of
    rank ceil((N + 1) level).
    """
    everything = np.concatenate(scores)
    total = len(everything)
    weights = np.concatenate([np.full(len(one), total / (total + 1) / len(scores) / len(one)) for one in scores])
    order = np.argsort(everything, kind="stable")
    place = np.searchsorted(np.cumsum(weights[order]), level - _ROUNDING)
    if place == total:
        raise InputError(f"{total} coordinates: too few for a level of {level:g}")
    return float(everything[order[place]])


@dataclass(frozen=True)
class Calibration:
    """Factors of the spread for each level, and on what they were found: models/{surrogate}/calibration.json."""

    surrogate: str
    levels: tuple[float, ...]
    factors: tuple[float, ...]
    slurries: tuple[str, ...]
    coordinates: int

    def write(self, path: str | Path) -> None:
        """Write as JSON in one move."""
        write_text(path, json.dumps(asdict(self), indent=1, ensure_ascii=False) + "\n")


def calibrate(judged: Sequence[Judged]) -> Calibration:
    """Factors for LEVELS of one surrogate from its predictions of the validation slurries.

    InputError if there is no prediction, or there are several surrogates, or too few coordinates for a level.
    """
    names = sorted({one.surrogate for one in judged})
    if len(names) != 1:
        raise InputError(f"calibration: predictions of {', '.join(names) or 'no surrogate'}: needed are those of one")
    scores = [one.scores for one in judged]
    return Calibration(
        surrogate=names[0],
        levels=LEVELS,
        factors=tuple(conformal_factor(scores, level) for level in LEVELS),
        slurries=tuple(one.slurry for one in judged),
        coordinates=sum(map(len, scores)),
    )


def read_calibration(path: str | Path) -> Calibration:
    """Read what `Calibration.write` wrote. InputError if it is something else."""
    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))
        calibration = Calibration(
            surrogate=str(content["surrogate"]),
            levels=tuple(map(float, content["levels"])),
            factors=tuple(map(float, content["factors"])),
            slurries=tuple(map(str, content["slurries"])),
            coordinates=int(content["coordinates"]),
        )
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path}: not a calibration ({type(error).__name__}: {error})") from error
    levels, factors = calibration.levels, calibration.factors
    sound = len(levels) == len(factors) > 0 and all(0 < level < 1 for level in levels)
    if not sound or not all(np.isfinite(factor) and factor >= 0 for factor in factors):
        raise InputError(f"{path}: levels {list(levels)} and factors {list(factors)} do not belong together")
    return calibration


# ---- what the spread is worth


def coverage(scores: np.ndarray, factor: float) -> float:
    """Share of coordinates whose |error| is at most factor x spread."""
    return float(np.mean(scores <= factor))


def expected_coverage(scores: np.ndarray, levels: Sequence[float]) -> np.ndarray:
    """Coverage of the spreads as they come, taken as standard deviations of normal errors.

    Parameters
    ----------
    scores
        |error| / spread, (coordinates,).
    levels
        Levels, 0 to 1.

    Returns
    -------
    Coverage (levels,); it equals the levels if the assumption holds (Kuleshov, Fenner & Ermon, arXiv:1807.00263).
    """
    from scipy.stats import norm

    return np.array([coverage(scores, norm.ppf((1 + level) / 2)) for level in levels])


def rank_correlation(spread_um: np.ndarray, error_um: np.ndarray) -> float:
    """Spearman's correlation of a particle's spread, root mean square over axes, and the length of its error.

    Parameters
    ----------
    spread_um, error_um
        Spread and error in um, both (n, 3).

    Returns
    -------
    Correlation; NaN if all particles have the same spread or error, which has no order.
    """
    from scipy.stats import spearmanr

    spread_um = np.sqrt(np.mean(spread_um**2, axis=1))
    length_um = np.linalg.norm(error_um, axis=1)
    if np.ptp(spread_um) == 0 or np.ptp(length_um) == 0:
        return np.nan
    return float(spearmanr(spread_um, length_um).statistic)


def binned_um(spread_um: np.ndarray, error_um: np.ndarray, bins: int) -> tuple[np.ndarray, np.ndarray]:
    """Root mean squares of spread and of error in bins of equally many coordinates, in the order of the spread.

    Parameters
    ----------
    spread_um, error_um
        Spread and error in um, both (n, 3).
    bins
        Number of bins; fewer if there are not as many coordinates.

    Returns
    -------
    Both root mean squares (bins,) in um. They are equal where spreads are standard deviations (Levi et al.,
    arXiv:1905.11659).
    """
    spread_um, error_um = spread_um.ravel(), error_um.ravel()
    parts = np.array_split(np.argsort(spread_um, kind="stable"), min(bins, len(spread_um)))
    return tuple(np.array([np.sqrt(np.mean(values[part] ** 2)) for part in parts]) for values in (spread_um, error_um))
