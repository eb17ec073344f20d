"""Numbers behind the verdicts of the evaluation's page, for the templates to word and format."""

import pandas as pd

from slurrycast.evaluation.noise import BAND_SDS
from slurrycast.evaluation.verdicts import by_verdict, judged, outcome
from slurrycast.report.evaluation_results import Evaluation, labels_of
from slurrycast.report.formats import SlurryValue, widest
from slurrycast.report.names import pair_name
from slurrycast.surrogates import continues_dem

AFFINE = "affine"
# Quantities that are judged together: the group's name and how they begin.
# The packing fractions say the same as the density again; the largest overlap is that of a single contact.
GROUPS = {"density": "density", "RDF": "rdf_", "contacts": "coordination_", "mean overlap": "overlap_mean"}
ERRORS_AT_EQUAL_COST = {"mse_um2": "coordinates", "density_error": "density", "rdf_error": "RDF"}
MOST_NAMED = 6  # cases that a sentence names one by one


def mean_and_worst(values: pd.Series, lowest_is_worst: bool = False) -> list[float | SlurryValue | None]:
    """Mean over slurries and the worst one, None where no value is known."""
    return [values.mean(), widest(values, lowest_is_worst)]


def verdict_numbers(evaluation: Evaluation) -> dict:
    """What each network adds, whether the best surrogate is within the tolerances, and all surrogates beside them."""
    rows = []
    for surrogate in labels_of(evaluation.structure_errors):
        density = evaluation.density_errors(surrogate)
        tested, validated = density.reindex(evaluation.test), density.reindex(evaluation.slurries("validation"))
        # the widest of all pairs decides
        rdf = evaluation.rdf_in_spreads(surrogate).reindex(evaluation.test).max(axis=1)
        missed_density = ", ".join(tested.index[tested > evaluation.density_tolerance]) or "none"
        missed_rdf = ", ".join(rdf.index[rdf > evaluation.rdf_tolerance]) or "none"
        row = [surrogate, evaluation.relaxed_for[surrogate], *mean_and_worst(tested), missed_density, validated.mean()]
        rows.append([*row, *mean_and_worst(rdf), missed_rdf])
    return {
        "rows": rows,
        "skills": network_skills(evaluation),
        "at_equal_cost": network_errors_at_equal_cost(evaluation),
        "rivals": better_for_less(evaluation),
        "ties": ties(evaluation),
        "tolerances": tolerances(evaluation),
    }


def network_skills(evaluation: Evaluation) -> list[dict]:
    """Skill of each network on the test slurries, 0 for the affine map, and whether it adds to it."""
    entries = []
    for network in evaluation.networks:
        skills = evaluation.skill[evaluation.skill.surrogate == network].set_index("slurry").skill
        skills = skills.reindex(evaluation.test).dropna()
        entries.append({"network": network, "skills": skills, "verdict": judged(-skills)})
    return entries


def network_errors_at_equal_cost(evaluation: Evaluation) -> list[dict]:
    """Each network beside early_dem: at equal cost, or beside the one whose cost is nearest, by what the note says.

    Each entry has `network`, `comparisons` and `notes`, which say why there are no comparisons.
    """
    entries = []
    for network in evaluation.networks:
        rows = evaluation.tested(evaluation.equal_cost)
        rows = rows[rows.surrogate == network]
        known = rows.dropna(subset=["early_dem_cost_share"])
        comparisons = []
        for note, group in known.groupby(known.note.astype(object).fillna(""), sort=False):
            verdicts, errors = {}, []
            for column, name in ERRORS_AT_EQUAL_COST.items():
                both = group[[column, f"early_dem_{column}"]].dropna()
                both.columns = ["network", "early_dem"]
                if not both.empty:
                    verdicts[name] = judged(both.network - both.early_dem)
                    errors.append((name, both.network.mean(), both.early_dem.mean()))
            comparisons.append(
                {
                    "note": note,
                    "slurries": len(group),
                    "cost": group.cost_share_of_full_dem.mean(),
                    "early_dem_cost": group.early_dem_cost_share.mean(),
                    "verdicts": by_verdict(verdicts),
                    "errors": errors,
                }
            )
        notes = list(dict.fromkeys(rows.note.dropna()))
        entries.append({"network": network, "comparisons": comparisons, "notes": notes})
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

    entries = []
    for network in (name for name in evaluation.networks if name in by_label):
        better = []
        for label, errors in by_label.items():
            difference = (errors - by_label[network]).dropna()
            cheaper = difference.cost_share_of_full_dem.mean() < 0
            if label not in evaluation.networks and cheaper and judged(difference.mse_um2) == "better":
                better.append(mse_and_cost(label))
        entries.append({"network": mse_and_cost(network), "better": sorted(better, key=lambda point: point[2])})
    return entries


