"""The bad-input table: what a configuration or a slurry table may get wrong, and the one line that says so.

Each row is checked as the Snakefile does it; the first of each class goes through Snakemake itself.
"""

import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

from checkouts import copy_checkout, snakemake
from configurations import HEADER, ROOT, SCALES, copy_tables, load, merged, nested, shipped
from slurrycast import surrogates
from slurrycast.config import configuration
from slurrycast.config.configuration import check, physics, read_slurries

NAN, INF = float("nan"), float("inf")
SURROGATES, NAMES = ", ".join(surrogates.NAMES), ", ".join(load("config")["surrogate"]["names"])

# path of the key, its value, the line
BAD_VALUES = {
    "typos and missing or unknown parts": [
        (
            "dem.presure_kpa",
            1.0,
            (
                "dem.presure_kpa: unknown key: must be one of executable, launcher, ranks, budget_min, timestep_us, "
                "steps, frames, restart_frames, segment_frames, thermo_every_steps, temperature_k, "
                "temperature_damping_us, pressure_kpa, pressure_damping_us, pressure_damping_exponent, skin_um, "
                "push_off_iterations, max_rayleigh_share, max_hertz_share, impact_speed_um_us, max_density_drift (do "
                "you mean pressure_kpa?)"
            ),
        ),
        (
            "surrogate.vgg16.epoch",
            30,
            (
                "surrogate.vgg16.epoch: unknown key: must be one of epochs, batch_size, learning_rate, threads "
                "(do you mean epochs?)"
            ),
        ),
        (
            "plot",
            {},
            (
                "plot: unknown key: must be one of run, slurries, formulation, force_field, dem, learning, "
                "surrogate, relaxation, analysis, evaluation, convergence, report (do you mean report?)"
            ),
        ),
        (
            "formulation.phases.Ni-O",
            {},
            (
                "formulation.phases.Ni-O: unknown key: must be a phase named with at most 50 letters and digits, at "
                "least one"
            ),
        ),
        (
            "formulation.phases.NiO.size_classes",
            [{"diameter_um": 0.8, "number_fraction": 1, "shape": 2}],
            ("formulation.phases.NiO.size_classes[0].shape: unknown key: must be one of diameter_um, number_fraction"),
        ),
        (
            "formulation.phases.NiO.size_classes",
            [{"diameter_um": 0.8}],
            ("formulation.phases.NiO.size_classes[0].number_fraction: missing: must be a number above 0 and at most 1"),
        ),
        (
            "dem",
            None,
            (
                "dem = null: must be a section with executable, launcher, ranks, budget_min, timestep_us, steps, "
                "frames, restart_frames, segment_frames, thermo_every_steps, temperature_k, temperature_damping_us, "
                "pressure_kpa, pressure_damping_us, pressure_damping_exponent, skin_um, push_off_iterations, "
                "max_rayleigh_share, max_hertz_share, impact_speed_um_us, max_density_drift"
            ),
        ),
        (
            "formulation.phases",
            None,
            "formulation.phases = null: must be a phase named with at most 50 letters and digits, at least one",
        ),
        (
            "slurries",
            "",
            'slurries = "": must be text without control characters, not empty, no hyphen in front',
        ),
        ("slurries", "config/none.tsv", "config/none.tsv: cannot be read: No such file or directory"),
    ],
    "names of a run": [
        (
            "run.name",
            "..",
            (
                "run.name = \"..\": must be text of at most 100 letters, digits, '.', '_' and '-', other than '.', "
                "'..' and 'README.md'"
            ),
        ),
        (
            "run.name",
            "README.md",
            (
                "run.name = \"README.md\": must be text of at most 100 letters, digits, '.', '_' and '-', other than "
                "'.', '..' and 'README.md'"
            ),
        ),
        (
            "run.name",
            "my run",
            (
                "run.name = \"my run\": must be text of at most 100 letters, digits, '.', '_' and '-', other than '.', "
                "'..' and 'README.md'"
            ),
        ),
        (
            "run.name",
            "../demo",
            (
                "run.name = \"../demo\": must be text of at most 100 letters, digits, '.', '_' and '-', other than "
                "'.', '..' and 'README.md'"
            ),
        ),
        (
            "run.name",
            "demo\n",
            (
                "run.name = \"demo\\n\": must be text of at most 100 letters, digits, '.', '_' and '-', other than "
                "'.', '..' and 'README.md'"
            ),
        ),
        (
            "run.name",
            "",
            (
                "run.name = \"\": must be text of at most 100 letters, digits, '.', '_' and '-', other than '.', '..' "
                "and 'README.md'"
            ),
        ),
        (
            "run.name",
            "größe",
            (
                "run.name = \"größe\": must be text of at most 100 letters, digits, '.', '_' and '-', other than '.', "
                "'..' and 'README.md'"
            ),
        ),
    ],
    "wrong types, and what YAML reads as something else": [
        (
            "run.name",
            2026,
            (
                "run.name = 2026: must be text of at most 100 letters, digits, '.', '_' and '-', other than '.', "
                "'..' and 'README.md' (put it in quotes to make it text)"
            ),
        ),
        ("run.overwrite", "yes", 'run.overwrite = "yes": must be true or false'),
        ("run.overwrite", 1, "run.overwrite = 1: must be true or false"),
        (
            "formulation.phases.NiO",
            1,
            "formulation.phases.NiO = 1: must be a section with mass_fraction, density_g_cm3, size_classes",
        ),
        (
            "formulation.phases.NiO.size_classes",
            [{"diameter_um": "0.8", "number_fraction": 1}],
            (
                'formulation.phases.NiO.size_classes[0].diameter_um = "0.8": must be a number at least 0.01 and at '
                "most 100 (it is text: write 0.8 without quotes)"
            ),
        ),
        (
            "dem.executable",
            " ",
            'dem.executable = " ": must be text without control characters, not empty, no hyphen in front',
        ),
        (
            "dem.launcher",
            None,
            "dem.launcher = null: must be text without control characters, not empty, no hyphen in front",
        ),
        ("dem.ranks", True, "dem.ranks = true: must be a whole number at least 1 and at most 4096"),
        ("dem.ranks", 2.0, "dem.ranks = 2.0: must be a whole number at least 1 and at most 4096"),
        ("dem.ranks", "two", 'dem.ranks = "two": must be a whole number at least 1 and at most 4096'),
        ("dem.budget_min", 1.5, "dem.budget_min = 1.5: must be null or a whole number of minutes from 1 to 1000000"),
        (
            "dem.timestep_us",
            "1e-4",
            (
                'dem.timestep_us = "1e-4": must be a number at least 1e-05 and at most 1 (1e-4 is text in YAML: '
                "write 1.0e-4)"
            ),
        ),
        ("dem.timestep_us", True, "dem.timestep_us = true: must be a number at least 1e-05 and at most 1"),
        (
            "dem.steps",
            "6e6",
            (
                'dem.steps = "6e6": must be a whole number at least 1 and at most 2000000000 (6e6 is text in YAML: '
                "write 6000000)"
            ),
        ),
        ("dem.steps", [60000], "dem.steps = [60000]: must be a whole number at least 1 and at most 2000000000"),
        (
            "dem.pressure_damping_us",
            "2e4",
            (
                'dem.pressure_damping_us = "2e4": must be a number at least 100 and at most 1000000 (2e4 is text in '
                "YAML: write 2.0e+4)"
            ),
        ),
        ("surrogate.names", "vgg16", 'surrogate.names = "vgg16": must be a list of labels of surrogates, each once'),
        (
            "surrogate.model",
            1,
            "surrogate.model = 1: must be null or the path of an existing file that ends in .keras, without braces",
        ),
        (
            "report.pictures",
            True,
            "report.pictures = true: must be a list of labels in surrogate.names, each once; [] for no pictures",
        ),
        (
            "report.pictures",
            "off",
            'report.pictures = "off": must be a list of labels in surrogate.names, each once; [] for no pictures',
        ),
        (
            "convergence.slurry",
            1,
            (
                "convergence.slurry = 1: must be text of at most 50 letters, digits and '_' (put it in quotes to "
                "make it text)"
            ),
        ),
        (
            "evaluation.replicated",
            [2],
            (
                "evaluation.replicated[0] = 2: must be text of at most 50 letters, digits and '_' (put it in quotes "
                "to make it text)"
            ),
        ),
    ],
    "no finite numbers": [
        (
            "force_field.granular_hertz.friction",
            NAN,
            "force_field.granular_hertz.friction = NaN: must be a number at least 0 and at most 10",
        ),
        ("dem.pressure_kpa", INF, "dem.pressure_kpa = Infinity: must be a number at least 1 and at most 100000"),
        ("dem.temperature_k", NAN, "dem.temperature_k = NaN: must be a number at least 1 and at most 100000"),
        (
            "relaxation.start_temperature_k",
            -INF,
            "relaxation.start_temperature_k = -Infinity: must be a number at least 1 and at most 10000000",
        ),
        (
            "formulation.unit_mass_pg",
            NAN,
            "formulation.unit_mass_pg = NaN: must be a number above 0 and at most 100000",
        ),
        (
            "convergence.timesteps_us",
            [NAN, 0.001],
            "convergence.timesteps_us[0] = NaN: must be a number at least 1e-05 and at most 0.05",
        ),
    ],
    "negative, zero and out of range": [
        ("formulation.unit_mass_pg", 0, "formulation.unit_mass_pg = 0: must be a number above 0 and at most 100000"),
        (
            "formulation.initial_packing_fraction",
            0.5,
            "formulation.initial_packing_fraction = 0.5: must be a number at least 0.01 and below 0.5",
        ),
        (
            "formulation.phases.NiO.mass_fraction",
            -0.5,
            "formulation.phases.NiO.mass_fraction = -0.5: must be a number above 0 and at most 1",
        ),
        (
            "formulation.phases.NiO.size_classes",
            [],
            "formulation.phases.NiO.size_classes = []: must be a list of at least one size class",
        ),
        (
            "force_field.lennard_jones.cutoff_factor",
            0.9,
            "force_field.lennard_jones.cutoff_factor = 0.9: must be a number at least 1 and at most 10",
        ),
        (
            "force_field.lennard_jones.sigma_factor",
            1.5,
            "force_field.lennard_jones.sigma_factor = 1.5: must be below cutoff_factor = 1.5",
        ),
        (
            "force_field.granular_hertz.friction",
            -0.1,
            "force_field.granular_hertz.friction = -0.1: must be a number at least 0 and at most 10",
        ),
        ("dem.ranks", 0, "dem.ranks = 0: must be a whole number at least 1 and at most 4096"),
        ("dem.budget_min", 0, "dem.budget_min = 0: must be null or a whole number of minutes from 1 to 1000000"),
        ("dem.frames", 1, "dem.frames = 1: must be a whole number at least 2 and at most 100000"),
        ("dem.temperature_k", -300, "dem.temperature_k = -300: must be a number at least 1 and at most 100000"),
        (
            "dem.pressure_damping_us",
            1.0,
            "dem.pressure_damping_us = 1.0: must be a number at least 100 and at most 1000000",
        ),
        (
            "dem.pressure_damping_exponent",
            -3,
            "dem.pressure_damping_exponent = -3: must be a number at least -2 and at most 2",
        ),
        (
            "dem.push_off_iterations",
            0,
            "dem.push_off_iterations = 0: must be a whole number at least 1 and at most 1000000",
        ),
        ("learning.validation_share", 1, "learning.validation_share = 1: must be a number above 0 and below 1"),
        ("learning.seed", 0, "learning.seed = 0: must be a whole number at least 1 and at most 2147483647"),
        (
            "surrogate.packing_fraction",
            1.2,
            "surrogate.packing_fraction = 1.2: must be null or a number above 0 and below 1",
        ),
        (
            "surrogate.early_dem.flat_within",
            0,
            "surrogate.early_dem.flat_within = 0: must be a number above 0 and below 1",
        ),
        (
            "surrogate.vgg16.epochs",
            0,
            "surrogate.vgg16.epochs = 0: must be a whole number at least 1 and at most 1000000",
        ),
        (
            "surrogate.vgg16.batch_size",
            -4,
            "surrogate.vgg16.batch_size = -4: must be a whole number at least 1 and at most 1000000",
        ),
        (
            "relaxation.pressure_damping_us",
            1,
            "relaxation.pressure_damping_us = 1: must be a number at least 100 and at most 100000",
        ),
        (
            "relaxation.start_temperature_k",
            0,
            "relaxation.start_temperature_k = 0: must be a number at least 1 and at most 10000000",
        ),
        (
            "relaxation.start_temperature_k",
            299,
            "relaxation.start_temperature_k = 299: must be at least dem.temperature_k = 300.0, to which it falls",
        ),
        (
            "relaxation.steps_of",
            {"affine_f18": 0},
            "relaxation.steps_of.affine_f18 = 0: must be a whole number at least 1 and at most 2000000000",
        ),
        (
            "relaxation.steps_of",
            {"Affine": 100},
            "relaxation.steps_of.Affine: unknown key: must be the name of a surrogate, or a label with one",
        ),
        (
            "relaxation.steps_of",
            {"affine_f99": 100},
            (
                f'relaxation.steps_of: "affine_f99": must be the name of a surrogate, {SURROGATES}, or a label of this '
                f"run, {NAMES}, {', '.join(load('config')['evaluation']['surrogates'])}"
            ),
        ),
        ("analysis.rdf_bins", 0, "analysis.rdf_bins = 0: must be a whole number at least 1 and at most 1000000"),
        ("evaluation.replicas", 1, "evaluation.replicas = 1: must be a whole number at least 2 and at most 1000"),
        ("evaluation.rdf_tolerance", 0, "evaluation.rdf_tolerance = 0: must be a number above 0 and at most 1000"),
    ],
    "particles, fractions and boxes that cannot be": [
        (
            "formulation.unit_mass_pg",
            170,
            (
                "formulation.unit_mass_pg: slurry T2 ends with a shortest edge of 3.255 um: must be above 3.6 um, "
                "twice the largest cutoff 1.65 (cutoff_factor) and the skin 0.15 (and 2 more slurries)"
            ),
        ),
        (
            "formulation.phases.NiO.size_classes",
            [{"diameter_um": 0.6, "number_fraction": 0.0005}, {"diameter_um": 1.0, "number_fraction": 0.9995}],
            (
                "formulation.unit_mass_pg: slurry 2 of 773.5 pg has no particle of NiO 0.6 um: must be enough mass "
                "for one of each size class (and 17 more slurries)"
            ),
        ),
        (
            "formulation.expected_density_g_cm3",
            0.5,
            (
                "formulation.initial_packing_fraction = 0.2: must be below 0.1482, the packing fraction at "
                "formulation.expected_density_g_cm3, since the box shrinks"
            ),
        ),
        (
            "formulation.expected_density_g_cm3",
            3.5,
            (
                "formulation.expected_density_g_cm3 = 3.5: must be below 3.373, the density of the particles without "
                "space between them"
            ),
        ),
        (
            "formulation.phases.NiO.mass_fraction",
            0.5,
            "formulation.phases: mass fractions sum to 0.98: must be 1 within 1e-06",
        ),
        (
            "formulation.phases.8YSZ.mass_fraction",
            0.36,
            "formulation.phases: mass fractions sum to 1.01: must be 1 within 1e-06",
        ),
        (
            "formulation.phases.NiO.size_classes",
            [{"diameter_um": 0.8, "number_fraction": 0.9}],
            "formulation.phases.NiO.size_classes: number fractions sum to 0.9: must be 1 within 1e-06",
        ),
        (
            "force_field.lennard_jones.cutoff_factor",
            3.0,
            (
                "formulation.unit_mass_pg: slurry T2 ends with a shortest edge of 5.394 um: must be above 6.9 um, "
                "twice the largest cutoff 3.3 (cutoff_factor) and the skin 0.15 (and 3 more slurries)"
            ),
        ),
        (
            "dem.skin_um",
            2.0,
            (
                "formulation.unit_mass_pg: slurry T2 ends with a shortest edge of 5.394 um: must be above 7.3 um, "
                "twice the largest cutoff 1.65 (cutoff_factor) and the skin 2 (and 5 more slurries)"
            ),
        ),
    ],
    "time steps": [
        (
            "dem.timestep_us",
            0.0025,
            (
                "dem.timestep_us = 0.0025: 0.481 of the Rayleigh time 0.005196 us: must be at most 0.002079, "
                "dem.max_rayleigh_share = 0.4 of it"
            ),
        ),
        (
            "dem.impact_speed_um_us",
            10.0,
            (
                "dem.timestep_us = 0.002: 0.166 of the Hertz time 0.01204 us: must be at most 0.001204, "
                "dem.max_hertz_share = 0.1 of it"
            ),
        ),
        (
            "dem.max_rayleigh_share",
            0.2,
            (
                "dem.timestep_us = 0.002: 0.385 of the Rayleigh time 0.005196 us: must be at most 0.001039, "
                "dem.max_rayleigh_share = 0.2 of it"
            ),
        ),
        (
            "force_field.granular_hertz.normal_stiffness_kpa",
            500000.0,
            (
                "dem.timestep_us = 0.002: 0.609 of the Rayleigh time 0.003287 us: must be at most 0.001315, "
                "dem.max_rayleigh_share = 0.4 of it"
            ),
        ),
        (
            "convergence.timesteps_us",
            [0.001, 0.0005],
            "convergence.timesteps_us = [0.001, 0.0005]: must be whole picoseconds (1.0e-6), increasing",
        ),
        (
            "convergence.timesteps_us",
            [0.001, 0.0010005],
            "convergence.timesteps_us = [0.001, 0.0010005]: must be whole picoseconds (1.0e-6), increasing",
        ),
        (
            "convergence.timesteps_us",
            [0.0003, 0.001],
            "convergence.timesteps_us: 0.0003: must divide dem.timestep_us x dem.thermo_every_steps = 1 us",
        ),
        (
            "convergence.timesteps_us",
            [0.001],
            (
                "convergence.timesteps_us = [0.001]: must be a list of at least two time steps from 1.0e-5 to 0.05, "
                "in whole picoseconds (1.0e-6), increasing"
            ),
        ),
    ],
    "steps and frames beyond the run or out of order": [
        ("dem.steps", 60001, "dem.steps = 60001: must be a multiple of dem.frames - 1 = 120"),
        ("dem.thermo_every_steps", 300, "dem.thermo_every_steps = 300: must divide the 500 steps between two frames"),
        ("dem.segment_frames", 121, "dem.segment_frames = 121: must be at most dem.frames - 1 = 120"),
        (
            "dem.restart_frames",
            [1, 2, 4, 7, 8, 9],
            "learning.input_frames: [10] not in dem.restart_frames: must be a restart frame each",
        ),
        (
            "dem.restart_frames",
            [1, 2, 4, 7, 9, 8, 10],
            "dem.restart_frames = [1, 2, 4, 7, 9, 8, 10]: must be strictly increasing",
        ),
        (
            "dem.restart_frames",
            [1, 2, 4, 7, 8, 9, 10, 121],
            "dem.restart_frames = [1, 2, 4, 7, 8, 9, 10, 121]: must be at most dem.frames - 1 = 120",
        ),
        ("dem.restart_frames", [0, 7, 8, 9, 10], "dem.restart_frames[0] = 0: must be a whole number at least 1"),
        ("learning.input_frames", [7, 7, 8], "learning.input_frames = [7, 7, 8]: must be strictly increasing"),
        (
            "learning.input_frames",
            [],
            (
                "learning.input_frames = []: must be a list of at least one frame number, increasing, each one of "
                "dem.restart_frames"
            ),
        ),
        (
            "learning.input_frames",
            [7, 8, 9, 10, 11],
            "learning.input_frames: [11] not in dem.restart_frames: must be a restart frame each",
        ),
        (
            "learning.target_frame",
            10,
            "learning.target_frame = 10: must be after the last input frame 10 and at most dem.frames - 1 = 120",
        ),
        (
            "learning.target_frame",
            121,
            "learning.target_frame = 121: must be after the last input frame 10 and at most dem.frames - 1 = 120",
        ),
    ],
    "surrogates, slurries and phases that do not exist or do not fit": [
        (
            "surrogate.names",
            ["vgg16", "vgg61"],
            f"surrogate.names: 'vgg61' is not known, allowed: {SURROGATES}",
        ),
        (
            "surrogate.names",
            ["vgg16", "neighbours_f00"],
            'surrogate.names: "neighbours_f00": must have at least 2 input frames, it has 1',
        ),
        (
            "surrogate.names",
            ["vgg16", "affine_x2"],
            "surrogate.names: 'affine_x2' is not known: must be affine, and _f<NN> for the last input frame",
        ),
        (
            "surrogate.names",
            ["vgg16", "early_dem"],
            (
                "surrogate.names: 'early_dem' is not known: must be early_dem_ and a variant that matches "
                "x(?P<faster>[1-9]\\d*), and _f<NN> for the last input frame"
            ),
        ),
        (
            "surrogate.names",
            ["vgg16", "vgg16_f02"],
            'surrogate.names: "vgg16_f02": must be vgg16, which learns from learning.input_frames only',
        ),
        (
            "surrogate.names",
            ["vgg16", "affine_f120"],
            'surrogate.names: "affine_f120": its last input frame must be 1 to 119, before the target frame',
        ),
        (
            "surrogate.names",
            ["vgg16", "affine_f00"],
            'surrogate.names: "affine_f00": its last input frame must be 1 to 119, before the target frame',
        ),
        (
            "surrogate.names",
            ["vgg16", "driven_dem_f03"],
            'surrogate.names: "driven_dem_f03" starts at frame 3: must be one of dem.restart_frames',
        ),
        (
            "surrogate.names",
            ["vgg16", "driven_dem_x2"],
            "surrogate.names: 'driven_dem_x2' is not known: must be driven_dem, and _f<NN> for the last input frame",
        ),
        (
            "surrogate.driven_dem.steps",
            0,
            "surrogate.driven_dem.steps = 0: must be a whole number at least 1 and at most 2000000000",
        ),
        (
            "surrogate.neighbours.intermediate_targets",
            [0.4, 0.4],
            "surrogate.neighbours.intermediate_targets = [0.4, 0.4]: "
            "must be a list of numbers above 0 and below 1, each once",
        ),
        (
            "surrogate.neighbours.intermediate_targets",
            [0.6, 0.4],
            "surrogate.neighbours.intermediate_targets = [0.6, 0.4]: must be strictly increasing",
        ),
        (
            "surrogate.neighbours.cutoff_um",
            40,
            (
                "surrogate.neighbours.cutoff_um = 40: must be at most 2.697, half the shortest edge that slurry "
                "T2 ends with"
            ),
        ),
        (
            "surrogate.neighbours.layers",
            3,
            (
                "surrogate.neighbours.intermediate_targets = [0.08, 0.16, 0.25, 0.34, 0.43, 0.52, 0.6, 0.68, 0.75, "
                "0.8...: must "
                "be at most 2, one for each of surrogate.neighbours.layers but the last"
            ),
        ),
        (
            "surrogate.names",
            ["vgg16", "early_dem_x2_f03"],
            'surrogate.names: "early_dem_x2_f03" starts at frame 3: must be one of dem.restart_frames',
        ),
        (
            "surrogate.names",
            ["vgg16", "vgg16"],
            'surrogate.names = ["vgg16", "vgg16"]: must be a list of labels of surrogates, each once',
        ),
        ("evaluation.surrogates", ["affine"], 'evaluation.surrogates: "affine": must not be in surrogate.names too'),
        (
            "evaluation.surrogates",
            ["vgg19"],
            f"evaluation.surrogates: 'vgg19' is not known, allowed: {SURROGATES}",
        ),
        (
            "evaluation.replicated",
            [],
            "evaluation.replicated = []: must be a list of ids of slurries of role validation or test, each once",
        ),
        (
            "report.pictures",
            ["affine_f02"],
            f'report.pictures: "affine_f02": must be one of surrogate.names, {NAMES}',
        ),
        (
            "surrogate.model",
            "model.h5",
            (
                'surrogate.model = "model.h5": must be null or the path of an existing file that ends in .keras, '
                "without braces"
            ),
        ),
        (
            "surrogate.model",
            "none.keras",
            'surrogate.model = "none.keras": no such file: must be null or a trained model.keras',
        ),
        (
            "analysis.rdf_pair",
            ["NiO"],
            ('analysis.rdf_pair = ["NiO"]: must be a list of two phases of formulation.phases, which may be the same'),
        ),
        ("analysis.rdf_pair", ["NiO", "YSZ"], 'analysis.rdf_pair: "YSZ": must be one of BDPD, NiO, 8YSZ'),
    ],
    "units a factor of 1000 off": [
        (
            "formulation.unit_mass_pg",
            773500.0,
            "formulation.unit_mass_pg = 773500.0: must be a number above 0 and at most 100000",
        ),
        (
            "formulation.expected_density_g_cm3",
            2240.0,
            "formulation.expected_density_g_cm3 = 2240.0: must be a number at least 0.1 and at most 30",
        ),
        (
            "formulation.expected_density_g_cm3",
            0.00224,
            "formulation.expected_density_g_cm3 = 0.00224: must be a number at least 0.1 and at most 30",
        ),
        (
            "formulation.phases.NiO.density_g_cm3",
            6670.0,
            "formulation.phases.NiO.density_g_cm3 = 6670.0: must be a number at least 0.01 and at most 30",
        ),
        (
            "formulation.phases.NiO.density_g_cm3",
            0.00667,
            "formulation.phases.NiO.density_g_cm3 = 0.00667: must be a number at least 0.01 and at most 30",
        ),
        (
            "formulation.phases.BDPD.size_classes",
            [{"diameter_um": 1100.0, "number_fraction": 1.0}],
            (
                "formulation.phases.BDPD.size_classes[0].diameter_um = 1100.0: must be a number at least 0.01 and at "
                "most 100"
            ),
        ),
        (
            "formulation.phases.BDPD.size_classes",
            [{"diameter_um": 0.0011, "number_fraction": 1.0}],
            (
                "formulation.phases.BDPD.size_classes[0].diameter_um = 0.0011: must be a number at least 0.01 and at "
                "most 100"
            ),
        ),
        (
            "force_field.lennard_jones.epsilon_fj_per_um",
            1000.0,
            "force_field.lennard_jones.epsilon_fj_per_um = 1000.0: must be a number at least 0 and at most 100",
        ),
        (
            "force_field.granular_hertz.normal_stiffness_kpa",
            200.0,
            (
                "force_field.granular_hertz.normal_stiffness_kpa = 200.0: must be a number at least 1000 and at most "
                "1000000000"
            ),
        ),
        (
            "force_field.granular_hertz.normal_damping_per_um_us",
            30000.0,
            (
                "force_field.granular_hertz.normal_damping_per_um_us = 30000.0: must be a number at least 0 and at "
                "most 10000"
            ),
        ),
        ("dem.timestep_us", 2.0, "dem.timestep_us = 2.0: must be a number at least 1e-05 and at most 1"),
        ("dem.timestep_us", 2e-06, "dem.timestep_us = 2e-06: must be a number at least 1e-05 and at most 1"),
        ("dem.timestep_us", 2000.0, "dem.timestep_us = 2000.0: must be a number at least 1e-05 and at most 1"),
        ("dem.temperature_k", 0.3, "dem.temperature_k = 0.3: must be a number at least 1 and at most 100000"),
        ("dem.temperature_k", 300000.0, "dem.temperature_k = 300000.0: must be a number at least 1 and at most 100000"),
        (
            "dem.temperature_damping_us",
            200.0,
            "dem.temperature_damping_us = 200.0: must be a number at least 0.001 and at most 100",
        ),
        (
            "dem.temperature_damping_us",
            0.0002,
            "dem.temperature_damping_us = 0.0002: must be a number at least 0.001 and at most 100",
        ),
        ("dem.pressure_kpa", 101325.0, "dem.pressure_kpa = 101325.0: must be a number at least 1 and at most 100000"),
        ("dem.pressure_kpa", 0.101325, "dem.pressure_kpa = 0.101325: must be a number at least 1 and at most 100000"),
        (
            "dem.pressure_damping_us",
            20000000.0,
            "dem.pressure_damping_us = 20000000.0: must be a number at least 100 and at most 1000000",
        ),
        (
            "dem.pressure_damping_us",
            20.0,
            "dem.pressure_damping_us = 20.0: must be a number at least 100 and at most 1000000",
        ),
        ("dem.skin_um", 150.0, "dem.skin_um = 150.0: must be a number at least 0.001 and at most 10"),
        ("dem.skin_um", 0.00015, "dem.skin_um = 0.00015: must be a number at least 0.001 and at most 10"),
        (
            "dem.impact_speed_um_us",
            100.0,
            "dem.impact_speed_um_us = 100.0: must be a number at least 0.001 and at most 10",
        ),
        (
            "dem.impact_speed_um_us",
            0.0001,
            "dem.impact_speed_um_us = 0.0001: must be a number at least 0.001 and at most 10",
        ),
        (
            "relaxation.pressure_damping_us",
            200000.0,
            "relaxation.pressure_damping_us = 200000.0: must be a number at least 100 and at most 100000",
        ),
        (
            "relaxation.pressure_damping_us",
            0.2,
            "relaxation.pressure_damping_us = 0.2: must be a number at least 100 and at most 100000",
        ),
        (
            "relaxation.start_temperature_k",
            30000000.0,
            "relaxation.start_temperature_k = 30000000.0: must be a number at least 1 and at most 10000000",
        ),
        (
            "relaxation.start_temperature_k",
            30.0,
            "relaxation.start_temperature_k = 30.0: must be at least dem.temperature_k = 300.0, to which it falls",
        ),
        (
            "analysis.rdf_cutoff_um",
            7000.0,
            "analysis.rdf_cutoff_um = 7000.0: must be a number at least 0.1 and at most 1000",
        ),
        (
            "analysis.rdf_cutoff_um",
            0.007,
            "analysis.rdf_cutoff_um = 0.007: must be a number at least 0.1 and at most 1000",
        ),
        (
            "evaluation.perturbation_um",
            0.001,
            "evaluation.perturbation_um = 0.001: must be a number at least 1e-08 and at most 0.0001",
        ),
        (
            "evaluation.perturbation_um",
            1e-09,
            "evaluation.perturbation_um = 1e-09: must be a number at least 1e-08 and at most 0.0001",
        ),
        (
            "convergence.timesteps_us",
            [0.001, 2.0],
            "convergence.timesteps_us[1] = 2.0: must be a number at least 1e-05 and at most 0.05",
        ),
        (
            "convergence.timesteps_us",
            [2e-06, 0.001],
            "convergence.timesteps_us[0] = 2e-06: must be a number at least 1e-05 and at most 0.05",
        ),
    ],
}

