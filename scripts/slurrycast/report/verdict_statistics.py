"""Numbers behind the verdicts of the evaluation's page, for the templates to word and format."""

import pandas as pd

from slurrycast.evaluation.verdicts import DIFFERS, EQUIVALENT, NOT_RESOLVED, by_verdict, compare, group_of
from slurrycast.report.evaluation_results import Evaluation, labels_of
from slurrycast.report.formats import SlurryValue, number, widest
from slurrycast.report.names import measure_name

ERRORS_AT_EQUAL_COST = {"mse_um2": "coordinates", "density_error": "density", "rdf_error": "RDF"}


def mean_and_worst(values: pd.Series, lowest_is_worst: bool = False) -> list[float | SlurryValue | None]:
    """Mean over slurries and the worst one, None where no value is known."""
    return [values.mean(), widest(values, lowest_is_worst)]


def network_verdicts(evaluation: Evaluation) -> dict:
    """What each network adds, and what does better for less."""
    return {
        "skills": network_skills(evaluation),
        "at_equal_cost": network_errors_at_equal_cost(evaluation),
        "rivals": better_for_less(evaluation),
    }


def counted(verdicts: pd.DataFrame, surrogate: str) -> tuple[pd.DataFrame, dict[str, int]]:
    """What is judged of a surrogate, rows of a table of verdicts, and how many of each verdict there are."""
    judged = verdicts[verdicts.surrogate == surrogate].dropna(subset=["verdict"])
    return judged, {name: int((judged.verdict == name).sum()) for name in (EQUIVALENT, NOT_RESOLVED, DIFFERS)}


def noise_verdicts(evaluation: Evaluation) -> dict:
    """tables/verdicts.csv by surrogate.

    `rows` are counts of verdicts, what is not equivalent and the measure that is farthest off; `inside` are the
    surrogates that are equivalent to the DEM in all judged measures; `nearest` is the one that is so in most, with how
    many these are and of how many, None where there is no verdict.
    """
    rows, inside, equivalent = [], [], {}
    for surrogate in labels_of(evaluation.structure_errors):
        judged, numbers = counted(evaluation.verdicts, surrogate)
        groups = judged.measure[judged.verdict != EQUIVALENT].map(group_of).value_counts(sort=False)
        counts, farthest = [None, None, None], None
        if not judged.empty:
            counts = list(numbers.values())
            equivalent[surrogate] = (counts[0], len(judged))
            row = judged.loc[judged.mean_in_sd.abs().idxmax()]
            farthest = f"{measure_name(row.measure)} ({number(row.mean_in_sd, '+.1f')})"
        named = ", ".join(f"{group} ({count})" if count > 1 else group for group, count in groups.items())
        density = evaluation.density_errors(surrogate).reindex(evaluation.test)
        rows.append([surrogate, *mean_and_worst(density), *counts, named, farthest])
        if counts[0] == len(judged):
            inside.append(surrogate)
    nearest = max(equivalent, key=lambda surrogate: equivalent[surrogate][0], default=None)
    return {"rows": rows, "inside": inside, "nearest": (nearest, *equivalent[nearest]) if equivalent else None}


def network_skills(evaluation: Evaluation) -> list[dict]:
    """Skill of each network on the test slurries, 0 for the affine map, and whether it adds to it."""
    skills = {}
    for network in evaluation.networks:
        of_network = evaluation.skill[evaluation.skill.surrogate == network].set_index("slurry").skill
        skills[network] = of_network.reindex(evaluation.test).dropna()
    verdicts = compare({network: -of_network for network, of_network in skills.items()})
    return [{"network": name, "skills": skills[name], "verdict": verdicts[name]} for name in skills]


def network_errors_at_equal_cost(evaluation: Evaluation) -> list[dict]:
    """Each network beside early_dem: at equal cost, or beside the one whose cost is nearest, by what the note says.

    Each entry has `network`, `comparisons` and `notes`, which say why there are no comparisons.
    """
    entries, differences = [], {}
    for network in evaluation.networks:
        rows = evaluation.tested(evaluation.equal_cost)
        rows = rows[rows.surrogate == network]
        known = rows.dropna(subset=["early_dem_cost_share"])
        comparisons = []
        for note, group in known.groupby(known.note.astype(object).fillna(""), sort=False):
            errors = []
            for column, name in ERRORS_AT_EQUAL_COST.items():
                both = group[[column, f"early_dem_{column}"]].dropna()
                both.columns = ["network", "early_dem"]
                if not both.empty:
                    differences[network, note, name] = both.network - both.early_dem
                    errors.append((name, both.network.mean(), both.early_dem.mean()))
            comparisons.append(
                {
                    "note": note,
                    "slurries": len(group),
                    "cost": group.cost_share_of_full_dem.mean(),
                    "early_dem_cost": group.early_dem_cost_share.mean(),
                    "errors": errors,
                }
            )
        notes = list(dict.fromkeys(rows.note.dropna()))
        entries.append({"network": network, "comparisons": comparisons, "notes": notes})
    verdicts = compare(differences)
    for entry in entries:
        for compared in entry["comparisons"]:
            of_errors = {name: verdicts[entry["network"], compared["note"], name] for name, *_ in compared["errors"]}
            compared["verdicts"] = by_verdict(of_errors)
    return entries


def better_for_less(evaluation: Evaluation) -> list[dict]:
    """For each network, what has none, costs less and predicts coordinates better, on the slurries that both have.

    Surrogates are (label, mean MSE in um2, mean cost as a share of the full DEM).
    """
    keys, columns = ["surrogate", "slurry"], ["cost_share_of_full_dem", "mse_um2"]
    points = evaluation.front[[*keys, columns[0]]].merge(evaluation.skill[[*keys, columns[1]]], on=keys)
    by_label = evaluation.tested(points).groupby("surrogate", sort=False)
    by_label = {label: rows.set_index("slurry")[columns] for label, rows in by_label}

    def mse_and_cost(label: str) -> tuple[str, float, float]:
        return label, by_label[label].mse_um2.mean(), by_label[label].cost_share_of_full_dem.mean()

    networks = [name for name in evaluation.networks if name in by_label]
    cheaper = {}
    for network in networks:
        for label, errors in by_label.items():
            difference = (errors - by_label[network]).dropna()
            if label not in evaluation.networks and difference.cost_share_of_full_dem.mean() < 0:
                cheaper[network, label] = difference.mse_um2
    better = [pair for pair, verdict in compare(cheaper).items() if verdict == "better"]
    entries = []
    for network in networks:
        rivals = [mse_and_cost(label) for of, label in better if of == network]
        entries.append({"network": mse_and_cost(network), "better": sorted(rivals, key=lambda point: point[2])})
    return entries
