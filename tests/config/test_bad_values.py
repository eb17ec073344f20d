"""Values that a configuration must not have, and the one line that says so."""

import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from configurations import HEADER, SCALES, load, scaled, shipped
from slurrycast import surrogates
from slurrycast.config.configuration import check
from slurrycast.config.drying_checks import tortuosity_voxels
from slurrycast.config.schema_errors import schema
from slurrycast.config.slurry_table import Slurry

pytestmark = pytest.mark.usefixtures("in_empty_project")

NAN, INF = float("nan"), float("inf")
KNOWN = ", ".join(surrogates.NAMES)
CONFIG = load("config")
NAMES = ", ".join(CONFIG["surrogate"]["names"])
RUN_NAME = (
    "text of at most 100 letters, digits, '.', '_' and '-', without '-' at its start, other than '.', '..', "
    "'README.md' and 'reference'"
)
COMMAND = "text without control characters, not empty, no hyphen in front"
ID = "text of at most 50 letters, digits and '_'"
LABELS = "a list of labels of surrogates, each once"
PHASE = "a phase named with 1 to 50 letters and digits"
PICTURES = "a list of labels in surrogate.names, each once; [] for no pictures"
DEM = ", ".join(CONFIG["dem"])
PAIRS = "two phases with a hyphen between them, such as NiO-NiO; {} for none"
A_PAIR = "a section with at least one of epsilon_fj_per_um, normal_stiffness_kpa, ..., friction"
A_LIST, PICOSECONDS = "a list of at least", "whole picoseconds (1.0e-6), increasing"
RANKS, MINUTES = "a whole number at least 1 and at most 4096", "null or a whole number of minutes from 1 to 1000000"
DIAMETER, DAMPING = "a number at least 0.01 and at most 100", "a number at least 0.01 and at most 100000000"
SEED = "a whole number at least 1 and at most 2147483647"
STEPS, MILLION = (f"a whole number at least 1 and at most {most}" for most in (2000000000, 1000000))
FRICTION, TIME_STEP, TEMPERATURE = (
    f"a number at least {least} and at most {most}" for least, most in ((0, 10), ("1e-05", 1), (1, 100000))
)
NIO, BDPD = "formulation.phases.NiO", "formulation.phases.BDPD"
HERTZ, LENNARD_JONES = "force_field.granular_hertz", "force_field.lennard_jones"
TARGETS = "surrogate.neighbours.intermediate_targets"