# the table, the line
BAD_TABLES = [
    ("", ("s.tsv line 1: nothing: must be the columns id, role, mass_units, thickness_ratio, seed, separated by tabs")),
    (HEADER, "s.tsv: no slurries: must be at least one row below the column names"),
    (
        HEADER.replace("\t", ","),
        (
            's.tsv line 1: "id,role,mass_units,thickness_ratio,seed": must be the columns id, role, mass_units, '
            "thickness_ratio, seed, separated by tabs"
        ),
    ),
    (
        HEADER.replace("seed", "seed\tnote"),
        (
            's.tsv line 1: "id\\trole\\tmass_units\\tthickness_ratio\\tseed\\tnote": must be the columns id, role, '
            "mass_units, thickness_ratio, seed, separated by tabs"
        ),
    ),
    (
        HEADER.replace("\tseed", ""),
        (
            's.tsv line 1: "id\\trole\\tmass_units\\tthickness_ratio": must be the columns id, role, mass_units, '
            "thickness_ratio, seed, separated by tabs"
        ),
    ),
    (
        HEADER.replace("seed", "id"),
        (
            's.tsv line 1: "id\\trole\\tmass_units\\tthickness_ratio\\tid": must be the columns id, role, '
            "mass_units, thickness_ratio, seed, separated by tabs"
        ),
    ),
    (
        HEADER.replace("mass_units", "mass_pg"),
        (
            's.tsv line 1: "id\\trole\\tmass_pg\\tthickness_ratio\\tseed": must be the columns id, role, mass_units, '
            "thickness_ratio, seed, separated by tabs"
        ),
    ),
    (HEADER + "T1\ttrain\t1\t1\n", "s.tsv line 2: 4 cells: must be 5, separated by tabs"),
    (HEADER + "T1 train 1 1 1\n", "s.tsv line 2: 1 cells: must be 5, separated by tabs"),
    (
        HEADER + "T 1\ttrain\t1\t1\t1\n",
        "s.tsv line 2: id = \"T 1\": must be text of at most 50 letters, digits and '_', once in the table",
    ),
    (
        HEADER + "../x\ttrain\t1\t1\t1\n",
        "s.tsv line 2: id = \"../x\": must be text of at most 50 letters, digits and '_', once in the table",
    ),
    (
        HEADER + "\ttrain\t1\t1\t1\n",
        "s.tsv line 2: id = \"\": must be text of at most 50 letters, digits and '_', once in the table",
    ),
    (HEADER + "T1\tTrain\t1\t1\t1\n", 's.tsv line 2: role = "Train": must be one of train, validation, test, new'),
    (HEADER + "T1\ttrian\t1\t1\t1\n", 's.tsv line 2: role = "trian": must be one of train, validation, test, new'),
    (HEADER + "T1\ttrain\tone\t1\t1\n", 's.tsv line 2: mass_units = "one": must be a number above 0 and at most 100'),
    (HEADER + "T1\ttrain\tnan\t1\t1\n", 's.tsv line 2: mass_units = "nan": must be a number above 0 and at most 100'),
    (
        HEADER + "T1\ttrain\t1e999\t1\t1\n",
        "s.tsv line 2: mass_units = Infinity: must be a number above 0 and at most 100",
    ),
    (HEADER + "T1\ttrain\t1,5\t1\t1\n", 's.tsv line 2: mass_units = "1,5": must be a number above 0 and at most 100'),
    (HEADER + "T1\ttrain\t-1\t1\t1\n", "s.tsv line 2: mass_units = -1.0: must be a number above 0 and at most 100"),
    (HEADER + "T1\ttrain\t0\t1\t1\n", "s.tsv line 2: mass_units = 0.0: must be a number above 0 and at most 100"),
    (HEADER + "T1\ttrain\t773.5\t1\t1\n", "s.tsv line 2: mass_units = 773.5: must be a number above 0 and at most 100"),
    (
        HEADER + "T1\ttrain\t1\t-1\t1\n",
        "s.tsv line 2: thickness_ratio = -1.0: must be a number at least 0.01 and at most 100",
    ),
    (
        HEADER + "T1\ttrain\t1\t1000\t1\n",
        "s.tsv line 2: thickness_ratio = 1000.0: must be a number at least 0.01 and at most 100",
    ),
    (
        HEADER + "T1\ttrain\t1\t0.001\t1\n",
        "s.tsv line 2: thickness_ratio = 0.001: must be a number at least 0.01 and at most 100",
    ),
    (
        HEADER + "T1\ttrain\t1\t1\t0\n",
        "s.tsv line 2: seed = 0: must be a whole number from 1 to 2147483647, once in the table",
    ),
    (
        HEADER + "T1\ttrain\t1\t1\t1.5\n",
        's.tsv line 2: seed = "1.5": must be a whole number from 1 to 2147483647, once in the table',
    ),
    (
        HEADER + "T1\ttrain\t1\t1\t2147483648\n",
        "s.tsv line 2: seed = 2147483648: must be a whole number from 1 to 2147483647, once in the table",
    ),
    (HEADER + "A\ttest\t1\t1\t1\n\nA\ttest\t1\t1\t2\n", 's.tsv line 4: id = "A": must differ from line 2'),
    (HEADER + "A\ttest\t1\t1\t5\nB\ttest\t1\t1\t5\n", "s.tsv line 3: seed = 5: must differ from line 2"),
    (
        HEADER + "A\ttrain\t1\t1\t1\nB\tvalidation\t1\t1\t2\n",
        "s.tsv: no slurry of role test or new: must be at least one",
    ),
    (
        HEADER + "A\tnew\t1\t1\t1\n",
        "s.tsv: no slurry of role train: must be at least one unless surrogate.model is given",
    ),
    (
        HEADER + "6_r1\ttrain\t1\t1\t1\n6\ttest\t1\t1\t2\n",
        "evaluation.replicated: its run 6_r1 is named like a slurry of the table: rename that slurry",
    ),
    (
        HEADER + f"T1\ttrain\t1\t1\t{'9' * 5000}\n",
        (
            's.tsv line 2: seed = "99999999999999999999999999999999999999999999999999999999...: must be a whole '
            "number from 1 to 2147483647, once in the table"
        ),
    ),
    (
        HEADER + "A\ttest\t1\t1\t" + "5" * 200_000,
        "s.tsv line 2: field larger than field limit (131072): must be cells separated by tabs",
    ),
]


