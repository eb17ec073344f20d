"""Reference results as tables, and what the documentation derives from them."""

import json
import math
from pathlib import Path

import pandas as pd
import yaml

from slurrycast import surrogates
from slurrycast.data.tables import read_equilibrium, read_table
from slurrycast.dem.recipe import particle_counts, particle_types
from slurrycast.evaluation.verdicts import EQUIVALENT
from slurrycast.report import reference_article

ROOT = Path(__file__).resolve().parents[1]
REFERENCE = ROOT / "results" / "reference"

MISSING = "-"
ERRORS = ("training error (µm²)", "validation error (µm²)", "training error, last epoch (µm²)")
NETWORK_SIZE = f"{reference_article.PARAMETERS / 1e6:.1f} M"


def load(name: str) -> dict:
    """A file in config/ as it is."""
    return yaml.safe_load((ROOT / "config" / f"{name}.yaml").read_text(encoding="utf-8"))


def read_result(run: str, name: str) -> pd.DataFrame:
    """Read tables/<name>.csv of a reference run."""
    return read_table(REFERENCE / run / "tables" / f"{name}.csv")


def slurries(run: str, role: str) -> list[str]:
    """Ids of the slurries of a role in a reference run."""
    equilibrium = read_equilibrium(REFERENCE / run / "tables" / "equilibrium.csv")
    return list(equilibrium.slurry[equilibrium.role == role])


def by_slurry(run: str, name: str, column: str) -> pd.DataFrame:
    """One column of a table for the test slurries: slurries x surrogates."""
    return read_result(run, name).pivot(index="slurry", columns="surrogate", values=column).loc[slurries(run, "test")]


def relaxed(run: str) -> pd.DataFrame:
    """Errors after relaxation on the test slurries, by surrogate and slurry.

    Columns: density_error, |density / density of the DEM - 1|; rdf_ratio, the RDF difference over that of two replicas.
    """
    errors = read_result(run, "structure_errors")
    errors = errors[(errors.stage == "relaxed") & errors.slurry.isin(slurries(run, "test"))]
    density, rdf = (
        errors[errors.quantity == quantity].set_index(["surrogate", "slurry"])
        for quantity in ("density_g_cm3", "rdf_all")
    )
    off_g_cm3 = (density.value - density.dem_value).abs()
    return pd.DataFrame(
        {
            "density_error": off_g_cm3 / density.dem_value,
            "rdf_ratio": rdf.value / rdf.replica_sd,
        }
    )


def density_errors(run: str, stage: str) -> pd.DataFrame:
    """|density / density of the DEM - 1| of a stage, by surrogate and test slurry."""
    errors = read_result(run, "structure_errors")
    errors = errors[(errors.stage == stage) & (errors.quantity == "density_g_cm3")]
    errors = errors.assign(error=(errors.value / errors.dem_value - 1).abs())
    return errors.pivot(index="surrogate", columns="slurry", values="error")[slurries(run, "test")]


def with_largest(shares: pd.Series) -> str:
    """Mean and, in brackets, largest of some shares."""
    return f"{shares.mean():.2%} ({shares.max():.2%})"


def measured_rates() -> dict[str, float]:
    """Rates at the published size: particle-steps a CPU second, CPU seconds of training a particle and epoch, MB."""
    cost = read_result("published", "cost")
    dem = cost[cost.stage == "run_slurry"]
    whole = dem[dem.steps == cost.steps.max()]
    relaxations = cost[cost.stage == "relax_slurry"]
    training = cost[(cost.stage == "train_surrogate") & (cost.surrogate == "vgg16")].iloc[0]
    epochs = len(pd.read_csv(REFERENCE / "published" / "models" / "vgg16" / "history.csv"))
    particles = relaxations.slurry.map(dem.set_index("slurry").particles)
    return {
        "dem": (whole.particles * whole.steps / whole.cpu_s).median(),
        "relaxation": (particles * relaxations.steps / relaxations.cpu_s).median(),
        "training_s": training.cpu_s / (training.particles * epochs),
        "memory_mb": dem.max_rss_mb.max(),
    }