# key: what it must be, and values that are not
OUT_OF_RANGE = {
    "run.name": (
        RUN_NAME,
        ["..", "README.md", "reference", "Reference", "-demo", "my run", "../demo", "demo\n", "", "größe"],
    ),
    "run.overwrite": ("true or false", ["yes", 1]),
    "slurries": (COMMAND, [""]),
    "formulation.unit_mass_pg": ("a number above 0 and at most 10000000000", [0, NAN, 1e11]),
    "formulation.expected_density_g_cm3": ("null or a number at least 0.1 and at most 30", [2240.0, 0.00224]),
    "formulation.initial_packing_fraction": ("a number at least 0.01 and below 0.5", [0.5]),
    "formulation.phases": (PHASE, [None]),
    NIO: ("a section with mass_fraction, density_g_cm3, size_classes", [1]),
    f"{NIO}.mass_fraction": ("a number above 0 and at most 1", [-0.5]),
    f"{NIO}.density_g_cm3": ("a number at least 0.01 and at most 30", [6670.0, 0.00667]),
    f"{NIO}.size_classes": ("a list of at least one size class", [[]]),
    f"{BDPD}.size_classes[0].diameter_um": (DIAMETER, [1100.0, 0.0011]),
    f"{LENNARD_JONES}.epsilon_fj_per_um": ("a number at least 0 and at most 100", [1000.0]),
    f"{LENNARD_JONES}.cutoff_factor": ("a number at least 1 and at most 10", [0.9]),
    f"{HERTZ}.normal_stiffness_kpa": ("a number at least 1000 and at most 1000000000", [200.0]),
    f"{HERTZ}.normal_damping_per_um_us": ("a number at least 0 and at most 10000", [30000.0]),
    f"{HERTZ}.friction": (FRICTION, [NAN, -0.1]),
    "force_field.pairs": (PAIRS, [None, ["NiO-NiO"]]),
    "force_field.pairs.NiO-NiO": (A_PAIR, [{}, 0.1]),
    "dem": (f"a section with {DEM}", [None]),
    "dem.executable": (COMMAND, [" "]),
    "dem.launcher": (COMMAND, [None]),
    "dem.ranks": (RANKS, [True, 2.0, "two", 0]),
    "dem.budget_min": (MINUTES, [1.5, 0]),
    "dem.timestep_us": (TIME_STEP, [True, 2.0, 2e-06, 2000.0]),
    "dem.steps": (STEPS, [[60000]]),
    "dem.frames": ("a whole number at least 2 and at most 100000", [1]),
    "learning.input_frames[0]": ("a whole number at least 1", [0]),
    "dem.temperature_k": (TEMPERATURE, [NAN, -300, 0.3, 300000.0]),
    "dem.temperature_damping_us": ("a number at least 0.001 and at most 100", [200.0, 0.0002]),
    "dem.pressure_kpa": (TEMPERATURE, [INF, 101325.0, 0.101325]),
    "dem.pressure_damping_us": (DAMPING, [0.005, 2.0e9]),
    "dem.barostat": ("one of npt, berendsen", ["Berendsen", None]),
    "dem.skin_um": ("null or a number at least 0.001 and at most 10", [150.0, 0.00015]),
    "dem.push_off_iterations": (MILLION, [0]),
    "dem.impact_speed_um_us": ("a number at least 0.001 and at most 10", [100.0, 0.0001]),
    "learning.input_frames": (f"{A_LIST} one frame number, increasing, each before target_frame", [[]]),
    "learning.validation_share": ("a number above 0 and below 1", [1]),
    "learning.seed": (SEED, [0]),
    "surrogate.names": (LABELS, ["vgg16", ["vgg16", "vgg16"]]),
    "surrogate.models.vgg16": ("the path of an existing file that ends in .keras, without braces", [None, "model.h5"]),
    "surrogate.packing_fraction": ("null or a number above 0 and below 1", [1.2]),
    "surrogate.vgg16.epochs": (MILLION, [0]),
    "surrogate.vgg16.patience": ("null or a whole number from 1 to 1000000", [0, 2.5]),
    "surrogate.vgg16_box.min_improvement": ("a number at least 0 and below 1", [-0.1, 1, 2.0]),
    "surrogate.vgg16.batch_size": (MILLION, [-4]),
    "surrogate.driven_dem.steps": (STEPS, [0]),
    "surrogate.early_dem.flat_within": ("a number above 0 and below 1", [0]),
    TARGETS: ("a list of numbers above 0 and below 1, each once", [[0.4, 0.4]]),
    "relaxation.pressure_damping_steps": ("a whole number at least 500 and at most 1000000", [1, 200.0, 0.2]),
    "relaxation.start_thermal_share": ("a number at least 0 and at most 0.1", [-INF, 3.0e4]),
    "relaxation.max_kinetic_share": ("a number above 0 and at most 1", [0, 1.5]),
    "relaxation.pressure_within": ("a number above 0 and at most 1", [0, 2.0]),
    "drying.sources": ("a list of dem and labels of surrogates, each once; [] for none", ["dem", ["dem", "dem"]]),
    "drying.test_slurries": ("null or a whole number from 1 to 10000", [0, 1.5]),
    "drying.replicas": ("0 or a whole number from 2 to 1000", [-1, 1, 2.5]),
    "drying.composition_is": ("one of wet, dry", ["moist"]),
    "drying.solvent_fraction_of": ("one of phase, slurry", ["BDPD"]),
    "drying.solvent_mass_fraction": ("a number at least 0 and below 1", [-0.1, 1, 59.4]),
    "drying.organics_density_g_cm3": ("a number at least 0.1 and at most 30", [0, 1100.0]),
    "drying.stages": ("a whole number at least 1 and at most 10000", [0]),
    "drying.steps_per_stage": ("a whole number at least 1 and at most 100000000", [0, 0.5]),
    "drying.rest_steps": ("a whole number at least 1 and at most 100000000", [0]),
    "drying.green_density_g_cm3": ("null or a number above 0 and at most 30", [0, "3"]),
    "drying.wet_thickness_um": ("null or a number above 0 and at most 1000000", [0, -5.0]),
    "drying.timestep_factor": ("a number above 0 and at most 10", [0, 11]),
    "drying.force_field.friction": ("a number at least 0 and at most 100", [-0.5]),
    "drying.force_field.attraction_factor": ("a number at least 0 and at most 1000", [-1]),
    "drying.force_field.stiffness_factor": ("a number at least 0.01 and at most 1000", [0]),
    "microstructure.tortuosity_stages": ("a list of at least one of slurry, tape, each once", [[], "tape"]),
    "microstructure.tortuosity_stages[0]": ("one of slurry, tape", ["tapes"]),
    "microstructure.tortuosity_axes": ("a list of at least one of x, y, z, each once", [[], ["z", "z"], "z"]),
    "microstructure.tortuosity_axes[0]": ("one of x, y, z", ["Z"]),
    "microstructure.tortuosity_of": ("a list of at least one of void, nonceramic, each once", [[], "void"]),
    "microstructure.tortuosity_of[0]": ("one of void, nonceramic", ["pore"]),
    "microstructure.tortuosity_extrapolated": ("true or false", ["yes"]),
    "analysis.rdf_cutoff_um": ("a number at least 0.1 and at most 1000", [7000.0, 0.007]),
    "analysis.rdf_bins": (MILLION, [0]),
    "analysis.rdf_pair": ("a list of two phases of the recipes, which may be the same", [["NiO"]]),
    "evaluation.replicated": (
        "a list of ids of slurries of role validation or test, each once; [] for none",
        ["6", ["6", "6"]],
    ),
    "evaluation.replicas": ("a whole number at least 2 and at most 1000", [1]),
    "evaluation.perturbation_um": ("a number at least 1e-08 and at most 0.0001", [0.001, 1e-09]),
    "convergence.timesteps_us": (f"{A_LIST} two time steps from 1.0e-5 to 0.05, in {PICOSECONDS}", [[0.001]]),
    "convergence.timesteps_us[0]": ("a number at least 1e-05 and at most 0.05", [NAN, 2e-06]),
    "convergence.timesteps_us[1]": ("a number at least 1e-05 and at most 0.05", [2.0]),
    "explore.ranges": (
        "mass_fraction_, size_factor_ or density_g_cm3_ and a phase, solvent_mass_fraction or organics_density_g_cm3",
        [[]],
    ),
    "explore.recipes": ("null or the path of a table, without braces", ["", 1]),
    "explore.points": ("a whole number at least 3 and at most 100000", [2, 64.0]),
    "explore.replicas": ("a whole number at least 0 and at most 1000", [-1]),
    "explore.particles": ("a whole number at least 10 and at most 1000000", [1]),
    "explore.thickness_ratio": ("a number at least 0.01 and at most 100", [0]),
    "explore.properties": ("a list of at least one property, each once", [[], ["density", "density"]]),
    "explore.target": ("names of explore.properties", [0.4]),
    "report.pictures": (PICTURES, [True, "off"]),
}
# key, what it must be, a value that YAML reads as something else, and what to write
HINTS = [
    ("run.name", RUN_NAME, 2026, "put it in quotes to make it text"),
    ("convergence.slurry", ID, 1, "put it in quotes to make it text"),
    ("evaluation.replicated[0]", ID, 2, "put it in quotes to make it text"),
    (f"{BDPD}.size_classes[0].diameter_um", DIAMETER, "0.8", "it is text: write 0.8 without quotes"),
    ("dem.timestep_us", TIME_STEP, "1e-4", "1e-4 is text in YAML: write 1.0e-4"),
    ("dem.steps", STEPS, "6e6", "6e6 is text in YAML: write 6000000"),
    ("dem.pressure_damping_us", DAMPING, "2e4", "2e4 is text in YAML: write 2.0e+4"),
]
# key, its value, the end of its line
UNKNOWN = [
    ("dem.presure_kpa", 1.0, f"one of {DEM} (do you mean pressure_kpa?)"),
    (
        "surrogate.vgg16.epoch",
        30,
        "one of start_from, epochs, patience, min_improvement, batch_size, learning_rate, threads "
        "(do you mean epochs?)",
    ),
    ("plot", {}, f"one of {', '.join(CONFIG)} (do you mean report?)"),
    ("formulation.phases.Ni-O", {}, PHASE),
    ("force_field.pairs.NiO", {"friction": 0.1}, PAIRS),
    ("force_field.pairs.NiO-NiO-NiO", {"friction": 0.1}, PAIRS),
    (f"{NIO}.size_classes[0].shape", 2, "one of diameter_um, number_fraction"),
]
MISSING = {
    "report": "a section with pictures",
    "dem.steps": STEPS,
    "formulation.phases.8YSZ.density_g_cm3": (
        "a number at least 0.01 and at most 30 (phases replace those of config.yaml, so each is written whole)"
    ),
    "surrogate.vgg16": (
        "a section with start_from, epochs, patience, min_improvement, batch_size, learning_rate, threads"
    ),
    f"{NIO}.size_classes[0].number_fraction": "a number above 0 and at most 1",
}
# what does not fit together: key, its value, the line without the key, which may be that of another one
MASS, STEP = "formulation.unit_mass_pg: slurry", "dem.timestep_us = 0.002:"
SUM = "must be 1 within 1e-06"
WHOLE_PICOSECONDS = f"must be {PICOSECONDS}"