@pytest.fixture
def in_empty_project(tmp_path, monkeypatch):
    """A working directory with the shipped slurry tables and no results."""
    copy_tables(tmp_path)
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize(("path", "value", "line"), [row for rows in BAD_VALUES.values() for row in rows])
@pytest.mark.usefixtures("in_empty_project")
def test_bad_value(path, value, line):
    assert check(merged(load("config"), nested(path, value))) == [line]


@pytest.mark.parametrize("path", ["report", "dem.steps", "formulation.phases.8YSZ.density_g_cm3", "surrogate.vgg16"])
@pytest.mark.usefixtures("in_empty_project")
def test_missing_key(path):
    config = load("config")
    *sections, key = path.split(".")
    place = config
    for section in sections:
        place = place[section]
    del place[key]
    (line,) = (line for line in check(config) if line.startswith(path))
    assert line.startswith(f"{path}: missing: must be a")


@pytest.mark.parametrize(("text", "line"), BAD_TABLES)
@pytest.mark.usefixtures("in_empty_project")
def test_bad_table(text, line):
    Path("s.tsv").write_text(text, encoding="utf-8")
    assert check(load("config") | {"slurries": "s.tsv"}) == [line]


@pytest.mark.parametrize(
    ("path", "reason"),
    [
        ("missing.tsv", "No such file or directory"),
        ("config", "Is a directory"),
        ("x" * 5000, "File name too long"),
        ("utf16.tsv", "'utf-8' codec can't decode byte 0xff in position 0: invalid start byte"),
    ],
)
@pytest.mark.usefixtures("in_empty_project")
def test_table_that_is_no_text_or_no_file(path, reason):
    Path("utf16.tsv").write_text(HEADER, encoding="utf-16")
    assert check(load("config") | {"slurries": path}) == [f"{path}: cannot be read: {reason}"]