def published_estimates(name: str) -> pd.DataFrame:
    """Jobs of a configuration: job, particles, steps (or epochs) and cpu_h, the CPU hours at the measured rates."""
    measured = measured_rates()
    default, own = map(load, ("config", name))
    types = particle_types(default["formulation"]["phases"])
    runs = pd.read_csv(ROOT / own["slurries"], sep="\t", dtype={"id": str}).set_index("id")
    unit_mass_pg = own["formulation"]["unit_mass_pg"]
    particles = runs.mass_units.map(lambda units: int(particle_counts(types, units * unit_mass_pg).sum()))
    whole = particles[runs.role != "new"]
    dem_steps, relaxation_steps = ((default[key] | own.get(key, {}))["steps"] for key in ("dem", "relaxation"))
    epochs = own["surrogate"]["vgg16"]["epochs"]
    rows = [
        ("`run_slurry`, slurry 2", particles["2"], dem_steps, 1 / measured["dem"]),
        ("`run_slurry`, slurry 6", particles["6"], dem_steps, 1 / measured["dem"]),
        (f"`run_slurry`, all {len(whole)} that run to the end", whole.sum(), dem_steps, 1 / measured["dem"]),
        ("`relax_slurry`, slurry 6", particles["6"], relaxation_steps, 1 / measured["relaxation"]),
        ("`train_surrogate`, `vgg16`", particles[runs.role == "train"].sum(), epochs, measured["training_s"]),
    ]
    estimates = pd.DataFrame(rows, columns=["job", "particles", "steps", "cpu_s"])
    return estimates.assign(cpu_h=estimates.particles * estimates.steps * estimates.cpu_s / 3600)


def accuracy(run: str, *labels: str) -> pd.DataFrame:
    """What the surrogates of a run reach and cost: means over its test slurries."""
    skill, cost = by_slurry(run, "skill", "skill"), by_slurry(run, "front", "cost_share_of_full_dem")
    errors, judged = relaxed(run), read_result(run, "verdicts").set_index("surrogate")
    rows = []
    for label in labels or list(dict.fromkeys(judged.index)):
        density, rdf, found = errors.density_error[label], errors.rdf_ratio[label], judged.loc[label]
        skills = skill.get(label)
        contacts = found[found.measure == "coordination_all"].mean_in_sd.iloc[0]
        inside = (found.verdict == EQUIVALENT).sum()
        rows.append(
            {
                "surrogate": f"`{label}`",
                "skill (least to greatest)": None
                if skills is None
                else f"{skills.mean():.2f} ({skills.min():.2f} to {skills.max():.2f})",
                "density error (largest)": with_largest(density),
                "RDF difference (largest)": f"{rdf.mean():.2f} ({rdf.max():.2f})",
                "contacts (replica sd)": f"{contacts:+.1f}",
                "inside the noise": f"{inside} of {len(found)}",
                "cost": f"{cost[label].mean():.1%}",
            }
        )
    return pd.DataFrame(rows)


def network_training(run: str, *labels: str) -> pd.DataFrame:
    """How far the networks among `labels` were trained, the errors of maps, fits and networks, and the article's.

    The affine map comes with the first fit, if its model has the errors of it. Errors are those of the best epoch.
    """
    folder = REFERENCE / run
    config = yaml.safe_load((folder / "config.yaml").read_text(encoding="utf-8"))
    cost = read_result(run, "cost")
    samples = cost[cost.slurry.isin(slurries(run, "train")) & (cost.stage == "generate_inputs")].particles.sum()
    trained_on = 1 - config["learning"]["validation_share"]
    training, validation, last = ERRORS
    rows = []
    for label in labels:
        fit = folder / "models" / label / "model.json"
        if fit.exists():
            model = json.loads(fit.read_text(encoding="utf-8"))
            maps = [(label, "", len(model["coefficients"]))]
            if not rows and "affine_training_mse_um2" in model:
                maps.insert(0, ("affine", "affine_", 0))
            for name, prefix, size in maps:
                errors = {
                    training: model[f"{prefix}training_mse_um2"],
                    validation: model[f"{prefix}validation_mse_um2"],
                }
                rows.append({"surrogate": name, "coefficients": str(size)} | errors)
            continue
        history = pd.read_csv(folder / "models" / label / "history.csv")
        batch_size = config["surrogate"][surrogates.parse(label).name]["batch_size"]
        updates = len(history) * math.ceil(trained_on * samples / batch_size)
        best = history.loc[history.val_loss.idxmin()]
        row = {"updates": f"{updates:,}", "best epoch": f"{best.epoch:.0f} of {len(history)}"}
        errors = {training: best.loss, validation: best.val_loss, last: history.loss.iloc[-1]}
        rows.append({"surrogate": label, "coefficients": NETWORK_SIZE} | row | errors)
    updates = reference_article.EPOCHS * math.ceil(0.8 * reference_article.SAMPLES / reference_article.BATCH_SIZE)
    rows = [row | {"surrogate": f"`{row['surrogate']}`"} for row in rows]
    rows.append({"surrogate": "reference article", "coefficients": NETWORK_SIZE, "updates": f"{updates:,}"})
    table = pd.DataFrame(rows, columns=["surrogate", "coefficients", "updates", "best epoch", *ERRORS])
    return table.assign(**{name: table[name].map("{:.4f}".format, na_action="ignore") for name in ERRORS})


