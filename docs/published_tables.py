"""Tables of the run of the published size, in README.md and docs/published.md: each public function gives one."""

import numpy as np
import pandas as pd

from reference_results import REFERENCE, accuracy, density_errors, growth, network_training, read_result, slurries
from slurrycast.evaluation.verdicts import DIFFERS
from slurrycast.report import reference_article as article

RUN = "published"
BAROSTATS = {"npt": "NPT", "berendsen": "Berendsen"}
COMPARED = ("vgg16", "linear", "affine")


def _of_article(values: dict, name: str) -> pd.Series:
    """One figure of the reference article by slurry."""
    return pd.Series({slurry: getattr(value, name) for slurry, value in values.items()})


def _structures(column: str) -> pd.DataFrame:
    """Density or volume of the test slurries: slurries x (`DEM` and surrogates after relaxation)."""
    rows = read_result(RUN, "density_volume").query("model in ('DEM', 'hybrid')")
    rows = rows.assign(source=rows.surrogate.where(rows.model == "hybrid", "DEM"))
    return rows.pivot(index="slurry", columns="source", values=column)


def _coordinates(column: str) -> pd.DataFrame:
    """An error of the predicted coordinates over all axes: slurries x surrogates."""
    rows = read_result(RUN, "coordinate_errors").query("axis == 'all'")
    return rows.pivot(index="slurry", columns="surrogate", values=column)


def _table(columns: dict[str, tuple[pd.Series, str]]) -> pd.DataFrame:
    """A row for each test slurry from columns of numbers, each with its format."""
    texts = {name: values.map(form.format, na_action="ignore") for name, (values, form) in columns.items()}
    return pd.DataFrame(texts).reindex(slurries(RUN, "test")).rename_axis("slurry").reset_index()


def published_slurries() -> pd.DataFrame:
    """Each test slurry beside the article: density of the DEM, error of the hybrid's, and of predicted coordinates."""
    theirs = _of_article(article.DEM_STRUCTURE, "density_g_cm3")
    off = (_of_article(article.HYBRID_STRUCTURE, "density_g_cm3") / theirs - 1).abs()
    errors, mse_um2 = density_errors(RUN, "relaxed").T, _coordinates("mse_um2")
    columns = {
        "DEM (g/cm³): article": (theirs, "{:.3f}"),
        "DEM (g/cm³): here": (_structures("density_g_cm3")["DEM"], "{:.3f}"),
        "density error: article": (off, "{:.1%}"),
    }
    columns |= {f"density error: `{label}`": (errors[label], "{:.1%}") for label in ("vgg16", "direct")}
    columns["MSE (µm²): article"] = (_of_article(article.COORDINATE_ERRORS, "mse_um2"), "{:.3f}")
    return _table(columns | {f"MSE (µm²): `{label}`": (mse_um2[label], "{:.3f}") for label in COMPARED})


def published_volumes() -> pd.DataFrame:
    """Volumes beside Table 3 of the article, in um3."""
    ours = _structures("volume_um3")
    columns = {
        "DEM: article": _of_article(article.DEM_STRUCTURE, "volume_um3"),
        "DEM: here": ours["DEM"],
        "relaxed: article": _of_article(article.HYBRID_STRUCTURE, "volume_um3"),
    }
    columns |= {f"relaxed: `{label}`": ours[label] for label in ("vgg16", "affine", "direct")}
    return _table({name: (values, "{:,.0f}") for name, values in columns.items()})


def published_coordinates() -> pd.DataFrame:
    """Errors of coordinates beside Table 4 of the article."""
    columns = {}
    for name, column, form in (("MAE (µm)", "mae_um", "{:.3f}"), ("R²", "r2", "{:.4f}")):
        ours = _coordinates(column)
        columns[f"{name}: article"] = (_of_article(article.COORDINATE_ERRORS, column), "{:.3f}")
        columns |= {f"{name}: `{label}`": (ours[label], form) for label in COMPARED}
    return _table(columns)