# ---- units: every quantity, in every shipped configuration


def quantities(value: object, rule: dict, path: tuple = ()) -> Iterator[tuple[tuple, float, dict]]:
    """Yield (path, value, schema) of every number that has a unit."""
    if isinstance(value, dict):
        for key, item in value.items():
            below = rule.get("properties", {}).get(key) or next(iter(rule["patternProperties"].values()))
            yield from quantities(item, below, (*path, key))
    elif isinstance(value, list):
        for index, item in enumerate(value):
            yield from quantities(item, rule["items"], (*path, index))
    elif "unit" in rule and rule["type"] == "number":
        yield path, value, rule


@pytest.mark.parametrize("factor", [1e3, 1e-3])
@pytest.mark.parametrize("scale", ["config", *SCALES])
@pytest.mark.usefixtures("in_empty_project")
def test_no_quantity_passes_in_a_unit_a_factor_of_1000_off(scale, factor):
    """The line names the key, but for a stiffness: what no longer fits is the time step."""
    found = list(quantities(shipped(scale), configuration.schema("config")))
    assert {"um", "us", "K", "kPa", "pg", "g/cm3"} < {rule["unit"] for _, _, rule in found}
    for path, value, rule in found:
        if factor < 1 and rule.get("minimum") == 0:
            continue  # a force may also be absent
        config = shipped(scale)
        place = config
        for key in path[:-1]:
            place = place[key]
        place[path[-1]] = value * factor
        name = next(key for key in reversed(path) if isinstance(key, str))
        named = "dem.timestep_us" if (name, factor) == ("normal_stiffness_kpa", 1e3) else name
        lines = check(config)
        assert lines and named in lines[0].partition("=")[0], (path, value, lines)