def growth(run: str, *labels: str) -> pd.DataFrame:
    """Exponents of the cost against the particle number, and after how many slurries a training is paid back."""
    rows = read_result(run, "cost_scaling").query("clock == 'cpu_s'").set_index("surrogate").loc[list(labels)]
    columns = {
        "surrogate": [f"`{label}`" for label in labels],
        "exponent": rows.hybrid_exponent.map("{:.2f}".format) + rows.hybrid_exponent_se.map(" ± {:.2f}".format),
        "training (CPU min)": (rows.training_s / 60).map("{:.1f}".format, na_action="ignore"),
        "slurries to pay the training": rows.slurries_to_pay_training.map("{:.0f}".format, na_action="ignore"),
        "and the DEM of its slurries": rows.slurries_to_pay_training_and_dem.map("{:.0f}".format, na_action="ignore"),
    }
    dem = f"{rows.dem_exponent.iloc[0]:.2f} ± {rows.dem_exponent_se.iloc[0]:.2f}"
    return pd.concat([pd.DataFrame({"surrogate": ["full DEM"], "exponent": [dem]}), pd.DataFrame(columns)])


def relaxation_settings() -> pd.DataFrame:
    """Mean differences of relaxed structures from the DEM in replica sd, by start, setting, value and slurry.

    Columns are the measures of relaxation/settings.csv and lammps_cpu_s, the mean CPU seconds of LAMMPS.
    """
    runs = read_table(REFERENCE / "relaxation" / "settings.csv")
    measures = ["density_g_cm3", "coordination_all", "share_below_4_contacts", "overlap_mean"]
    dem = runs[runs.start == "dem"].groupby("slurry")
    particles, freedom = dem.particles.first(), dem.size() - 1
    variance = dem[measures].var().mul(particles * freedom, axis=0).sum() / freedom.sum()  # of one particle
    sd = pd.DataFrame({name: (variance[name] / particles) ** 0.5 for name in measures})
    means = (
        runs[runs.start != "dem"]
        .groupby(["start", "setting", "value", "slurry"], dropna=False, sort=False)
        .mean(numeric_only=True)
    )
    in_sd = (means[measures] - dem[measures].mean()) / sd
    return in_sd.reindex(means.index).assign(lammps_cpu_s=means.lammps_cpu_s)


def drying_changes() -> pd.DataFrame:
    """Mean and standard error of each measure of dried slurries, by particles, setting and value.

    Of the measure itself where the setting is "none", of its change from there, slurry by slurry, where it is another
    one. Columns are (measure, "mean" or "sem").
    """
    runs = read_table(REFERENCE / "drying" / "settings.csv")
    names = ["particles", "setting", "value"]
    runs = runs.set_index([*names, "slurry"])
    shipped = runs.xs("none", level="setting").droplevel(["particles", "value"])
    changes = runs - shipped.reindex(runs.index.get_level_values("slurry")).to_numpy()
    is_shipped = runs.index.get_level_values("setting") == "none"
    changes[is_shipped] = runs[is_shipped]
    return changes.groupby(names, dropna=False, sort=False).agg(["mean", "sem"])


def of_recipes(quantity: str) -> pd.DataFrame:
    """Rows of tables/recipes.csv of a quantity."""
    rows = read_result("transfer", "recipes")
    return rows[rows.quantity == quantity].rename(columns={"trained_on": "trained on"})


def recipe_name(recipe: str) -> str:
    """A recipe of config/transfer.yaml as a page names it."""
    return f"`{recipe}`" if recipe != "default" else recipe


def recipes_by_surrogates(rows: pd.DataFrame, keys: list[str]) -> pd.DataFrame:
    """Column `text` of rows of tables/recipes.csv: keys x surrogates, in the order in which they come."""
    rows = rows.assign(recipe=rows.recipe.map(recipe_name), surrogate="`" + rows.surrogate + "`")
    table = rows.groupby([*keys, "surrogate"], sort=False).text.first().unstack("surrogate", sort=False)
    return table[list(dict.fromkeys(rows.surrogate))].reset_index().rename_axis(columns=None)
