"""What a network that looks at single particles learns from, and its standardisation."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Samples:
    """What a network learns from.

    Attributes
    ----------
    features
        (n, frames, features).
    targets
        (n, 3).
    unit_um
        Length in um that a target of 1 stands for, (n, 1) or (n, 3): losses are in um2 and um whatever the targets are.
    is_validation
        Mask (n,) of the validation samples.
    """

    features: np.ndarray
    targets: np.ndarray
    unit_um: np.ndarray
    is_validation: np.ndarray


@dataclass(frozen=True)
class Standardisation:
    """Mean and deviation (features,) of each feature, and the deviation of the target from 0, shared by the axes."""

    feature_mean: np.ndarray
    feature_deviation: np.ndarray
    target_deviation: float

    @classmethod
    def fitted(cls, samples: Samples) -> "Standardisation":
        """Compute them from the training samples, over all frames.

        A feature that is always the same is only shifted to 0.
        """
        features, targets = samples.features[~samples.is_validation], samples.targets[~samples.is_validation]
        deviation = features.std(axis=(0, 1))
        target_deviation = float(np.sqrt(np.mean(targets**2)))
        return cls(features.mean(axis=(0, 1)), np.where(deviation > 0, deviation, 1.0), target_deviation or 1.0)

    def apply(self, samples: Samples) -> Samples:
        """The same samples as the layers with weights see them."""
        return Samples(
            (samples.features - self.feature_mean) / self.feature_deviation,
            samples.targets / self.target_deviation,
            samples.unit_um * self.target_deviation,
            samples.is_validation,
        )
