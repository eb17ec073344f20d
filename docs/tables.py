"""Write the tables of the documentation from the reference results.

A table in a Markdown file stands between two markers:

    <!-- table: NAME -->
    <!-- end of table -->

This script replaces what stands between them by the table of that name. It reads results/reference and config, and
writes README.md, docs/*.md and results/reference/README.md. With --check it writes nothing, and fails if a file would
change: `make tables` mends that.
"""

import argparse
import json
import math
import re
import sys
from collections.abc import Callable

import pandas as pd

from reference_results import (
    REFERENCE,
    ROOT,
    accuracy,
    by_slurry,
    direct_profile,
    full_scale_estimates,
    growth,
    measured_rates,
    read_result,
    relaxed,
    temperatures_k,
)
from slurrycast.evaluation.relaxation import enough_steps
from slurrycast.report import reference_article

PAGES = ("README.md", "docs/*.md", "results/reference/README.md")
MARKED = re.compile(r"(<!-- table: (\w+) -->\n).*?(<!-- end of table -->)", re.DOTALL)
MARKER = re.compile(r"<!-- (?:table: |end of table)")
MISSING = "-"
REPLICA_PAIR_SDS = 8**0.5  # 2 sd of the difference between two runs, each with a scatter of 1 sd

TABLES: dict[str, Callable[[], pd.DataFrame]] = {}


def table(function: Callable[[], pd.DataFrame]) -> Callable[[], pd.DataFrame]:
    """Register the table of that name: a frame of texts whose columns are the header."""
    TABLES[function.__name__] = function
    return function


# ---- README.md


@table
def surrogates() -> pd.DataFrame:
    """The surrogates of the main job, and the best of the DEM with a faster barostat."""
    return accuracy("reduced", "persistence", "affine", "linear", "vgg16", "vgg16_box", "early_dem_x2")


@table
def surrogates_small() -> pd.DataFrame:
    """The network that sees its neighbours, and its rivals."""
    return accuracy("small")


# ---- docs/evaluation.md


@table
def surrogates_reduced() -> pd.DataFrame:
    """All surrogates of the run at reduced scale."""
    return accuracy("reduced")


@table
def noise() -> pd.DataFrame:
    """Scatter of replicas, and floors of perturbed runs."""
    rows = read_result("reduced", "noise").set_index(["slurry", "quantity"])
    density, mean = rows.xs("density_g_cm3", level="quantity"), rows["mean"].unstack()
    columns = {
        "particles": density.particles.map("{:,}".format),
        "density (g/cm³)": density["mean"].map("{:.4f}".format) + (2 * density.sd).map(" ± {:.4f}".format),
        "mean difference of g, all": mean.rdf_all.map("{:.4f}".format),
        "mean difference of g, NiO-8YSZ": mean["rdf_NiO-8YSZ"].map("{:.4f}".format),
        "floor (µm²)": mean.perturbation_floor_um2.map("{:.4f}".format),
    }
    return pd.DataFrame(columns).reset_index()


table(direct_profile)


@table
def cost_growth() -> pd.DataFrame:
    """Growth of cost at reduced scale."""
    return growth("reduced", "affine", "linear", "vgg16", "vgg16_box", "early_dem_x10")


@table
def article_densities() -> pd.DataFrame:
    """Density errors after relaxation, in the reference article and here."""
    article = {
        slurry: abs(hybrid.density_g_cm3 / reference_article.DEM_STRUCTURE[slurry].density_g_cm3 - 1)
        for slurry, hybrid in reference_article.HYBRID_STRUCTURE.items()
    }
    errors = relaxed("reduced").density_error
    compared = pd.DataFrame({"reference article": article, "`vgg16`": errors["vgg16"], "`affine`": errors["affine"]})
    compared = compared.loc[list(article)]
    compared.loc["mean"] = compared.mean()
    return compared.map("{:.2%}".format).rename_axis("slurry").reset_index()