@pytest.mark.parametrize(("column", "values"), [("mass_units", (1e3, 1e-3)), ("thickness_ratio", (1e3, 1e-3))])
@pytest.mark.usefixtures("in_empty_project")
def test_no_column_passes_a_factor_of_1000_off(column, values):
    for value in values:
        row = {"id": "A", "role": "train", "mass_units": 1, "thickness_ratio": 1, "seed": 1} | {column: value}
        Path("s.tsv").write_text(HEADER + "\t".join(map(str, row.values())) + "\nB\ttest\t1\t1\t2\n")
        assert check(load("config") | {"slurries": "s.tsv"}), value


# ---- text that a shell, a formatter or a terminal would take for more than text

HOSTILE = [
    *("$(touch x)", "`touch x`", "; touch x", "x; rm -rf .", "| touch x", "&& touch x", "> x", "a b", " ", "*", "~"),
    *("it's", '"quoted"', "back\\slash", "two\nlines", "tab\there", "\x1b[2J", "nul\0", "größe", "\ud800", "x" * 5000),
    *("--help", "-x", "../x", "/x", "{slurry}", "{config}", "{{x}}", "%s", "${HOME}", "__import__('os')", ""),
]
LEGAL = {"run.name": {"--help", "-x"}}  # as a name behind results/
# What may be any text, since it is a path or a command; that it stays quoted is tested in workflow/test_quoting.py.
ANY_TEXT = {"slurries", "dem.executable", "dem.launcher", "surrogate.model"}