def too_short(edge_um: str, above_um: str, cutoff_um: str, skin_um: str, more: int) -> str:
    """The line of a box that is too short in the end."""
    return (
        f"{MASS} T2 ends with a shortest edge of {edge_um} um: must be above {above_um} um, twice the largest cutoff "
        f"{cutoff_um} (cutoff_factor) and the skin {skin_um} (and {more} more slurries)"
    )


def too_long(
    step: str, share: str, name: str, time_us: str, most_us: str, most: str, of: str = "BDPD of 1.1 um"
) -> str:
    """The line of a time step that is too long a part of the Rayleigh or Hertz time."""
    limit = f"must be at most {most_us}, as dem.max_{name.lower()}_share = {most}"
    return f"{step} {share} of the {name} time {time_us} us of {of}: {limit}"


DRY = "BDPD of 0.737 um"
DRY_STEP = "\ndrying.timestep_factor x dem.timestep_us = 0.0015:"  # a dry particle is smaller


CONFLICTS = [
    ("slurries", "/none.tsv", "/none.tsv: cannot be read: No such file or directory"),
    # particles, fractions and boxes that cannot be
    (
        "formulation.unit_mass_pg",
        1e10,
        f"{MASS} V2 has 3.879e+10 particles: must be at most 1000000 (and 17 more slurries)",
    ),
    ("formulation.unit_mass_pg", 170, too_short("3.255", "3.6", "1.65", "0.15", 2)),
    (
        f"{NIO}.size_classes",
        [{"diameter_um": 0.6, "number_fraction": 0.0005}, {"diameter_um": 1.0, "number_fraction": 0.9995}],
        f"{MASS} 2 of 773.5 pg has no particle of NiO 0.6 um: must be enough mass for one of each size class (and 17 "
        "more slurries)",
    ),
    (
        "formulation.expected_density_g_cm3",
        0.5,
        "formulation.initial_packing_fraction = 0.2: must be below 0.1482, the packing fraction at "
        "formulation.expected_density_g_cm3, since the box shrinks",
    ),
    (
        "formulation.expected_density_g_cm3",
        3.5,
        " = 3.5: must be below 3.372, the density of the particles without space between them",
    ),
    (f"{NIO}.mass_fraction", 0.5, f"formulation.phases: mass fractions sum to 0.98: {SUM}"),
    ("formulation.phases.8YSZ.mass_fraction", 0.36, f"formulation.phases: mass fractions sum to 1.01: {SUM}"),
    (f"{NIO}.size_classes", [{"diameter_um": 0.8, "number_fraction": 0.9}], f": number fractions sum to 0.9: {SUM}"),
    (f"{LENNARD_JONES}.sigma_factor", 1.5, " = 1.5: must be below cutoff_factor = 1.5"),
    (f"{LENNARD_JONES}.cutoff_factor", 3.0, too_short("5.394", "6.9", "3.3", "0.15", 3)),
    ("dem.skin_um", 2.0, too_short("5.394", "7.3", "1.65", "2", 5)),
    # time steps
    ("dem.timestep_us", 0.0025, too_long(" = 0.0025:", "0.481", "Rayleigh", "0.005196", "0.002", "0.4")),
    (
        "dem.impact_speed_um_us",
        10.0,
        too_long(STEP, "0.166", "Hertz", "0.01204", "0.0012", "0.1"),
    ),
    (
        "dem.max_rayleigh_share",
        0.2,
        too_long(STEP, "0.385", "Rayleigh", "0.005196", "0.001", "0.2"),
    ),
    (
        f"{HERTZ}.normal_stiffness_kpa",
        5e5,
        too_long(STEP, "0.609", "Rayleigh", "0.003287", "0.0013", "0.4"),
    ),
    (
        "force_field.pairs",
        {"NiO-BDPD": {"normal_stiffness_kpa": 5e5}, "BDPD-BDPD": {"normal_stiffness_kpa": 1e5}},
        too_long(STEP, "0.609", "Rayleigh", "0.003287", "0.0013", "0.4"),
    ),
    (
        "force_field.pairs",
        {"NiO-YSZ": {"friction": 0.1}},
        "force_field.pairs.NiO-YSZ: must be two phases of BDPD, NiO, 8YSZ with a hyphen between them",
    ),
    (
        "force_field.pairs",
        {"NiO-8YSZ": {"friction": 0.1}, "8YSZ-NiO": {"friction": 0.1}},
        "force_field.pairs.8YSZ-NiO: must be given once, and is as NiO-8YSZ too",
    ),
    ("convergence.timesteps_us", [0.001, 0.0005], f" = [0.001, 0.0005]: {WHOLE_PICOSECONDS}"),
    ("convergence.timesteps_us", [0.001, 0.0010005], f" = [0.001, 0.0010005]: {WHOLE_PICOSECONDS}"),
    (
        "convergence.timesteps_us",
        [0.0003, 0.001],
        ": 0.0003: must divide dem.timestep_us x dem.thermo_every_steps = 0.8 us",
    ),
    # steps and frames beyond the run or out of order
    ("dem.steps", 60001, " = 60001: must be a multiple of dem.frames - 1 = 120"),
    ("dem.thermo_every_steps", 300, " = 300: must divide the 400 steps between two frames"),
    (
        "dem.pressure_damping_us",
        120.5,
        " = 120.5: the box would collapse in 120.5 us: must be at least 1 and at most 96 with dem.barostat = "
        '"berendsen", these particles, temperature and steps',
    ),
    (
        "dem.barostat",
        "npt",
        "dem.pressure_damping_us = 11.2: the box would collapse in 0.001638 us: must be at least 1094 and at most "
        '6.563e+05 with dem.barostat = "npt", these particles, temperature and steps',
    ),
    ("dem.segment_frames", 121, " = 121: must be at most dem.frames - 1 = 120"),
    ("learning.input_frames", [7, 7, 8], " = [7, 7, 8]: must be strictly increasing"),
    ("learning.target_frame", 10, " = 10: must be after the last input frame 10 and at most dem.frames - 1 = 120"),
    ("learning.target_frame", 121, " = 121: must be after the last input frame 10 and at most dem.frames - 1 = 120"),
    # a phase that cannot dry, or a tape too thin
    ("drying.sources", ["dem", "vgg19"], f": 'vgg19' is not known, allowed: {KNOWN}, or dem"),
    ("drying.phase", "binder", ' = "binder": must be one of BDPD, NiO, 8YSZ; or set drying.sources: []'),
    (
        "drying.organics_density_g_cm3",
        0.33,
        " = 0.33: must be above 0.3303, or the particles of BDPD would not shrink; or set drying.sources: []",
    ),
    (
        "drying.solvent_mass_fraction",
        0.05,
        " = 0.05: the solvent would have a density of 0.137 g/cm3, from that of BDPD and of the organics: must be 0.3 "
        "to 3.0; or set drying.sources: []",
    ),
    (
        "microstructure.spacing_um",
        0.02,
        " = 0.02: slurry 6 would have 2.2e+08 voxels, at most 5e+07 are allowed: must be at least 0.0326; or set "
        "drying.sources: []",
    ),
    (
        "microstructure.spacing_um",
        0.2,
        " = 0.2: must be at most 0.1666, so that the smallest particle has 3 voxels across, and pores between such "
        "particles are seen; or set drying.sources: []",
    ),
    ("analysis.rdf_cutoff_um", 2.0, " = 2.0: must be at least 2.2, twice the largest diameter"),
    (
        "analysis.rdf_bins",
        5,
        "analysis.rdf_cutoff_um / analysis.rdf_bins = 1.4 um: must be at most 0.2728, for 10 bins in slurry 2",
    ),
    ("dem.temperature_damping_us", 0.001, " = 0.001: must be at least 0.02, 10 time steps"),
    (
        "learning.validation_share",
        1e-5,
        " = 1e-05: must leave at least one of the 11162 particles of role train on either side",
    ),
    ("surrogate.early_dem.max_steps", 1000, " = 1000: must be at least surrogate.early_dem.flat_steps = 2000"),
    (
        "drying.timestep_factor",
        1.0,
        too_long(" x dem.timestep_us = 0.002:", "0.494", "Rayleigh", "0.004046", "0.0016", "0.4", DRY),
    ),
    (
        "drying.force_field.stiffness_factor",
        2,
        DRY_STEP.lstrip() + too_long("", "0.524", "Rayleigh", "0.002861", "0.0011", "0.4", DRY),
    ),
    # surrogates, slurries and phases that do not exist or do not fit
    (TARGETS, [0.6, 0.4], " = [0.6, 0.4]: must be strictly increasing"),
    (
        "surrogate.neighbours.cutoff_diameters",
        40,
        " = 40: must be at most 3.165, half the shortest edge that slurry T2 ends with, in mean diameters of its "
        "particles",
    ),
    (
        "surrogate.neighbours.layers",
        3,
        f"{TARGETS} = [0.08, 0.16, 0.25, 0.34, 0.43, 0.52, 0.6, 0.68, 0.75, 0.8...: must be at most 2, one for each of "
        "surrogate.neighbours.layers but the last",
    ),
    ("surrogate.models.vgg16", "none.keras", ' = "none.keras": no such file: must be a trained model.keras'),
    ("evaluation.surrogates", ["affine"], ': "affine": must not be in surrogate.names too'),
    ("evaluation.surrogates", ["vgg19"], f": 'vgg19' is not known, allowed: {KNOWN}"),
    ("report.pictures", ["affine_f02"], f': "affine_f02": must be one of surrogate.names, {NAMES}'),
    (
        "analysis.rdf_pair",
        ["Ni", "YSZ"],
        ' = ["Ni", "YSZ"]: must be two phases of BDPD, NiO, 8YSZ, which may be the same',
    ),
]
VARIANT = "and _f<NN> for the last input frame"
BAD_LABELS = {
    "vgg61": f"'vgg61' is not known, allowed: {KNOWN}",
    "neighbours_f00": '"neighbours_f00": must have at least 2 input frames, it has 1',
    "affine_x2": f"'affine_x2' is not known: must be affine, {VARIANT}",
    "early_dem": (
        "'early_dem' is not known: must be early_dem_ and a variant that matches x(?P<faster>[1-9]\\d*), " + VARIANT
    ),
    "vgg16_f02": '"vgg16_f02": must be vgg16, which learns from learning.input_frames only',
    "affine_f120": '"affine_f120": its last input frame must be 1 to 119, before the target frame',
    "affine_f00": '"affine_f00": its last input frame must be 1 to 119, before the target frame',
    "driven_dem_x2": f"'driven_dem_x2' is not known: must be driven_dem, {VARIANT}",
    "early_dem_x2_f120": '"early_dem_x2_f120": its last input frame must be 1 to 119, before the target frame',
}
BAD_VALUES = [
    *(
        (path, value, f"{path} = {json.dumps(value, ensure_ascii=False)}: must be {must_be}")
        for path, (must_be, values) in OUT_OF_RANGE.items()
        for value in values
    ),
    *(
        (path, value, f"{path} = {json.dumps(value)}: must be {must_be} ({hint})")
        for path, must_be, value, hint in HINTS
    ),
    *((path, value, f"{path}: unknown key: must be {may_be}") for path, value, may_be in UNKNOWN),
    *((path, value, path + line if line[0] in " :" else line) for path, value, line in CONFLICTS),
    *(("surrogate.names", ["vgg16", label], f"surrogate.names: {line}") for label, line in BAD_LABELS.items()),
]


