"""What a surrogate is: the base class with its defaults, and the rules that give the final box."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from slurrycast.data.final_box import scale_of_prediction
from slurrycast.surrogates.prediction import Prediction, PredictionInput
from slurrycast.surrogates.stored_model import StoredLayer


@dataclass(frozen=True)
class BoxRule:
    """A rule for the edges (3,) in um of the final box.

    Attributes
    ----------
    name
        As in the attribute `box_rule` of a prediction and in reports.
    edges_um
        Gives the edges from what the surrogate was asked and what it answered.
    needs_packing_fraction
        Whether the mean packing fraction of the training slurries is needed. The edges are then known before the
        prediction, and the input holds them.
    """

    name: str
    edges_um: Callable[[PredictionInput, Prediction], np.ndarray]
    needs_packing_fraction: bool = False


LAST_FRAME = BoxRule("last_frame", lambda inputs, prediction: inputs.last.edges_um)
MEAN_PACKING_FRACTION = BoxRule(
    "mean_packing_fraction", lambda inputs, prediction: inputs.final_edges_um, needs_packing_fraction=True
)
SCALE_OF_PREDICTION = BoxRule(
    "scale_of_prediction",
    lambda inputs, prediction: (
        inputs.last.edges_um * scale_of_prediction(prediction.position_um, inputs.last.position_um)
    ),
)
LOOSE_PACKING = BoxRule("loose_packing", lambda inputs, prediction: prediction.edges_um)
SIMULATED = BoxRule("simulated", lambda inputs, prediction: prediction.edges_um)


class Surrogate:
    """A jump from the input frames of a slurry to its equilibrated microstructure.

    A subclass sets `name`, `looks_at` and `box_rule` and defines `predict`. All other attributes have defaults, which
    hold for a surrogate that learns nothing. The Snakefile imports the modules: they import Keras, LAMMPS and the like
    only inside functions.

    Attributes
    ----------
    name
        Name of the module, in the configuration and in paths.
    looks_at
        What the prediction for a particle depends on, for the report.
    box_rule
        Rule that gives the final box.
    model_file
        "model.keras" if the model is trained, "model.json" if it is fitted in closed form, None if nothing is learned.
    weights_epoch
        Epoch of the weights in model.keras: that of the "lowest" validation loss, or the "last".
    goes_on
        Whether a training of more epochs goes on where one of fewer ended: no epoch depends on how many there are.
    learns_from
        "samples" (particles of the training set, whatever their slurry), or "frames" (whole slurries; then a label may
        end with a last input frame).
    dem_script
        Script of scripts/lammps that continues the DEM from the restart file at the last input frame.
    from_recipe
        Whether it starts from random places in place of frames of the DEM. Its particles then are not where those of
        the DEM are, so coordinates are not compared. It neither learns nor continues the DEM.
    has_spread
        Whether predictions have a spread, from which the evaluation calibrates an uncertainty.
    variant
        Pattern of the variants that a label may name. Its groups become settings.
    least_frames
        Number of input frames that it needs.

    Notes
    -----
    `settings` are the section of the configuration with the surrogate's name (empty if there is none), the groups
    of the variant, and `seed` in `fit` and `train`; with `learns_from` "frames" also `input_frames` and
    `target_frame`. `start_from`, a path, is there where `train` goes on with a stored model.
    """

    name: str
    looks_at: str
    box_rule: BoxRule
    model_file: str | None = None
    weights_epoch: str | None = None
    goes_on: bool = False
    learns_from: str | None = None
    dem_script: str | None = None
    from_recipe: bool = False
    has_spread: bool = False
    variant: re.Pattern | None = None
    least_frames: int = 1

    def __init_subclass__(cls) -> None:
        REGISTERED[cls.name] = cls()

    @property
    def is_learned(self) -> bool:
        """Whether it has a model file."""
        return self.model_file is not None

    @property
    def is_trained(self) -> bool:
        """Whether it is a network with learning curves."""
        return self.model_file == "model.keras"

    @property
    def is_fitted(self) -> bool:
        """Whether its parameters follow from the training set in closed form."""
        return self.model_file == "model.json"

    @property
    def continues_dem(self) -> bool:
        """Whether it continues the DEM."""
        return self.dem_script is not None

    @property
    def needs_packing_fraction(self) -> bool:
        """Whether its final box follows from the packing fraction of the training slurries."""
        return self.box_rule.needs_packing_fraction

    def predict(self, inputs: PredictionInput, model_path: str | Path | None, settings: Mapping) -> Prediction:
        """Predict the final coordinates from the input frames and nothing later."""
        raise NotImplementedError

    def fit(self, training_set: Any, settings: Mapping, model_path: str | Path) -> dict:
        """Fit to a `dataset.TrainingSet`, write the model (JSON) and return its content."""
        raise NotImplementedError

    def train(self, data: Any, settings: Mapping, folder: Path, held_out: Mapping | None = None) -> dict[str, float]:
        """Train on `data`, and write the model and its learning curves.

        Parameters
        ----------
        data
            A `dataset.TrainingSet`; with `learns_from` "frames" two lists of `trajectories.Trajectory`, the training
            and the validation slurries.
        settings
            See the class.
        folder
            Gets model.keras, and history.csv with the columns epoch, loss, mae, val_loss and val_mae. It keeps
            checkpoint*.h5, from which a training that was killed, or `goes_on`, continues.
        held_out
            With `learns_from` "samples", data sets of other slurries by name (validation, test). Their errors join the
            history as the columns <name>_slurries_loss and _mae, and nothing else may depend on them.

        Returns
        -------
        dict
            wall_s and cpu_s of attempts before this one.
        """
        raise NotImplementedError

    def needed_frames(
        self, settings: Mapping, edges_um: Mapping[int, np.ndarray], *, moved: bool = True
    ) -> Sequence[int]:
        """Numbers of the frames that training on frames reads, or testing where `moved` is False.

        `edges_um` are the edges (3,) of the box at all frames of a slurry.
        """
        return [*settings["input_frames"], settings["target_frame"]]

    def first_frame_seen(self, input_frames: Sequence[int], settings: Mapping) -> int:
        """Earliest last input frame that it learns from."""
        return max(input_frames)

    def input_shapes(self, n_frames: int, settings: Mapping) -> dict[str, tuple[int, ...]]:
        """Shapes of the inputs of model.keras, by which one that was trained elsewhere is known to fit."""
        raise NotImplementedError

    def knows(self, layers: Sequence[StoredLayer]) -> bool:
        """Whether a model.keras with these layers may be one of this kind and version."""
        return True

    def misfit(self, layers: Sequence[StoredLayer], n_frames: int, n_phases: int, settings: Mapping) -> str | None:
        """What of a stored model keeps a training from going on with it.

        Parameters
        ----------
        layers
            Its layers.
        n_frames, n_phases
            Numbers of input frames, and of phases in all recipes.
        settings
            See the class.

        Returns
        -------
        str or None
            The end of a sentence that begins with the model; None if it fits.
        """
        raise NotImplementedError

    def most_steps(self, settings: Mapping) -> int:
        """Largest number of DEM steps that a prediction takes."""
        raise NotImplementedError


REGISTERED: dict[str, Surrogate] = {}
