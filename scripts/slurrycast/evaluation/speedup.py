"""The cost of the hybrid chain for one slurry, end to end, against the full DEM and the DEM up to equilibrium.

A user who has a new slurry pays for all of HYBRID_PARTS; the DEM that they replace needs the inputs as well. Costs that
are paid once, those of the training and of the DEM of the training slurries, are counted separately (`scaling`).
The relaxed slurries of `direct` that give the packing fraction of a recipe without training slurries are not counted.
"""

import argparse
import json
from collections.abc import Collection, Iterable, Mapping
from dataclasses import asdict
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd

from slurrycast.evaluation.power_law import power_law
from slurrycast.runtime.command_line import Parser
from slurrycast.runtime.costs import read_cost
from slurrycast.runtime.files import InputError

# parts of a hybrid run in the order of the workflow: stage in the cost table, name in figures and tables
HYBRID_PARTS = {
    "generate_inputs": "inputs",
    "run_slurry_to_input": "DEM to the last input frame",
    "extract_frames": "features",
    "predict_slurry": "prediction",
    "wrap_slurry": "wrapping",
    "relax_slurry": "relaxation",
}
# what follows for a tape, from either way to the slurry
TAPE_PARTS = {"dry_slurry": "drying", "measure_microstructure": "measures"}
# of all training slurries together
DATASET_STAGES = ("assemble_dataset", "measure_packing")
TRAINING_STAGES = ("train_surrogate", "fit_surrogate")
TRAINING_SLURRY_STAGES = ("generate_inputs", "run_slurry", "extract_frames")
FEWEST_TO_FIT, SPAN_TO_FIT = 3, 2.0  # slurries, and largest over smallest number of particles, for an exponent


def label_and_steps(text: str) -> tuple[str, int]:
    """Read `label=steps` of a command line: the DEM step of a surrogate's last input frame."""
    label, _, steps = text.partition("=")
    if not label or not steps.isdecimal():
        raise argparse.ArgumentTypeError(f"{text!r}: must be label=steps, such as affine_f02=1000")
    return label, int(steps)


def add_dem_runs(parser: Parser) -> None:
    """Add the options that `compare_costs` needs beside the costs."""
    parser.add_tables("equilibrium")
    parser.add_input("--run-json", "run.json of the slurries that have a DEM", nargs="*")
    parser.add_argument(
        "--input-steps",
        nargs="+",
        type=label_and_steps,
        required=True,
        metavar="LABEL=STEPS",
        help="DEM step of the last input frame of every surrogate",
    )


def read_costs(paths: Iterable[Path]) -> pd.DataFrame:
    """Cost records (JSON) as rows of tables/cost.csv."""
    return pd.DataFrame([asdict(read_cost(path)) for path in paths])


def read_by_slurry(paths: Iterable[Path]) -> dict[str, dict]:
    """Content of JSON files by the slurry that each names."""
    contents = [json.loads(path.read_text(encoding="utf-8")) for path in paths]
    return {content["slurry"]: content for content in contents}


def dem_seconds(run: Mapping, steps: float, clock: str = "wall_s") -> float:
    """Seconds that LAMMPS spent on a DEM run up to a step, push-off and every start included.

    Parameters
    ----------
    run
        Content of run.json.
    steps
        The step; a segment that continues beyond it counts by its share of steps.
    clock
        wall_s or cpu_s.
    """
    seconds = run["start"][clock]
    for segment in run["segments"]:
        first, last = segment["step_start"], segment["step_end"]
        seconds += segment[clock] * min(max((steps - first) / (last - first), 0.0), 1.0)
    return seconds


def extraction_seconds(recorded_s: float, smallest_s: float, run: Mapping, steps: int) -> float:
    """Upper bound of the seconds that the extraction of the frames up to a step takes.

    Parameters
    ----------
    recorded_s
        Seconds that the extraction of all frames took.
    smallest_s
        Seconds of the cheapest extraction of the run: an upper bound of the start-up of the program, which is not
        recorded.
    run, steps
        Content of run.json, and the step. Their share of the frames is added to the start-up.
    """
    frames = run["frames_written"]
    share = ((frames - 1) * steps / run["steps"] + 1) / frames
    return min(recorded_s, smallest_s + share * recorded_s)