def place(config: dict, path: str) -> tuple[dict | list, str | int]:
    """The section or list in which `path` ends, and its key or index there."""
    *sections, key = [int(part) if part.isdecimal() else part for part in re.split(r"[.\[\]]+", path.removesuffix("]"))]
    for section in sections:
        config = config[section]
    return config, key


@pytest.mark.parametrize(
    ("path", "value", "bound"),
    [
        ("dem.timestep_us", 0.005, "at most"),
        ("dem.pressure_damping_us", 0.02, "at least"),
        ("dem.pressure_damping_us", 5000.0, "and at most"),
        ("surrogate.neighbours.cutoff_diameters", 40, "at most"),
        ("microstructure.spacing_um", 0.02, "at least"),
    ],
)
@pytest.mark.parametrize("diameter_um", [1.0, 1.037])
def test_the_bound_that_a_message_names_is_allowed(config, path, value, bound, diameter_um):
    """It is rounded towards what is allowed, and a time step so that the rows of the log can stay."""
    (binder,) = config["formulation"]["phases"]["BDPD"]["size_classes"]
    binder["diameter_um"] = diameter_um
    config["dem"]["timestep_us"] = 1e-3  # short enough for light particles
    section, key = place(config, path)
    section[key] = value
    (line,) = [line for line in check(config) if line.startswith(f"{path} = ")]
    section[key] = float(re.search(rf"{bound} ([-+.e\d]+\d)", line)[1])
    assert check(config) == []


