"""Tables of docs/neighbours.md: each public function gives one, as a frame of texts."""

import math

import pandas as pd

from reference_results import by_slurry, growth, read_result


def neighbours_uncertainty() -> pd.DataFrame:
    """What the calibrated intervals cover, and how the spread ranks the errors of particles."""
    rows = read_result("small", "uncertainty").query("surrogate == 'neighbours' and role == 'test'")
    values = {f"coverage of the {level:.0%} intervals": group for level, group in rows.groupby("level").coverage}
    values["rank correlation of spread and error"] = rows.rank_correlation
    return pd.DataFrame(
        {
            "quantity": name,
            "mean": f"{group.mean():.3f}",
            "least": f"{group.min():.3f}",
            "greatest": f"{group.max():.3f}",
        }
        for name, group in values.items()
    )


def cost_growth_small() -> pd.DataFrame:
    """Growth of cost with networks that learned from small slurries."""
    return growth("small", "affine", "neighbours", "driven_dem")


def neighbours_tolerances() -> pd.DataFrame:
    """What was set before as the least to reach, and what was reached."""
    demo = by_slurry("start", "skill", "skill").neighbours
    skill, mse = (by_slurry("small", "skill", column) for column in ("skill", "mse_um2"))
    spread = read_result("small", "uncertainty").query("surrogate == 'neighbours' and role == 'test'")
    covered = spread.coverage[(spread.level - 0.9).abs() < 1e-9]
    limits = [
        ("mean skill, eight training slurries of the demo, one member", demo.mean(), 0.28, math.inf),
        ("least skill, the same", demo.min(), 0.2, math.inf),
        ("mean skill at reduced scale", skill.neighbours.mean(), 0.45, math.inf),
        ("largest MSE over that of the affine map", (mse.neighbours / mse.affine).max(), 0, 1),
        ("least coverage of the 90 % intervals", covered.min(), 0.85, 0.95),
        ("largest coverage of the 90 % intervals", covered.max(), 0.85, 0.95),
        ("least rank correlation of spread and error", spread.rank_correlation.min(), 0.3, math.inf),
    ]
    return pd.DataFrame(
        {
            "quantity": name,
            "tolerance": f"{low:g} to {high:g}".replace(" to inf", " or more"),
            "result": f"{value:.2f}",
            "": "met" if low <= value <= high else "missed",
        }
        for name, value, low, high in limits
    )


def neighbours_start() -> pd.DataFrame:
    """Skill and cost by the last input frame."""
    skill = by_slurry("start", "skill", "skill").mean()
    cost = by_slurry("start", "front", "cost_share_of_full_dem").mean()
    rows = {}
    for frame in (2, 6, 10, 18):
        labels = {
            name: name if frame == 10 else f"{name}_f{frame:02}" for name in ("affine", "neighbours", "driven_dem")
        }
        rows[str(frame)] = {f"`{name}` skill": skill.get(label) for name, label in labels.items()}
        rows[str(frame)] |= {f"`{name}` cost": cost.get(label) for name, label in labels.items()}
    values = pd.DataFrame.from_dict(rows, orient="index", dtype=float).rename_axis("last input frame")
    formats = {column: "{:.1%}" if column.endswith("cost") else "{:.2f}" for column in values}
    return pd.DataFrame(
        {column: values[column].map(form.format, na_action="ignore") for column, form in formats.items()}
    ).reset_index()
