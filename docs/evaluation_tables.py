"""Tables of README.md and docs/evaluation.md: each public function gives one, as a frame of texts."""

import pandas as pd

from reference_results import (
    MISSING,
    REFERENCE,
    accuracy,
    density_errors,
    growth,
    load,
    network_training,
    read_result,
    relaxation_settings,
    slurries,
    with_largest,
)
from slurrycast.analysis.temperatures import DENSIFIED

RECIPES = {
    "recipe": "as configured",
    "attraction_10": "attraction x 10",
    "attraction_100": "attraction x 100",
    "friction": "friction 0.5",
}
LONGER = "epochs"  # the run whose networks are trained for longer
SOURCES = {"dem": "DEM", "direct": "`direct`", "direct, dense": "`direct` from 0.6"}


def training() -> pd.DataFrame:
    """How far networks were trained at reduced scale, and what a fit of a few coefficients reaches."""
    return network_training("reduced", "linear", "vgg16", "linear_box", "vgg16_box")


def longer_training() -> pd.DataFrame:
    """The published network trained for longer, beside maps and fits; errors of slurries are means over them."""
    labels = ["affine", "linear", "vgg16", "vgg16_standardised"]
    table = network_training(LONGER, *labels[1:]).set_index("surrogate").drop(columns="coefficients")
    table = table.reindex([f"`{label}`" for label in labels])
    errors = read_result(LONGER, "coordinate_errors").query("axis == 'all'")
    for role in ("validation", "test"):
        mse_um2 = errors[errors.slurry.isin(slurries(LONGER, role))].groupby("surrogate").mse_um2.mean()
        table[f"{role} slurries (µm²)"] = mse_um2[labels].map("{:.4f}".format).to_numpy()
    return table.reset_index()


def surrogates_small() -> pd.DataFrame:
    """The network that sees its neighbours, and its rivals."""
    return accuracy("small")


def surrogates_reduced() -> pd.DataFrame:
    """All surrogates of the run at reduced scale, and what costs nothing: a constant."""
    boxes = density_errors("reduced", "predicted").loc["direct_box"]
    constant = {"surrogate": "the box of `direct_box`, not relaxed", "density error (largest)": with_largest(boxes)}
    return pd.concat([accuracy("reduced"), pd.DataFrame([constant])])


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


def direct_profile() -> pd.DataFrame:
    """What `direct` spends its CPU time on; the four scripts together."""
    rows = pd.read_csv(REFERENCE / "relaxation" / "profile.csv")
    parts = rows.part.where(rows.part.str.startswith("LAMMPS"), rows.part.str.split(",").str[0] + ", four in all")
    sums = rows.groupby(parts, sort=False)[["cpu_s", "share"]].sum()
    sums.loc["all"] = sums.sum()
    columns = {"CPU time (s)": sums.cpu_s.map("{:.2f}".format), "share": sums.share.map("{:.1%}".format)}
    return pd.DataFrame(columns).reset_index()


def cost_growth() -> pd.DataFrame:
    """Growth of cost at reduced scale."""
    return growth("reduced", "direct", "affine", "linear_box", "vgg16", "vgg16_box", "early_dem_x10")


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


def barostats() -> pd.DataFrame:
    """Time until the edge is 0.75 of its start, for few and for many particles."""
    times = pd.read_csv(REFERENCE / "barostat" / "clock.csv").pivot(index="barostat", columns="particles")
    times = times.shrink_time_us.map("{:.1f}".format)
    return times.rename(columns="{:,} particles (µs)".format).rename_axis("barostat", axis=0).reset_index()


def temperatures() -> pd.DataFrame:
    """Temperatures of slurry 6 under a thermostat of 300 K."""
    slurry = read_result("published", "equilibrium").set_index("slurry").loc["6"]
    rows = {
        f"translation, mean while densifying to {DENSIFIED:.0%} of the density": slurry.temperature_densifying_k,
        "translation, end of the run": slurry.temperature_k,
        "rotation, end of the run": slurry.temperature_rotational_k,
    }
    return pd.DataFrame({"temperature of slurry 6": rows.keys(), "K": [f"{kelvin:,.0f}" for kelvin in rows.values()]})


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


def relaxation_choice() -> pd.DataFrame:
    """What the settings of the relaxation change, on the larger validation slurry."""
    rows = relaxation_settings().xs("V2", level="slurry").reset_index()
    default = load("config")
    defaults = default["relaxation"] | default["surrogate"]["direct"]
    shown = rows.setting.where(rows.setting != "none", "as configured")
    values = [
        MISSING if pd.isna(value) else f"{value:g}, not {defaults[name]:g}"
        for name, value in zip(rows.setting, rows.value, strict=True)
    ]
    forms = {"density": "density_g_cm3", "contacts": "coordination_all", "few contacts": "share_below_4_contacts"}
    forms |= {"overlap": "overlap_mean"}
    columns = {name: rows[column].map("{:+.1f}".format) for name, column in forms.items()}
    head = {"start": "`" + rows.start + "`", "setting": shown, "value": values}
    return pd.DataFrame(head | columns | {"CPU time (s)": rows.lammps_cpu_s.map("{:.1f}".format)})


def direct_limits() -> pd.DataFrame:
    """Means over four slurries of `direct` and of the DEM, for recipes far from the shipped one; ± is the scatter."""
    rows = pd.read_csv(REFERENCE / "direct_limits" / "limits.csv")
    forms = {
        "density (g/cm³)": ("density_g_cm3", "{:.3f}"),
        "contacts": ("coordination_all", "{:.2f}"),
        "fewer than four": ("share_below_4_contacts", "{:.1%}"),
        "mean overlap": ("overlap_mean", "{:.2%}"),
    }
    by_source = rows.groupby(["recipe", "source"], sort=False)
    table = pd.DataFrame(
        {
            name: by_source[column].mean().map(form.format) + by_source[column].std().map(f" ± {form}".format)
            for name, (column, form) in forms.items()
        }
    ).reset_index()
    return table.assign(recipe=table.recipe.map(RECIPES), source=table.source.map(SOURCES))


def recipe_cost() -> pd.DataFrame:
    """Time of one slurry of the published size from its recipe."""
    rows = pd.read_csv(REFERENCE / "recipe" / "cost.csv")
    rows = rows[: rows.index[rows.stage == "snakemake"][0] + 1]  # what follows is that of its tape
    columns = {"particles": rows.particles.map("{:,.0f}".format)}
    columns |= {"wall time (s)": rows.wall_s.map("{:.1f}".format), "CPU time (s)": rows.cpu_s.map("{:.1f}".format)}
    return pd.DataFrame({"stage": "`" + rows.stage + "`"} | columns)