def test_an_extrapolation_from_two_spacings(config):
    config["microstructure"] |= {"tortuosity_spacings_um": [0.2, 0.1], "tortuosity_extrapolated": True}
    assert check(config) == [
        "microstructure.tortuosity_spacings_um = [0.2, 0.1]: must be at least 3 with "
        "microstructure.tortuosity_extrapolated = true"
    ]
    config["microstructure"]["tortuosity_spacings_um"] = [0.2, 0.15, 0.1]
    assert check(config) == []


def test_a_coarse_recipe_needs_coarse_voxels_for_its_tortuosity_too(config):
    fine = {"tortuosity_spacings_um": config["microstructure"]["tortuosity_spacings_um"], "tortuosity_slurries": 1}
    config = scaled(config, 5)
    config["dem"]["pressure_damping_us"] *= 5
    assert check(config) == []
    config["microstructure"] |= fine
    (line,) = check(config)
    assert line.startswith("microstructure.tortuosity_spacings_um = [0.15, 0.125, 0.1]: slurry 1 may have ")
    assert line.endswith("; or set microstructure.tortuosity_slurries: 0")
    config["microstructure"]["tortuosity_slurries"] = 0
    assert check(config) == []


def test_voxels_are_counted_of_the_slurries_that_a_tortuosity_is_solved_of(config):
    """The first that are dried: one of role `new` too, if fewer test slurries are."""
    config["drying"]["test_slurries"] = 1
    config["microstructure"] |= {"tortuosity_spacings_um": [0.1, 0.04], "tortuosity_slurries": 2}
    slurries = [Slurry("1", "test", 1.0, 2.0, 1), Slurry("2", "test", 1.0, 2.0, 2), Slurry("N", "new", 20.0, 2.0, 3)]
    (line,) = tortuosity_voxels(config, slurries)
    assert "slurry N may have " in line
    config["drying"]["test_slurries"] = None
    assert [*tortuosity_voxels(config, slurries)] == []