@table
def sizes() -> pd.DataFrame:
    """Error of the predicted volume by size, with each barostat."""
    rows = {}
    for name, run in {"NPT": "size", "Berendsen": "size_berendsen"}.items():
        clock = pd.read_csv(REFERENCE / run / "size_clock.csv").iloc[0]
        errors = pd.read_csv(REFERENCE / run / "size_errors.csv")
        rows["all", "exponent of the shrink time", name] = f"{clock.exponent:.3f} ± {clock.standard_error:.3f}"
        rows["all", "largest share of coordinates outside the training range", name] = (
            f"{errors.outside_share.max():.0%}"
        )
        for (label, units), group in errors.groupby(["surrogate", "mass_units"]).predicted_volume_error:
            rows[f"`{label}`", f"volume error, {units:g}-unit slurries", name] = (
                f"{group.min():+.1%} to {group.max():+.1%}"
            )
    return pd.Series(rows).unstack(sort=False).rename_axis(["surrogate", "quantity"]).reset_index()


@table
def barostats() -> pd.DataFrame:
    """Time until the edge is 0.75 of its start, for few and for many particles."""
    times = pd.read_csv(REFERENCE / "barostat" / "clock.csv").pivot(index="barostat", columns="particles")
    times = times.shrink_time_us.map("{:.1f}".format)
    return times.rename(columns="{:,} particles (µs)".format).rename_axis("barostat", axis=0).reset_index()


@table
def temperatures() -> pd.DataFrame:
    """Temperatures of slurry 6 under a thermostat of 300 K."""
    columns = {"slurry 6, translation (K)": "temperature_k", "rotation (K)": "temperature_rotational_k"}
    rows = temperatures_k().rename(columns={value: key for key, value in columns.items()})[list(columns)]
    return rows.map("{:,.0f}".format).rename_axis("temperature").reset_index()


@table
def ablation() -> pd.DataFrame:
    """One change between vgg16 and vgg16_box at a time."""
    rows = pd.read_csv(REFERENCE / "ablation" / "ablation.csv")
    return pd.DataFrame(
        {
            "surrogate": "`" + rows.surrogate + "`",
            "target": rows.target,
            "coordinates": rows.coordinates,
            "box edges": rows.box,
            "epochs": rows.epochs.map("{:.0f}".format, na_action="ignore"),
            "best validation loss (µm²)": rows.best_val_loss_um2.map("{:.4f}".format),
            "skill, validation": rows.validation_skill.map("{:.2f}".format),
            "skill, test": rows.test_skill.map("{:.2f}".format),
        }
    )


@table
def timestep() -> pd.DataFrame:
    """What each time step changes against the smallest one; ± is one standard error."""
    rows = pd.read_csv(REFERENCE / "timestep" / "timestep_summary.csv")
    later, later_se = rows.time_to_equilibrium_us_difference, rows.time_to_equilibrium_us_standard_error
    columns = {
        "time step (µs)": rows.timestep_us.map("{:.4f}".format),
        "density": rows.density_difference.map("{:+.2%}".format) + rows.standard_error.map(" ± {:.2%}".format),
        "shift not excluded": rows.density_difference_bound.map("{:.2%}".format),
        "time to equilibrium": later.map("{:+.0%}".format) + later_se.map(" ± {:.0%}".format),
        "CPU time": (rows.cpu_s_mean / rows.cpu_s_mean[0]).map("{:.1%}".format),
    }
    return pd.DataFrame(columns)


# ---- docs/neighbours.md


@table
def neighbours_structure() -> pd.DataFrame:
    """How many test slurries have a density within the noise of the DEM after relaxation."""
    in_sd = relaxed("small").density_in_sd.unstack()
    return pd.DataFrame(
        {
            "surrogate": f"`{label}`",
            "within 2 sd of replicas": f"{(row <= 2).sum()} of {len(row)}",
            "within 2 sd of the difference of two replicas": f"{(row <= REPLICA_PAIR_SDS).sum()} of {len(row)}",
        }
        for label, row in in_sd.iterrows()
    )