def group_means(evaluation: Evaluation, surrogate: str, column: str) -> pd.DataFrame:
    """Mean of `column` of `relaxed` over each group of quantities: test slurries x groups."""
    relaxed = evaluation.relaxed(surrogate)
    means = {}
    for group, start in GROUPS.items():
        rows = relaxed[relaxed.quantity.str.startswith(start)]
        means[group] = rows.groupby("slurry")[column].mean().reindex(evaluation.test)
    return pd.DataFrame(means, dtype=float)


def deviations_to_judge(evaluation: Evaluation, surrogate: str) -> pd.DataFrame:
    """`group_means` of |value - that of the DEM|; the density's is a share of the DEM's, as wherever it is judged."""
    density = evaluation.density_errors(surrogate).reindex(evaluation.test)
    return group_means(evaluation, surrogate, "deviation").assign(density=density)


def ties(evaluation: Evaluation) -> list[dict]:
    """Whether affine and relaxation tie each network, and where both are within the noise of the DEM.

    `outcome` is that of `verdicts.outcome` over the groups. `in_sd` are (group, mean of the network, mean of affine).
    """
    entries = []
    for network in evaluation.networks:
        differences = deviations_to_judge(evaluation, network) - deviations_to_judge(evaluation, AFFINE)
        verdicts = {group: judged(differences[group]) for group in GROUPS if differences[group].notna().any()}
        in_sd = pd.DataFrame({name: group_means(evaluation, name, "in_sd").mean() for name in (network, AFFINE)})
        in_sd = in_sd.dropna()
        entries.append(
            {
                "network": network,
                "groups": list(verdicts),
                "verdicts": by_verdict(verdicts),
                "outcome": outcome(verdicts.values()),
                "in_sd": list(in_sd.itertuples(name=None)),
                "within_noise": list(in_sd.index[in_sd.max(axis=1) < BAND_SDS]),
            }
        )
    return entries


def tolerances(evaluation: Evaluation) -> list[dict]:
    """Whether the best surrogate, and the best one that does not go on with the DEM, is within both tolerances."""
    labels = labels_of(evaluation.structure_errors)
    choices = [evaluation.best(labels), evaluation.best([name for name in labels if not continues_dem(name)])]
    entries = []
    for place, choice in enumerate(choices):
        if choice is None or choice in choices[:place]:
            continue
        best, role = choice
        density = evaluation.density_errors(best).reindex(evaluation.test).dropna()
        rdf = evaluation.rdf_in_spreads(best).reindex(evaluation.test)
        rdf_cases = [
            (pair_name(quantity.removeprefix("rdf_")), slurry, value)
            for (slurry, quantity), value in rdf.stack().dropna().sort_values(ascending=False).items()
        ]
        missed = [case for case in rdf_cases if case[2] > evaluation.rdf_tolerance]
        entries.append(
            {
                "surrogate": best,
                "role": role,
                "of_all": place == 0,
                "densities": len(density),
                "met_densities": (density <= evaluation.density_tolerance).sum(),
                "largest_density": widest(density),
                "missed_densities": list(density[density > evaluation.density_tolerance].items()),
                "rdf_slurries": len(rdf),
                "rdf_cases": rdf_cases,
                "met_rdf": len(rdf_cases) - len(missed),
                "missed_rdf": missed,
                "named_rdf": missed[:MOST_NAMED],
                "further_rdf": len(missed[MOST_NAMED:]),
            }
        )
    return entries