@pytest.mark.parametrize(("path", "value", "line"), BAD_VALUES)
def test_bad_value(config, path, value, line):
    section, key = place(config, path)
    section[key] = value
    assert check(config) == line.split("\n")


@pytest.mark.parametrize("name", ["ceramic", "void"])
def test_a_phase_with_a_name_that_stands_for_several(config, name):
    config["formulation"]["phases"][name] = config["formulation"]["phases"].pop("8YSZ")
    config["analysis"]["rdf_pair"] = ["NiO", name]
    (line,) = check(config)
    assert line.startswith(f"formulation.phases.{name}: must have another name, since all, ceramic,")


def test_a_tape_of_organics_alone(config):
    phases = config["formulation"]["phases"]
    config["formulation"]["phases"] = {"BDPD": phases["BDPD"] | {"mass_fraction": 1.0}}
    config["formulation"]["expected_density_g_cm3"] = 0.5
    config["analysis"]["rdf_pair"] = ["BDPD", "BDPD"]
    assert "formulation.phases: BDPD alone: must be a ceramic too, to make a tape; or set drying.sources: []" in (
        check(config)
    )


def test_a_tape_in_which_a_particle_would_touch_two_images_of_another(config):
    """With so short a cutoff the slurry itself may be that thin."""
    Path("flat.tsv").write_text(f"{HEADER}T\ttrain\t1\t1\t1\nF\ttest\t0.2\t0.5\t2\n")
    config["slurries"], config["force_field"]["lennard_jones"]["cutoff_factor"] = "flat.tsv", 1.0
    config["surrogate"]["neighbours"]["cutoff_diameters"] = 1.4
    assert check(config) == [
        "formulation.unit_mass_pg: slurry F may dry to a thickness of 1.61 um: must be above 2 um, twice the largest "
        "diameter; or set drying.sources: []"
    ]
    config["drying"]["sources"] = []
    assert check(config) == []


