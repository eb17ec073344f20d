"""Tabulate the effect of each change from the published network to `vgg16_box`.

In: the training set (HDF5), learning curves (CSV) and the table of skill (CSV).
Out: a table (CSV), one row for each network and one for `affine`, which is not trained:
    target, coordinates, box    what it is asked for, in which coordinates it sees particles, whether it sees the box
    standardised                whether inputs and target are standardised by the training samples
    epochs                      trained for; those of the published network are configured on their own
    best_val_loss_um2           of the particles held out of the training slurries, in the true final box but for vgg16;
                                for `affine` the same error of the same particles
    best_epoch                  with that loss
    validation_mse_um2, test_mse_um2, validation_skill, test_skill
                                means over the slurries of that role in the table of skill; empty where there is none
"""

import json
from pathlib import Path

import numpy as np
import pandas as pd

from slurrycast import surrogates
from slurrycast.data.dataset import TrainingSet, read_training_set
from slurrycast.data.tables import read_table, write_table
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.files import InputError
from slurrycast.surrogates import vgg16_box

ROLES = ("validation", "test")
COLUMNS = (
    *("surrogate", "target", "coordinates", "box", "standardised", "epochs", "best_val_loss_um2", "best_epoch"),
    *(f"{role}_{quantity}" for quantity in ("mse_um2", "skill") for role in ROLES),
)


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_value("--surrogates", "labels of vgg16 and vgg16_box, in rows' order", nargs="+")
    parser.add_input("--histories", "learning curves (CSV), one for each of them", nargs="+")
    parser.add_input("--dataset", "training set (HDF5)")
    parser.add_tables("skill")
    parser.add_value("--roles", "JSON: role of each slurry in the table of skill", type=json.loads)
    parser.add_output("--table", "table of the ablation (CSV)")
    parser.one_each("surrogates", "histories")


def words(label: str) -> dict[str, str]:
    """What the network of a label is fed and asked, as the table says it. InputError if it is not of the ablation."""
    parsed = surrogates.parse(label)
    if parsed.name == "vgg16_box":
        change = parsed.settings.get("change")
        return {
            "target": "absolute" if change == "absolute" else "displacement",
            "coordinates": "xu" if change == "xu" else "scaled",
            "box": "no" if change == "nobox" else "yes",
            "standardised": "yes",
        }
    if parsed.name != "vgg16":
        raise InputError(f"--surrogates: {label} is not part of the ablation, allowed: vgg16 and vgg16_box")
    change = parsed.settings.get("change")
    return {
        "target": "absolute",
        "coordinates": "relative" if change == "relative" else "xu",
        "box": "no",
        "standardised": "yes" if change == "standardised" else "no",
    }


def training(path: Path) -> dict[str, float]:
    """Epochs of learning curves, their lowest validation loss and its epoch; nothing if they have no rows."""
    history = read_table(path)
    if history.empty:
        return {}
    best = history.loc[history.val_loss.idxmin()]
    return {"epochs": len(history), "best_val_loss_um2": best.val_loss, "best_epoch": int(best.epoch)}


def affine_loss_um2(training_set: TrainingSet) -> float:
    """Mean squared error of the affine prediction in the true final box, of the validation samples."""
    displacement_um = vgg16_box.samples(training_set).targets
    return float(np.mean(displacement_um[training_set.is_validation] ** 2))


def held_out(skill: pd.DataFrame, label: str, roles: dict[str, str]) -> dict[str, float]:
    """Means over the slurries of each role. InputError if the table has no row of the label."""
    skills = skill[skill.surrogate == label]
    if skills.empty:
        raise InputError(f"tables/skill.csv: has no row of {label}")
    if unknown := sorted(set(skills.slurry) - set(roles)):
        raise InputError(f"--roles: slurry {', '.join(unknown)} has none")
    means = skills.groupby(skills.slurry.map(roles))[["mse_um2", "skill"]].mean().reindex(ROLES)
    return {f"{role}_{quantity}": means.at[role, quantity] for quantity in means for role in ROLES}


def main(args: Namespace) -> None:
    """Tabulate and write."""
    skill = read_table(args.skill)
    rows = [
        {"surrogate": label} | words(label) | training(path) | held_out(skill, label, args.roles)
        for label, path in zip(args.surrogates, args.histories, strict=True)
    ]
    affine = {"target": "-", "coordinates": "scaled", "box": "yes", "standardised": "-"}
    loss = {"best_val_loss_um2": affine_loss_um2(read_training_set(args.dataset))}
    rows.append({"surrogate": "affine"} | affine | loss | held_out(skill, "affine", args.roles))
    table = pd.DataFrame(rows, columns=COLUMNS).astype({"epochs": "Int64", "best_epoch": "Int64"})
    write_table(args.table, table)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