def texts(rule: dict, path: str = "") -> Iterator[str]:
    """Paths of all keys whose value is text; `[]` of an item of a list, `<name>` of a key that one may choose."""
    if rule["type"] == "object":
        for key, item in rule.get("properties", {}).items():
            yield from texts(item, f"{path}.{key}".lstrip("."))
        for item in rule.get("patternProperties", {}).values():
            yield f"{path}.<name>"
            yield from texts(item, f"{path}.NiO")
    elif rule["type"] == "array":
        yield from texts(rule["items"], f"{path}[]")
    elif "string" in rule["type"]:
        yield path


TEXTS = list(texts(configuration.schema("config")))


def test_all_texts_are_found():
    assert {*ANY_TEXT, "run.name", "formulation.phases.<name>", "surrogate.names[]", "evaluation.replicated[]"} < set(
        TEXTS
    )


@pytest.mark.parametrize("path", TEXTS)
@pytest.mark.usefixtures("in_empty_project")
def test_hostile_text_is_refused_or_may_be_any_text(path):
    passed = []
    for text in HOSTILE:
        section = path.removesuffix(".<name>")
        if section != path:
            override = nested(section, {text: load("config")["formulation"]["phases"]["NiO"]})
        else:
            override = nested(path.removesuffix("[]"), [text] if path.endswith("[]") else text)
        lines = check(merged(load("config"), override))
        assert all(line.isprintable() for line in lines), lines
        if not lines:
            passed.append(text)
    assert not set(passed) - LEGAL.get(path, set()) or path in ANY_TEXT