@pytest.mark.parametrize(("path", "must_be"), MISSING.items())
def test_missing_key(config, path, must_be):
    section, key = place(config, path)
    del section[key]
    lines = check(config)
    assert f"{path}: missing: must be {must_be}" in lines and sum("missing" in line for line in lines) == 1


@pytest.mark.parametrize("value", [None, [], 3, "text"])
def test_configuration_that_is_no_mapping(value):
    (line,) = check(value)
    assert re.match(r"configuration = .*: must be a section with run, slurries", line)


def test_keys_that_yaml_does_not_read_as_text(config):
    config["formulation"]["phases"][8] = config["formulation"]["phases"].pop("8YSZ")
    config["report"][False] = 1
    lines = check(config)
    assert "formulation.phases: key 8 is not text: put it in quotes" in lines
    assert "report: key false is not text: put it in quotes" in lines


def quantities(value: object, rule: dict, path: str = "") -> Iterator[tuple[str, float, dict]]:
    """Yield (path, value, schema) for every number that has a unit."""
    if isinstance(value, dict):
        for key, item in value.items():
            below = rule.get("properties", {}).get(key) or next(iter(rule["patternProperties"].values()))
            yield from quantities(item, below, f"{path}.{key}".lstrip("."))
    elif isinstance(value, list):
        for index, item in enumerate(value):
            yield from quantities(item, rule["items"], f"{path}[{index}]")
    elif "unit" in rule and rule["type"] == "number":
        yield path, value, rule


