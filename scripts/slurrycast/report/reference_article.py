"""What the reference article reports, as data; wherever it is shown, it is labelled as theirs and as another scale.

Le-Dinh et al., J. Power Sources 2026, doi 10.1016/j.jpowsour.2026.240447. Table and figure numbers are the article's.
Slurries are known by the reference article's own numbers.
"""

from dataclasses import dataclass

DOI = "10.1016/j.jpowsour.2026.240447"
CITATION = "Le-Dinh et al., J. Power Sources 2026"


@dataclass(frozen=True)
class Structure:
    """Final microstructure of one slurry (Table 3)."""

    density_g_cm3: float
    volume_um3: float


@dataclass(frozen=True)
class CoordinateErrors:
    """Errors of the predicted coordinates of one slurry over all axes (Table 4)."""

    mse_um2: float
    mae_um: float
    r2: float


# Table 1 and the text on the simulations and the network
TIMESTEP_US = 1e-4
STEPS = 6_000_000
STEPS_PER_FRAME = 50_000
FRAMES = 121
INPUT_FRAMES = (7, 8, 9, 10)
TRAINING_SLURRIES = 8
HELD_OUT_SLURRIES = 7
SAMPLES = 131_936
RANKS = 28  # one node, 2 x Xeon E5-2680 v4
EPOCHS = 1000
BATCH_SIZE = 500
LEARNING_RATE = 1e-4
PARAMETERS = 23_803_139  # Table 2

# Cost of one slurry, minutes of wall time, as the text compares them.
# Which stages the about 30 min hold, it does not say.
FULL_DEM_MIN = 1230
HYBRID_MIN = 30
COST_RATIO = FULL_DEM_MIN / HYBRID_MIN
INPUT_STEPS = INPUT_FRAMES[-1] * STEPS_PER_FRAME
# What the text says of the parts of the about 30 min, by stage of this workflow; of the others it says nothing.
HYBRID_PART_CLAIMS = {
    "run_slurry_to_input": "whether it is counted is not stated",
    "predict_slurry": "negligible",
    "relax_slurry": "the largest part",
}

# Table 3: by slurry, full DEM and hybrid ("DL-DEM")
DEM_STRUCTURE = {
    "2": Structure(2.2430, 4081),
    "3": Structure(2.2415, 4091),
    "4": Structure(2.2422, 8096),
    "5": Structure(2.2419, 8126),
    "6": Structure(2.2437, 20390),
    "7": Structure(2.2406, 16360),
}
HYBRID_STRUCTURE = {
    "2": Structure(2.2169, 4129),
    "3": Structure(2.2486, 4078),
    "4": Structure(2.3810, 7624),
    "5": Structure(2.3870, 7632),
    "6": Structure(2.7822, 16443),
    "7": Structure(2.2799, 16087),
}

# Table 4
COORDINATE_ERRORS = {
    "2": CoordinateErrors(0.068, 0.178, 0.996),
    "3": CoordinateErrors(0.060, 0.165, 0.996),
    "4": CoordinateErrors(0.165, 0.316, 0.995),
    "5": CoordinateErrors(0.152, 0.305, 0.995),
    "6": CoordinateErrors(0.199, 0.348, 0.996),
    "7": CoordinateErrors(0.094, 0.226, 0.998),
}

# Fig. 3: R2 per axis of slurry 1, the only slurry for which the text states it
R2_PER_AXIS = {"1": {"x": 0.994, "y": 0.994, "z": 0.999}}
