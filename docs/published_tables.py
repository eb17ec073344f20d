"""Tables of the run of the published size, in README.md and docs/published.md: each public function gives one."""

import pandas as pd

from reference_results import accuracy, density_errors, growth, network_training, read_result, slurries
from slurrycast.evaluation.verdicts import DIFFERS
from slurrycast.report import reference_article as article

RUN = "published"
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


def published_training() -> pd.DataFrame:
    """How far the network was trained, and what fits of a few coefficients reach."""
    return network_training(RUN, "linear", "vgg16", "linear_box")


def published_cost() -> pd.DataFrame:
    """Wall time of one slurry beside the claim of the article: medians over the test slurries."""
    rows = read_result(RUN, "article_costs").pivot(index="surrogate", columns="term", values="ours")
    rows.loc["article"] = {
        "full DEM": article.FULL_DEM_MIN,
        "hybrid": article.HYBRID_MIN,
        "full DEM / hybrid": article.COST_RATIO,
    }
    shown = ["article", *dict.fromkeys(read_result(RUN, "article_costs").surrogate)]
    forms = {
        "full DEM (min)": ("full DEM", "{:,.1f}"),
        "with the surrogate (min)": ("hybrid", "{:.2f}"),
        "ratio": ("full DEM / hybrid", "{:.1f}"),
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


def published_stages() -> pd.DataFrame:
    """CPU time and memory of the longest job of each stage."""
    rows = read_result(RUN, "cost")
    rows = rows[rows.max_rss_mb.notna()].groupby("stage", sort=False)[["cpu_s", "max_rss_mb"]].max()
    columns = {"CPU time (s)": rows.cpu_s.map("{:,.1f}".format), "memory (MB)": rows.max_rss_mb.map("{:,.0f}".format)}
    return pd.DataFrame(columns).rename_axis("stage").rename("`{}`".format).reset_index()