@pytest.mark.parametrize("factor", [1e3, 1e-3])
@pytest.mark.parametrize("scale", ["config", *SCALES])
def test_no_quantity_passes_in_a_unit_a_factor_of_1000_off(scale, factor):
    """The line names the key, but for a stiffness: what no longer fits is the time step."""
    with_unit = list(quantities(shipped(scale), schema("config")))
    assert {"um", "us", "K", "kPa", "pg", "g/cm3"} < {rule["unit"] for _, _, rule in with_unit}
    for path, value, rule in with_unit:
        if factor < 1 and rule.get("minimum") == 0:
            continue  # a force may also be absent
        if (scale, path, factor) == ("tiny", "formulation.unit_mass_pg", 1e3):
            continue  # slurries of an ordinary size
        config = shipped(scale)
        section, key = place(config, path)
        section[key] = value * factor
        name = re.sub(r"\[\d+\]$", "", path).rpartition(".")[2]
        expected = "dem.timestep_us" if (name, factor) == ("normal_stiffness_kpa", 1e3) else name
        lines = check(config)
        assert lines and expected in lines[0].partition("=")[0], (path, value, lines)


def test_the_end_of_a_run_has_rows_enough_to_judge_it():
    config = load("config")
    config["dem"] |= {"frames": 9, "segment_frames": 4, "thermo_every_steps": 6000}
    config["learning"] |= {"input_frames": [1, 2, 3, 4], "target_frame": 8}
    line = "dem.thermo_every_steps = 6000: must be at most 2400, a 20th of dem.steps, to tell whether"
    assert [found for found in check(config) if found.startswith(line)]


def test_a_tape_without_a_tortuosity_is_allowed():
    config = load("config")
    config["microstructure"]["tortuosity_spacings_um"] = []
    assert check(config) == []