@pytest.mark.parametrize("column", ["id", "role"])
@pytest.mark.usefixtures("in_empty_project")
def test_hostile_text_in_the_slurry_table_is_refused(column):
    for text in set(HOSTILE) - {'"quoted"'}:  # quotes around a cell are taken off
        row = {"id": "A", "role": "test", "mass_units": "1", "thickness_ratio": "1", "seed": "1"} | {column: text}
        table = HEADER + "\t".join(row.values()) + "\nB\ttrain\t1\t1\t2\n"
        Path("s.tsv").write_text(table, encoding="utf-8", errors="surrogateescape" if text != "\ud800" else "replace")
        lines = check(load("config") | {"slurries": "s.tsv"})
        assert lines, text
        assert all(line.isprintable() for line in lines), lines


# ---- through Snakemake


@pytest.fixture(scope="module")
def project(tmp_path_factory) -> Path:
    """A checkout, and in it a slurry that was run with another time step under the name tiny."""
    folder = copy_checkout(tmp_path_factory.mktemp("a bäd project"))
    config = shipped("tiny")
    config["dem"]["timestep_us"] = 0.001
    run = folder / "results" / "tiny" / "dem" / "T1" / "run.json"
    run.parent.mkdir(parents=True)
    run.write_text(json.dumps({"physics": physics(config, read_slurries(ROOT / "config" / "slurries_tiny.tsv")[0])}))
    return folder


