"""Tables of docs/tape.md: each public function gives one."""

import pandas as pd

from reference_results import MISSING, REFERENCE, drying_changes, load, read_result, slurries
from slurrycast.evaluation.verdicts import EQUIVALENT
from slurrycast.report.names import tape_quantity

FORMS = {
    "green density (g/cm³)": ("green_density_g_cm3", 1, 3),
    "void (points)": ("void", 100, 2),
    "ceramic share (points)": ("ceramic_share", 100, 2),
    "contacts": ("coordination", 1, 2),
}


def drying_settings() -> pd.DataFrame:
    """What the settings of the drying change, and the tapes of the shipped ones; ± is one standard error."""
    rows = drying_changes()
    drying = load("config")["drying"]
    defaults = drying | drying["force_field"]
    shown = []
    for (particles, setting, value), row in rows.iterrows():
        shipped = setting == "none"
        sign = "" if shipped else "+"
        cells = {"setting": "as configured" if shipped else setting}
        cells["value"] = MISSING if shipped else f"{value:g}, not {defaults[setting]:g}"
        cells["particles"] = f"{particles:,}"
        for name, (measure, factor, places) in FORMS.items():
            mean, error = factor * row[measure, "mean"], factor * row[measure, "sem"]
            cells[name] = f"{mean:{sign}.{places}f} ± {error:.{places}f}"
        shown.append(cells)
    return pd.DataFrame(shown)


def tapes() -> pd.DataFrame:
    """Properties of the DEM's tapes, their replica sd, and how far the tapes of each surrogate are from them in it."""
    errors = read_result("tape", "tape_errors")
    errors = errors[errors.slurry.isin(slurries("reduced", "test"))]
    verdicts = read_result("tape", "tape_verdicts").set_index(["measure", "surrogate"])
    rows = []
    for measure, of_measure in errors[errors.quantity.isin(verdicts.index.levels[0])].groupby("quantity", sort=False):
        dem = of_measure.drop_duplicates("slurry")
        name = tape_quantity(measure, of_measure.unit.iloc[0])
        row = {"property": name, "DEM": f"{dem.dem_value.mean():.4g}", "replica sd": f"{dem.replica_sd.mean():.2g}"}
        for surrogate, judged in verdicts.loc[measure].iterrows():
            verdict = "" if judged.verdict == EQUIVALENT else f" ({judged.verdict})"
            row[f"`{surrogate}`"] = f"{judged.mean_in_sd:+.1f}{verdict}"
        rows.append(row)
    return pd.DataFrame(rows)


def tape_cost() -> pd.DataFrame:
    """CPU seconds from the recipe to the slurry by either way, and from there to the measured tape, by slurry.

    The last one is of the published size and has no DEM (results/reference/recipe).
    """
    cost = read_result("tape", "cost")
    cost = cost[cost.slurry.isin(slurries("reduced", "test"))]
    ways = {
        "full DEM": ("-", ["generate_inputs", "run_slurry"]),
        "`direct`": ("direct", ["predict_slurry", "wrap_slurry", "relax_slurry"]),
        "drying": ("direct", ["dry_slurry"]),
        "measures of slurry and tape": ("direct", ["measure_microstructure"]),
    }
    found = {"particles": cost.groupby("slurry").particles.max()}
    for name, (surrogate, stages) in ways.items():
        rows = cost[(cost.surrogate == surrogate) & cost.stage.isin(stages)]
        found[name] = rows.groupby("slurry").cpu_s.sum()
    table = pd.DataFrame(found).sort_values("particles").drop_duplicates("particles")
    recipe = pd.read_csv(REFERENCE / "recipe" / "cost.csv")
    stage = recipe.stage.str.partition(" ")[0]  # without what is measured
    cpu_s = {name: recipe.cpu_s[stage.isin(stages)].sum() for name, (_, stages) in ways.items()}
    table.loc["recipe"] = cpu_s | {"particles": recipe.particles[0], "full DEM": float("nan")}
    table = table.assign(particles=table.particles.map("{:,.0f}".format))
    return table.map(lambda value: value if isinstance(value, str) else MISSING if pd.isna(value) else f"{value:.3g}")