def published_axes() -> pd.DataFrame:
    """R2 of each axis of the slurry for which the article gives it."""
    (slurry,) = article.R2_PER_AXIS
    rows = read_result(RUN, "coordinate_errors").query(f"slurry == '{slurry}' and axis != 'all'")
    ours = rows.pivot(index="axis", columns="surrogate", values="r2")
    columns = {"R²: article": pd.Series(article.R2_PER_AXIS[slurry]).map("{:.3f}".format)}
    columns |= {f"R²: `{label}`": ours[label].map("{:.4f}".format) for label in COMPARED}
    return pd.DataFrame(columns).rename_axis("axis").reset_index()


def published_surrogates() -> pd.DataFrame:
    """What all surrogates reach and cost."""
    return accuracy(RUN)


def published_differences() -> pd.DataFrame:
    """Differences of relaxed structures from the DEM, means over the test slurries; * where they differ."""
    errors = read_result(RUN, "structure_errors").query("stage == 'relaxed'")
    errors = errors[errors.slurry.isin(slurries(RUN, "test"))]
    verdicts = read_result(RUN, "verdicts").set_index(["surrogate", "measure"]).verdict
    changes = (errors.value / errors.dem_value - 1).groupby([errors.surrogate, errors.quantity]).mean()
    columns = {
        "density": "density_g_cm3",
        "contacts": "coordination_all",
        "particles with few contacts": "share_below_4_contacts",
        "mean overlap": "overlap_mean",
        "contacts, BDPD-BDPD": "coordination_BDPD-BDPD",
    }
    rows = [
        {"surrogate": f"`{label}`"}
        | {
            name: f"{changes[label, measure]:+.2%}{' *' if verdicts[label, measure] == DIFFERS else ''}"
            for name, measure in columns.items()
        }
        for label in verdicts.index.unique("surrogate")
    ]
    return pd.DataFrame(rows)


def published_timestep() -> pd.DataFrame:
    """Slurry 2 with the time step and the barostat of the article, and with others; ± is the sd over the seeds."""
    rows = pd.read_csv(REFERENCE / "timestep" / "published.csv")
    settings = rows.groupby(["timestep_us", "barostat"])
    forms = {
        "density (g/cm³)": ("density_g_cm3", ".4f"),
        "contacts": ("coordination_all", ".3f"),
        "particles with few contacts": ("share_below_4_contacts", ".2%"),
        "mean overlap": ("overlap_mean", ".3%"),
        "RDF difference": ("rdf_difference", ".4f"),
        "time to equilibrium (µs)": ("time_to_equilibrium_us", ".0f"),
    }
    table = []
    for (timestep_us, barostat), seeds in settings:
        row = {
            "time step (µs)": f"{timestep_us:g}",
            "barostat": BAROSTATS[barostat],
            "seeds": str(len(seeds)),
            "simulated (µs)": f"{seeds.simulated_us.iloc[0]:.0f}",
        }
        for name, (column, form) in forms.items():
            spread = f" ± {seeds[column].std():{form}}" if len(seeds) > 1 else ""
            row[name] = f"{seeds[column].mean():{form}}{spread}"
        table.append(row | {"CPU hours": f"{seeds.cpu_h.mean():.2f}"})
    return pd.DataFrame(table)


def published_training() -> pd.DataFrame:
    """How far the network was trained, and what fits of a few coefficients reach."""
    return network_training(RUN, "linear", "vgg16", "linear_box")