SAME_NAME = (
    "results/tiny: the DEM of slurry T1 was run with dem.timestep_us = 0.001, the configuration has 0.002: choose "
    "another run.name, or set run.overwrite: true to compute it anew"
)


@pytest.mark.parametrize(
    ("override", "table", "line"),
    [
        *((nested(path, value), None, line) for ((path, value, line), *_) in BAD_VALUES.values()),
        *(({"slurries": "s.tsv"}, text, line) for text, line in (BAD_TABLES[7], BAD_TABLES[27])),
        (shipped("tiny"), None, SAME_NAME),
    ],
    ids=[*BAD_VALUES, "table", "duplicate id", "results of another recipe"],
)
def test_snakemake_says_the_line_before_any_job(project, override, table, line):
    if table is not None:
        (project / "s.tsv").write_text(table)
    (project / "bad.yaml").write_text(yaml.safe_dump(override, allow_unicode=True, sort_keys=False))
    before = sorted(path for path in project.rglob("*") if ".snakemake" not in path.parts)
    said = snakemake(project, "--configfile", "bad.yaml", fails=True)  # no dry run: nothing may start
    assert f"\n{line}\nNothing was run.\n" in said
    assert re.search("Traceback|jobs? to be|rule ", said) is None
    assert sorted(path for path in project.rglob("*") if ".snakemake" not in path.parts) == before