@table
def neighbours_relaxation() -> pd.DataFrame:
    """Overlaps of predictions, and the steps of relaxation after which validation slurries are within the noise."""
    rows = read_result("small", "relaxation")
    enough = enough_steps(rows)
    overlap = rows.groupby(["surrogate", "slurry"]).overlap_mean_predicted.first().unstack()
    error = rows.groupby(["surrogate", "steps"]).density_error.mean().unstack()
    return pd.DataFrame(
        {"surrogate": f"`{label}`"}
        | {f"overlap, {slurry}": f"{value:.1%}" for slurry, value in overlap.loc[label].items()}
        | {f"density, {steps:,} steps": f"{value:+.2%}" for steps, value in error.loc[label].items()}
        | {"steps within the noise": ", ".join(f"{steps:,}" for steps in enough[label]) or MISSING}
        for label in rows.surrogate.unique()
    )


@table
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


@table
def cost_growth_small() -> pd.DataFrame:
    """Growth of cost with networks that learned from small slurries."""
    return growth("small", "affine", "neighbours", "driven_dem")


@table
def neighbours_tolerances() -> pd.DataFrame:
    """What was set before as the least to reach, and what was reached."""
    demo = by_slurry("start", "skill", "skill").neighbours
    skill, mse = (by_slurry("small", "skill", column) for column in ("skill", "mse_um2"))
    spread = read_result("small", "uncertainty").query("surrogate == 'neighbours' and role == 'test'")
    covered = spread.coverage[(spread.level - 0.9).abs() < 1e-9]
    errors = relaxed("small").loc["neighbours"]
    gain = skill.neighbours.mean() - skill.early_dem_x2.mean()
    limits = [
        ("mean skill, eight training slurries of the demo, one member", demo.mean(), 0.28, math.inf),
        ("least skill, the same", demo.min(), 0.2, math.inf),
        ("mean skill at reduced scale", skill.neighbours.mean(), 0.45, math.inf),
        ("largest MSE over that of the affine map", (mse.neighbours / mse.affine).max(), 0, 1),
        ("least coverage of the 90 % intervals", covered.min(), 0.85, 0.95),
        ("largest coverage of the 90 % intervals", covered.max(), 0.85, 0.95),
        ("least rank correlation of spread and error", spread.rank_correlation.min(), 0.3, math.inf),
        ("share of slurries with a density within 2 sd of replicas", (errors.density_in_sd <= 2).mean(), 1, math.inf),
        ("largest RDF difference over that of replicas", errors.rdf_ratio.max(), 0, 2),
        ("mean skill less that of `early_dem_x2`", gain, 0, math.inf),
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


@table
def neighbours_start() -> pd.DataFrame:
    """Skill and cost by the last input frame."""
    skill = by_slurry("start", "skill", "skill").mean()
    cost = by_slurry("start", "front", "cost_share_of_full_dem").mean()
    rows = {}
    for frame in (2, 4, 6, 10, 14, 18, 24):
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


# ---- docs/cluster.md


@table
def rates() -> pd.DataFrame:
    """Rates of the reference run at reduced scale."""
    measured = measured_rates()
    cpu_s = pd.read_csv(REFERENCE / "timestep" / "timestep_summary.csv").set_index("timestep_us").cpu_s_mean
    fine = cpu_s[1e-4] * 1e-4 / (cpu_s[2e-3] * 2e-3)
    rows = [
        ("DEM, million particle-steps in a CPU second", f"{measured['dem'] / 1e6:.1f}"),
        ("CPU time of a DEM step of 1e-4 µs over that of a step of 2e-3 µs", f"{fine:.2f}"),
        ("relaxation, million particle-steps in a CPU second", f"{measured['relaxation'] / 1e6:.1f}"),
        ("training of `vgg16`, CPU time for a particle and epoch (ms)", f"{1e3 * measured['training_s']:.2f}"),
        ("memory of the largest DEM process (MB)", f"{measured['memory_mb']:.0f}"),
    ]
    return pd.DataFrame(rows, columns=["quantity", "measured"])


@table
def full_scale() -> pd.DataFrame:
    """Estimated CPU hours of the full scale."""
    estimates = full_scale_estimates()[["job", "particles", "steps", "cpu_h"]]
    forms = {"particles": "{:,}", "steps": "{:,}", "cpu_h": "{:.1f}"}
    estimates = estimates.assign(**{column: estimates[column].map(form.format) for column, form in forms.items()})
    return estimates.rename(columns={"steps": "steps or epochs", "cpu_h": "CPU hours, estimated"})


@table
def mpi_ranks() -> pd.DataFrame:
    """Two slurries side by side on one rank each, or one after the other on two ranks: wall seconds, medians."""
    times = pd.read_csv(REFERENCE / "mpi" / "ranks.csv").groupby("particles").median()
    columns = {
        "side by side, one rank each (s)": times.side_by_side_s,
        "one after the other, two ranks (s)": 2 * times.two_ranks_s,
        "ratio": 2 * times.two_ranks_s / times.side_by_side_s,
    }
    text = pd.DataFrame(columns).map("{:.2f}".format)
    return text.set_axis(text.index.map("{:,}".format)).rename_axis("particles of each").reset_index()


# ---- docs/reliability.md and results/reference/README.md


@table
def faults() -> pd.DataFrame:
    """Injected faults by kind."""
    lost = pd.read_csv(REFERENCE / "torture" / "campaign.csv").groupby("kind", sort=False).lost
    counts = pd.DataFrame({"injected": lost.size(), "survived": lost.size() - lost.count(), "lost": lost.count()})
    return counts.rename_axis("fault").reset_index().astype(str)


@table
def runs() -> pd.DataFrame:
    """Commit and machine of each reference run that has them, and the epochs of its networks."""
    rows = []
    for path in sorted(REFERENCE.glob("*/versions.json")):
        versions = json.loads(path.read_text(encoding="utf-8"))
        epochs = {file.parent.name: len(pd.read_csv(file)) for file in sorted(path.parent.glob("models/*/history.csv"))}
        shown = ", ".join(f"`{network}` {number}" for network, number in epochs.items()) or MISSING
        rows.append((f"`{path.parent.name}/`", f"`{versions['workflow_commit'][:7]}`", versions["machine"], shown))
    return pd.DataFrame(rows, columns=["folder", "commit", "machine", "epochs"])


# ---- writing


def markdown(frame: pd.DataFrame) -> str:
    """Table in Markdown with the columns of `frame` as header; what is missing is a dash."""
    cells = [list(frame.columns), ["---"] * len(frame.columns)]
    cells += frame.astype(object).where(frame.notna(), MISSING).to_numpy().tolist()
    return "".join(f"| {' | '.join(row)} |\n" for row in cells)


def fill(text: str) -> str:
    """Return the text of a page with its tables written anew.

    ValueError if a marker has no partner, or names a table that is not registered.
    """
    marked = MARKED.findall(text)
    if len(MARKER.findall(text)) != 2 * len(marked):
        raise ValueError("a marker of a table has no partner")
    if unknown := sorted({name for _, name, _ in marked} - set(TABLES)):
        raise ValueError(f"no table {', '.join(unknown)}")
    return MARKED.sub(lambda match: match[1] + markdown(TABLES[match[2]]()) + match[3], text)


def main() -> None:
    """Write all tables, or check that they are written."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="write nothing; fail if a table would change")
    check = parser.parse_args().check
    changed = []
    for path in (path for pattern in PAGES for path in sorted(ROOT.glob(pattern))):
        text = path.read_text(encoding="utf-8")
        try:
            filled = fill(text)
        except ValueError as error:
            sys.exit(f"error: {path.relative_to(ROOT)}: {error}")
        if filled != text:
            changed.append(str(path.relative_to(ROOT)))
            if not check:
                path.write_text(filled, encoding="utf-8")
    if check and changed:
        sys.exit(f"error: {', '.join(changed)}: tables differ from the reference results; run `make tables`")


if __name__ == "__main__":
    main()