def compare_costs(
    costs: pd.DataFrame,
    equilibrium: pd.DataFrame,
    runs: Mapping[str, Mapping],
    input_steps: Mapping[str, int],
    clock: str = "wall_s",
) -> pd.DataFrame:
    """Seconds of each part of the hybrid chain and of the DEM.

    Parameters
    ----------
    costs
        Rows of tables/cost.csv.
    equilibrium
        tables/equilibrium.csv, of the slurries that have a DEM.
    runs
        Content of run.json by slurry, of the same.
    input_steps
        DEM step of the last input frame by surrogate; 0 for one that takes nothing from the DEM.
    clock
        wall_s or cpu_s.

    Returns
    -------
    One row for each surrogate and slurry that went through the hybrid chain, in the order of `costs`, with the columns
    surrogate, slurry, clock, particles, one for each stage of HYBRID_PARTS, hybrid (their sum), dem (full run, inputs
    included), dem_to_equilibrium (the same), ratio (dem / hybrid) and ratio_to_equilibrium; and of the tape, the stages
    of TAPE_PARTS, hybrid_to_tape and dem_to_tape (all up to its measures), and ratio_to_tape. dem and ratio are
    NaN for slurries of role new, whose DEM is not run to the end or not at all; dem_to_equilibrium and
    ratio_to_equilibrium are NaN for these too, and for slurries with a warning, which are not in equilibrium at their
    end. What belongs to tapes is NaN where the slurry was not dried.

    Raises
    ------
    InputError
        If a cost or a step is missing.
    """
    rows, ends = [], {end.slurry: end for end in equilibrium.itertuples()}
    smallest_extraction_s = costs.loc[costs.stage == "extract_frames", clock].min()
    for surrogate, relaxed in costs[costs.stage == "relax_slurry"].groupby("surrogate", sort=False):
        if surrogate not in input_steps:
            raise InputError(f"surrogate {surrogate}: no step of the last input frame is given for it")
        for slurry, particles in zip(relaxed.slurry, relaxed.particles.astype(int), strict=True):
            run, end, steps = runs.get(slurry), ends.get(slurry), input_steps[surrogate]
            records = costs[(costs.slurry == slurry) & costs.surrogate.isin(["-", surrogate])]
            seconds = dict(records.groupby("stage")[clock].sum())
            if not steps:
                seconds |= {"run_slurry_to_input": 0.0, "extract_frames": 0.0}
            elif run and "extract_frames" in seconds:
                seconds["run_slurry_to_input"] = dem_seconds(run, steps, clock)
                recorded_s = seconds["extract_frames"]
                seconds["extract_frames"] = extraction_seconds(recorded_s, smallest_extraction_s, run, steps)
            if missing := [part for part in HYBRID_PARTS if part not in seconds]:
                raise InputError(f"surrogate {surrogate}, slurry {slurry}: no cost of {', '.join(missing)}")
            row = {"surrogate": surrogate, "slurry": slurry, "clock": clock, "particles": particles}
            row |= {part: float(seconds[part]) for part in HYBRID_PARTS}
            row |= {"hybrid": sum(row[part] for part in HYBRID_PARTS), "dem": np.nan, "dem_to_equilibrium": np.nan}
            if end and end.role != "new":
                row["dem"] = row["generate_inputs"] + dem_seconds(run, run["steps"], clock)
            if end and not np.isnan(end.time_to_equilibrium_us) and not end.warning:
                settled = run["steps"] * end.time_to_equilibrium_us / end.run_time_us
                row["dem_to_equilibrium"] = row["generate_inputs"] + dem_seconds(run, settled, clock)
            tapes = costs[(costs.slurry == slurry) & costs.stage.isin(TAPE_PARTS)].pivot_table(
                clock, "surrogate", "stage", "sum"
            )
            of_tape, of_dem_tape = (
                tapes.reindex([label], columns=list(TAPE_PARTS)).iloc[0] for label in (surrogate, "-")
            )
            row |= {part: float(of_tape[part]) for part in TAPE_PARTS}
            row["hybrid_to_tape"] = row["hybrid"] + sum(of_tape)
            row["dem_to_tape"] = row["dem"] + sum(of_dem_tape)
            row["ratio_to_tape"] = row["dem_to_tape"] / row["hybrid_to_tape"]
            row["ratio"] = row["dem"] / row["hybrid"]
            row["ratio_to_equilibrium"] = row["dem_to_equilibrium"] / row["hybrid"]
            rows.append(row)
    return pd.DataFrame(rows)


def exponent(particles: np.ndarray, seconds: np.ndarray) -> tuple[float, float]:
    """Exponent b of seconds = a particles^b, and its standard error.

    Parameters
    ----------
    particles, seconds
        Number of particles and cost of each slurry, (slurries,).

    Returns
    -------
    As `power_law`; both NaN for less than FEWEST_TO_FIT slurries, or sizes that span less than SPAN_TO_FIT, where an
    exponent would be noise.
    """
    if len(particles) < FEWEST_TO_FIT or np.max(particles) < SPAN_TO_FIT * np.min(particles):
        return np.nan, np.nan
    return power_law(particles, seconds)