def published_cost() -> pd.DataFrame:
    """Wall time of one slurry beside the claim of the article: medians over the test slurries."""
    rows = read_result(RUN, "article_costs").pivot(index="surrogate", columns="term", values="ours")
    theirs = read_result(RUN, "article_costs").drop_duplicates("term").set_index("term").article
    rows.loc["article"] = theirs.drop([term for term in theirs.index if term.startswith("share")])
    shown = ["article", *dict.fromkeys(read_result(RUN, "article_costs").surrogate)]
    forms = {
        "full DEM (min)": ("full DEM", "{:,.1f}"),
        "with the surrogate (min)": ("hybrid", "{:.2f}"),
        "ratio with the DEM to frame 10": ("the same with the DEM to the last input frame", "{:.1f}"),
        "without it": ("the same without the DEM to the last input frame", "{:.1f}"),
        "DEM to equilibrium / surrogate": ("DEM to equilibrium / hybrid", "{:.1f}"),
        "share of the relaxation": ("share of hybrid: relaxation", "{:.0f}%"),
    }
    columns = {name: rows[term].map(form.format, na_action="ignore") for name, (term, form) in forms.items()}
    table = pd.DataFrame(columns).loc[shown]
    names = ["reference article", *(f"`{label}`" for label in shown[1:])]
    return table.set_axis(names).rename_axis("surrogate").reset_index()


def published_growth() -> pd.DataFrame:
    """Growth of cost up to the largest slurry."""
    return growth(RUN, *dict.fromkeys(read_result(RUN, "cost_scaling").surrogate))


def published_rest() -> pd.DataFrame:
    """When the DEM of each slurry is at rest, and what it costs."""
    rows = read_result(RUN, "equilibrium").set_index("slurry")
    cost = read_result(RUN, "cost").query("stage == 'run_slurry'").set_index("slurry")
    columns = {
        "role": rows.role,
        "particles": rows.particles.map("{:,}".format),
        "density (g/cm³)": rows.density_g_cm3.map("{:.4f}".format),
        "contacts": rows.mean_contacts.map("{:.2f}".format),
        "drift in the last tenth": rows.density_drift.map("{:.1e}".format),
        "time to equilibrium (µs)": rows.time_to_equilibrium_us.map("{:.0f}".format),
        "CPU time (min)": (cost.cpu_s / 60).map("{:.1f}".format),
    }
    return pd.DataFrame(columns).loc[rows.index].reset_index()


def _exponent(jobs: pd.DataFrame) -> float:
    """Exponent of the CPU time of the largest jobs of each slurry against its particles; NaN with one size."""
    cpu_s = jobs.groupby("slurry").cpu_s.max()
    sizes = read_result(RUN, "equilibrium").set_index("slurry").particles.reindex(cpu_s.index).dropna()
    if sizes.nunique() < 2:
        return np.nan
    return np.polyfit(np.log(sizes), np.log(cpu_s[sizes.index]), 1)[0]


def published_stages() -> pd.DataFrame:
    """CPU time, its growth and memory of each stage, the longest job of each and all together."""
    rows = read_result(RUN, "cost")
    stages = rows[rows.max_rss_mb.notna()].groupby("stage", sort=False)
    columns = {
        "longest job (CPU s)": stages.cpu_s.max().map("{:,.1f}".format),
        "exponent": stages.apply(_exponent).map("{:.2f}".format, na_action="ignore"),
        "memory (MB)": stages.max_rss_mb.max().map("{:,.0f}".format),
        "all jobs (CPU min)": (stages.cpu_s.sum() / 60).map("{:,.1f}".format),
    }
    return pd.DataFrame(columns).rename_axis("stage").rename("`{}`".format).reset_index()


def published_pages() -> pd.DataFrame:
    """CPU time and memory of stages that keep no record of their cost, and how large their files are."""
    rows = pd.read_csv(REFERENCE / "pages" / "pages.csv")
    columns = {
        "stage": rows.stage.map("`{}`".format),
        "file": rows.file.map("`{}`".format),
        "CPU time (s)": rows.cpu_s.map("{:.1f}".format),
        "memory (MB)": rows.max_rss_mb.map("{:,.0f}".format),
        "file (MB)": rows.size_mb.map("{:.2f}".format),
    }
    return pd.DataFrame(columns)