def slurries_to_pay(spent_s: float, saved_s: float) -> float:
    """Number of slurries, whole, after which `saved_s` each have paid back `spent_s`; NaN if nothing is saved."""
    if spent_s == 0:
        return 0.0
    return float(np.ceil(spent_s / saved_s)) if saved_s > 0 else np.nan


def training_seconds(costs: pd.DataFrame, surrogate: str, clock: str) -> float:
    """Seconds that `surrogate` was trained or fitted, 0 if `costs` hold none."""
    return float(costs[(costs.surrogate == surrogate) & costs.stage.isin(TRAINING_STAGES)][clock].sum())


def training_dem_seconds(costs: pd.DataFrame, training: Collection[str], clock: str) -> float:
    """Seconds that the training slurries took, from their inputs to the training set.

    Parameters
    ----------
    costs
        Cost records.
    training, clock
        The training slurries, and wall_s or cpu_s.

    Raises
    ------
    InputError
        If a record is missing.
    """
    records = costs[costs.stage.isin(TRAINING_SLURRY_STAGES)]
    recorded = set(zip(records.slurry, records.stage, strict=True))
    for slurry, stage in product(training, TRAINING_SLURRY_STAGES):
        if (slurry, stage) not in recorded:
            raise InputError(f"training slurry {slurry}: no cost of {stage}")
    paid = records[records.slurry.isin(training)][clock].sum()
    return float(paid + costs.loc[costs.stage.isin(DATASET_STAGES), clock].sum())


def scaling(
    speedup: pd.DataFrame,
    costs: pd.DataFrame,
    roles: Mapping[str, str],
    learns_from_dem: Collection[str],
    trained_elsewhere: Collection[str] = (),
) -> pd.DataFrame:
    """How costs grow with size, and when the training is paid back.

    Parameters
    ----------
    speedup
        Rows of `compare_costs`.
    costs
        Cost records.
    roles
        Role of each slurry.
    learns_from_dem
        The surrogates that need the training slurries.
    trained_elsewhere
        The surrogates that were trained elsewhere, at least at first: what that took is not known.

    Returns
    -------
    One row for each surrogate and clock of `speedup` with the columns surrogate, clock, slurries (those with a full
    DEM, over which exponents are taken), fewest_particles, most_particles, hybrid_exponent and dem_exponent, each with
    its standard error (_se), training_s and training_dem_s (both NaN for those trained elsewhere),
    saved_s_per_slurry (median of dem - hybrid over those of role test), slurries_to_pay_training and
    slurries_to_pay_training_and_dem.
    """
    training = [slurry for slurry, role in roles.items() if role == "train"]
    rows = []
    for (surrogate, clock), compared in speedup.dropna(subset=["dem"]).groupby(["surrogate", "clock"], sort=False):
        training_s = np.nan if surrogate in trained_elsewhere else training_seconds(costs, surrogate, clock)
        dem_s = 0.0
        if surrogate in learns_from_dem:
            dem_s = np.nan if np.isnan(training_s) else training_dem_seconds(costs, training, clock)
        test = compared[compared.slurry.map(roles) == "test"]
        saved_s = float((test.dem - test.hybrid).median())
        row = {
            "surrogate": surrogate,
            "clock": clock,
            "slurries": len(compared),
            "fewest_particles": compared.particles.min(),
            "most_particles": compared.particles.max(),
        }
        for name in ("hybrid", "dem"):
            fit = exponent(compared.particles.to_numpy(), compared[name].to_numpy())
            row[f"{name}_exponent"], row[f"{name}_exponent_se"] = fit
        row |= {
            "training_s": training_s,
            "training_dem_s": dem_s,
            "saved_s_per_slurry": saved_s,
            "slurries_to_pay_training": slurries_to_pay(training_s, saved_s),
            "slurries_to_pay_training_and_dem": slurries_to_pay(training_s + dem_s, saved_s),
        }
        rows.append(row)
    return pd.DataFrame(rows)


def time_unit(longest_s: float) -> tuple[float, str]:
    """Seconds in a fitting unit for times up to `longest_s`, and the unit's name."""
    for length_s, name in ((3600.0, "h"), (60.0, "min")):
        if longest_s > 3 * length_s:
            return length_s, name
    return 1.0, "s"
