"""The page of the evaluation: what surrogates are worth against cheap alternatives, the DEM's noise and its limit.

`Evaluation` holds the tables of a run; every sentence is computed from them. Means run over the slurries of role
`test`; those of role `validation`, on which choices are made, are shown beside them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from slurrycast import surrogates
from slurrycast.evaluation.front import mean_front, on_front
from slurrycast.evaluation.noise import BAND_SDS
from slurrycast.evaluation.relaxation import enough_steps, mean_errors
from slurrycast.evaluation.verdicts import (
    JUDGED_WORDS,
    TIE_RULE,
    deviations,
    judged,
    judged_list,
    quantity_name,
)
from slurrycast.report.page import (
    Heading,
    Notices,
    Points,
    Section,
    Table,
    Text,
    figure_block,
    listed,
    named,
    number,
    page_html,
    pair_name,
    span,
)

AFFINE = "affine"
# Quantities that are judged together: the group's name and how they begin.
# The packing fractions say the same as the density again; the largest overlap is that of a single contact.
GROUPS = {"density": "density", "RDF": "rdf_", "contacts": "coordination_", "mean overlap": "overlap_mean"}
MOST_NAMED = 6  # cases that a sentence names one by one
WIDEST_LEVEL, COVERED_WELL = 0.9, (0.85, 0.95)  # a calibrated level, and the coverages that keep to it


@dataclass(frozen=True)
class Evaluation:
    """Tables of a run as in results/<run>/tables, and what to judge them by."""

    run: str
    roles: Mapping[str, str]  # role by slurry
    networks: Sequence[str]  # labels that are held against affine and early_dem
    density_tolerance: float  # largest |density / that of the DEM - 1|
    rdf_tolerance: float  # largest mean |g - g of the DEM|, in replica spreads
    relaxed_for: Mapping[str, int]  # steps by surrogate
    skill: pd.DataFrame
    noise: pd.DataFrame
    structure_errors: pd.DataFrame
    front: pd.DataFrame
    equal_cost: pd.DataFrame
    cost_scaling: pd.DataFrame
    article_costs: pd.DataFrame
    ablation: pd.DataFrame | None
    relaxation: pd.DataFrame | None  # of the validation slurries
    uncertainty: pd.DataFrame | None  # where a surrogate has a spread
    figures: Mapping[str, Path]

    def slurries(self, role: str) -> list[str]:
        """Ids of the slurries of one role."""
        return [slurry for slurry, own in self.roles.items() if own == role]

    @property
    def test(self) -> list[str]:
        """Ids of the slurries that means run over."""
        return self.slurries("test")

    def relaxed(self, surrogate: str) -> pd.DataFrame:
        """Deviations of the relaxed structures of `surrogate`: slurry, quantity, value, dem_value, deviation, in_sd."""
        table = deviations(self.structure_errors)
        return table[(table.stage == "relaxed") & (table.surrogate == surrogate)]

    def density_errors(self, surrogate: str) -> pd.Series:
        """|density / that of the DEM - 1| after relaxation, by slurry."""
        own = self.relaxed(surrogate)
        own = own[own.quantity == "density_g_cm3"].set_index("slurry")
        return (own.deviation / own.dem_value).rename("density")

    def rdf_in_spreads(self, surrogate: str) -> pd.DataFrame:
        """Mean |g - g of the DEM| after relaxation in replica spreads: slurries x rdf quantities."""
        own = self.relaxed(surrogate)
        own = own[own.quantity.str.startswith("rdf_")]
        return own.pivot_table(index="slurry", columns="quantity", values="in_sd", sort=False)

    def best(self, labels: Sequence[str]) -> tuple[str, str] | None:
        """The one of `labels` with the lowest mean density error after relaxation, and the role that says so.

        The validation slurries say it where there are any, so that the test slurries are only evaluated.
        """
        for role in ("validation", "test"):
            errors = {name: self.density_errors(name).reindex(self.slurries(role)).mean() for name in labels}
            known = pd.Series(errors, dtype=float).dropna()
            if not known.empty:
                return str(known.idxmin()), role
        return None


def labels_of(table: pd.DataFrame) -> list[str]:
    """Labels of a table in their order."""
    return list(dict.fromkeys(table.surrogate))


# ---- verdicts


def skill_sentences(evaluation: Evaluation) -> list[str]:
    """What each network adds to the affine map in skill."""
    sentences = []
    for network in evaluation.networks:
        own = evaluation.skill[evaluation.skill.surrogate == network].set_index("slurry").skill
        own = own.reindex(evaluation.test).dropna()
        if own.empty:
            sentences.append(f"{network}: no test slurry has a skill.")
            continue
        verdict = judged(-own)
        words = {"better": "it adds to the affine map", "worse": "it is worse than the affine map"}
        words |= {"tie": "it ties the affine map", None: f"{JUDGED_WORDS[None]} it"}
        sentences.append(
            f"{network} has a mean skill of {own.mean():z.2f} over the test slurries ({span(own, 'z.2f')}), where 0 is "
            f"the affine map and 1 the limit that the DEM itself sets: {words[verdict]}."
        )
    return sentences


ERRORS_AT_EQUAL_COST = {"mse_um2": "coordinates", "density_error": "density", "rdf_error": "RDF"}


def equal_cost_sentences(evaluation: Evaluation) -> list[str]:
    """What each network adds over the DEM hurried on: at equal cost, or beside the one whose cost is nearest."""
    sentences = []
    for network in evaluation.networks:
        own = evaluation.equal_cost
        own = own[(own.surrogate == network) & own.slurry.isin(evaluation.test)]
        known = own.dropna(subset=["early_dem_cost_share"])
        for note, rows in known.groupby(known.note.astype(object).fillna(""), sort=False):
            cost, theirs = rows.cost_share_of_full_dem.mean(), rows.early_dem_cost_share.mean()
            on = f"on {len(rows)} of {len(evaluation.test)} test slurries"
            if note:
                opening = (
                    f"{network} is {note} {on}, {cost:.1%} of the full DEM against {theirs:.1%}; beside the nearest"
                )
            else:
                opening = f"{network} against early_dem at equal cost, {cost:.1%} of the full DEM, {on}"
            verdicts, means = {}, []
            for column, words in ERRORS_AT_EQUAL_COST.items():
                both = rows[[column, f"early_dem_{column}"]].dropna()
                if not both.empty:
                    verdicts[words] = judged(both[column] - both[f"early_dem_{column}"])
                    means.append(f"{words} {both[column].mean():.3g} against {both[f'early_dem_{column}'].mean():.3g}")
            sentences.append(f"{opening}: {judged_list(verdicts)} (mean errors: {'; '.join(means)}).")
        if known.empty:
            notes = list(dict.fromkeys(own.note.dropna()))
            reason = f": {'; '.join(notes)}" if notes else ""
            sentences.append(f"{network} cannot be compared with early_dem on any test slurry{reason}.")
    return sentences


def better_for_less_sentences(evaluation: Evaluation) -> list[str]:
    """For each network, what has none, costs less and predicts coordinates better, on the slurries that both have."""
    keys, columns = ["surrogate", "slurry"], ["cost_share_of_full_dem", "mse_um2"]
    points = evaluation.front[[*keys, columns[0]]].merge(evaluation.skill[[*keys, columns[1]]], on=keys)
    points = points[points.slurry.isin(evaluation.test)]
    by_label = {label: own.set_index("slurry")[columns] for label, own in points.groupby("surrogate", sort=False)}
    sentences = []
    for network in evaluation.networks:
        own = by_label.get(network)
        if own is None:
            continue
        better = {}
        for label, theirs in by_label.items():
            difference = (theirs - own).dropna()
            cheaper = difference.cost_share_of_full_dem.mean() < 0
            if label not in evaluation.networks and cheaper and judged(difference.mse_um2) == "better":
                better[label] = theirs.cost_share_of_full_dem.mean()
        subject = _mse_and_cost(network, own)
        if better:
            those = listed([_mse_and_cost(label, by_label[label]) for label in sorted(better, key=better.get)])
            sentences.append(f"Better than {subject}, and for less: {those}.")
        else:
            sentences.append(f"Nothing without a network predicts coordinates better than {subject} for less.")
    return sentences


def _mse_and_cost(label: str, own: pd.DataFrame) -> str:
    return f"{label} ({own.mse_um2.mean():.3f} µm² at {own.cost_share_of_full_dem.mean():.1%})"


def group_means(evaluation: Evaluation, surrogate: str, column: str) -> pd.DataFrame:
    """Mean of `column` of `relaxed` over each group of quantities: test slurries x groups."""
    own = evaluation.relaxed(surrogate)
    columns = {}
    for group, start in GROUPS.items():
        of_group = own[own.quantity.str.startswith(start)]
        columns[group] = of_group.groupby("slurry")[column].mean().reindex(evaluation.test)
    return pd.DataFrame(columns, dtype=float)


def deviations_to_judge(evaluation: Evaluation, surrogate: str) -> pd.DataFrame:
    """`group_means` of |value - that of the DEM|; the density's is a share of the DEM's, as wherever it is judged."""
    density = evaluation.density_errors(surrogate).reindex(evaluation.test)
    return group_means(evaluation, surrogate, "deviation").assign(density=density)


def tie_sentences(evaluation: Evaluation) -> list[str]:
    """Whether affine and relaxation tie each network, and where both are within the noise of the DEM."""
    reference = deviations_to_judge(evaluation, AFFINE)
    reference_in_sd = group_means(evaluation, AFFINE, "in_sd").mean()
    sentences = []
    for network in evaluation.networks:
        differences = deviations_to_judge(evaluation, network) - reference
        groups = [group for group in GROUPS if differences[group].notna().any()]
        if not groups:
            sentences.append(f"{network} and affine have no relaxed structure in common to compare.")
            continue
        verdicts = {group: judged(differences[group]) for group in groups}
        found = set(verdicts.values())
        if found == {"tie"}:
            opening = f"After relaxation affine ties {network} in {listed(groups)}"
        elif found == {None}:
            opening = f"After relaxation, {network} against affine: {JUDGED_WORDS[None]}"
        elif found <= {"tie", "worse"}:
            opening = f"After relaxation {network} adds nothing to affine: {judged_list(verdicts)}"
        else:
            opening = f"After relaxation, {network} against affine: {judged_list(verdicts)}"
        in_sd = pd.DataFrame({network: group_means(evaluation, network, "in_sd").mean(), AFFINE: reference_in_sd})
        in_sd = in_sd.dropna()
        if in_sd.empty:
            sentences.append(f"{opening}. How much that is against the scatter of replicas is not known.")
            continue
        sizes = [f"{group} {row[network]:.2g} and {row[AFFINE]:.2g}" for group, row in in_sd.iterrows()]
        within = [group for group, row in in_sd.iterrows() if row.max() < BAND_SDS]
        sentences.append(
            f"{opening}. Mean deviations from the DEM in replica sd (of an RDF: replica spreads), {network} first: "
            f"{'; '.join(sizes)}. Both are within the noise of the DEM, {BAND_SDS} of these, in: "
            f"{listed(within) if within else 'none of them'}."
        )
    return sentences


def tolerance_sentences(evaluation: Evaluation) -> list[str]:
    """Whether the best surrogate, and the best one that does not go on with the DEM, is within both tolerances."""
    labels = labels_of(evaluation.structure_errors)
    chosen = [evaluation.best(labels), evaluation.best([name for name in labels if not _goes_on(name)])]
    sentences = []
    for place, choice in enumerate(chosen):
        if choice is None or choice in chosen[:place]:
            continue
        best, role = choice
        picked = "" if role == "validation" else "; without validation slurries it was picked on those it is judged on"
        among = "all surrogates" if place == 0 else "those that do not go on with the DEM"
        sentences.append(
            f"{best} has the lowest mean density error after relaxation on the {role} slurries, of {among}{picked}."
        )
        density = evaluation.density_errors(best).reindex(evaluation.test).dropna()
        sentences.append(
            f"Density error of {best}, at most {evaluation.density_tolerance:.2%} wanted: "
            f"{tolerance_words(density, evaluation.density_tolerance, '.2%')}."
        )
        in_spreads = evaluation.rdf_in_spreads(best).reindex(evaluation.test)
        in_spreads.columns = [pair_name(quantity.removeprefix("rdf_")) for quantity in in_spreads]
        sentences.append(
            f"RDF difference of {best}, at most {evaluation.rdf_tolerance:g} replica spreads wanted: "
            f"{rdf_tolerance_words(in_spreads, evaluation.rdf_tolerance)}."
        )
    return sentences


def _goes_on(label: str) -> bool:
    return surrogates.continues_dem(label)


def tolerance_words(values: pd.Series, tolerance: float, form: str) -> str:
    """Say on how many slurries `values` (by slurry) are within `tolerance`, and which miss it."""
    if values.empty:
        return "no test slurry to judge it on"
    missed = values[values > tolerance]
    if missed.empty:
        return f"met on all {len(values)} test slurries, at most {values.max():{form}} (slurry {values.idxmax()})"
    those = listed([f"slurry {slurry} ({value:{form}})" for slurry, value in missed.items()])
    return f"met on {len(values) - len(missed)} of {len(values)} test slurries, missed on {those}"


def rdf_tolerance_words(in_spreads: pd.DataFrame, tolerance: float) -> str:
    """Say for how many slurries (rows) and pairs (columns) differences are within `tolerance`, and which miss it."""
    values = in_spreads.stack().dropna()
    if values.empty:
        return "no test slurry to judge it on"
    missed = values[values > tolerance].sort_values(ascending=False)
    slurry, pair = values.idxmax()
    if missed.empty:
        widest = f"at most {values.max():.2f} ({pair} on slurry {slurry})"
        return f"met for all pairs on all {len(in_spreads)} test slurries, {widest}"
    those = [f"{pair} on slurry {slurry} ({value:.2f})" for (slurry, pair), value in missed.items()]
    if len(those) > MOST_NAMED:
        those = [*those[:MOST_NAMED], f"{len(those) - MOST_NAMED} more"]
    return (
        f"met in {len(values) - len(missed)} of {len(values)} cases (pair and test slurry), missed for {listed(those)}"
    )


# ---- sections


def mean_and_worst(values: pd.Series, form: str, lowest_is_worst: bool = False) -> list[str]:
    """Texts of the mean over slurries and of the worst one."""
    known = values.dropna()
    if known.empty:
        return ["–", "–"]
    worst = known.idxmin() if lowest_is_worst else known.idxmax()
    return [f"{known.mean():{form}}", f"{known[worst]:{form}} (slurry {worst})"]


def verdict_section(evaluation: Evaluation) -> Section:
    """Sentences on the questions that the evaluation is there for, and all surrogates against the tolerances."""
    rows = []
    for surrogate in labels_of(evaluation.structure_errors):
        density = evaluation.density_errors(surrogate)
        in_spreads = evaluation.rdf_in_spreads(surrogate)
        tested, validated = density.reindex(evaluation.test), density.reindex(evaluation.slurries("validation"))
        # the widest of all pairs decides
        widest = in_spreads.reindex(evaluation.test).max(axis=1)
        missed = [
            list(values.index[values > tolerance]) for values, tolerance in _with_tolerances(evaluation, tested, widest)
        ]
        rows.append(
            [
                surrogate,
                f"{evaluation.relaxed_for[surrogate]:,}",
                *mean_and_worst(tested, ".2%"),
                ", ".join(missed[0]) or "none",
                number(validated.mean(), ".2%"),
                *mean_and_worst(widest, ".2f"),
                ", ".join(missed[1]) or "none",
            ]
        )
    errors = ["mean", "worst", "above the tolerance", "mean, validation", "mean", "worst", "above the tolerance"]
    columns = ["Surrogate", "steps", *errors]
    groups = [("", 1), ("Relaxation", 1), ("Density error after relaxation", 4)]
    groups += [("Widest RDF difference (replica spreads)", 3)]
    caption = (
        "Every surrogate after relaxation against the tolerances: a density error of "
        f"{evaluation.density_tolerance:.2%}, and of the RDF {evaluation.rdf_tolerance:g} replica spreads for the pair "
        f"of phases that differs most. Means over the test {named(evaluation.test)}. From tables/structure_errors.csv."
    )
    judged_by = (
        f"{TIE_RULE} The scatter between replicas only gives the size of an effect: replica sd, and of an RDF the "
        "replica spread, the mean difference between two replicas."
    )
    return Section(
        "What the evaluation says",
        [
            Heading("What the network adds to the affine map, before relaxation"),
            Points(skill_sentences(evaluation)),
            Heading("What it adds to the DEM itself, hurried on at equal cost"),
            Points(equal_cost_sentences(evaluation)),
            Heading("What does better for less"),
            Points(better_for_less_sentences(evaluation)),
            Heading("Whether affine and relaxation do as well"),
            Points(tie_sentences(evaluation)),
            Heading("Whether the best surrogate is within the tolerances"),
            Points(tolerance_sentences(evaluation)),
            Text(judged_by),
            Table("Table E1", caption, columns, rows, texts=(0, 4, 8), groups=groups),
        ],
    )


def _with_tolerances(evaluation: Evaluation, density: pd.Series, rdf: pd.Series) -> list[tuple[pd.Series, float]]:
    return [(density, evaluation.density_tolerance), (rdf, evaluation.rdf_tolerance)]


def skill_section(evaluation: Evaluation) -> Section:
    """tables/skill.csv."""
    rows = []
    for surrogate, own in evaluation.skill.groupby("surrogate", sort=False):
        by_slurry = own.set_index("slurry")
        tested = by_slurry.reindex(evaluation.test)
        validated = by_slurry.skill.reindex(evaluation.slurries("validation"))
        ratio = (tested.mse_um2 / tested.mse_affine_um2).mean()
        means = [number(tested.mse_um2.mean()), number(ratio)]
        rows.append([surrogate, *means, *mean_and_worst(tested.skill, "z.2f", True), number(validated.mean(), "z.2f")])
    columns = ["Surrogate", "MSE (µm²)", "MSE / that of affine", "skill", "worst skill", "skill, validation"]
    known = evaluation.skill[evaluation.skill.slurry.isin(evaluation.test)]
    means = known.groupby("surrogate", sort=False).skill.mean().dropna()
    sentence = f" The highest mean is that of {means.idxmax()} ({means.max():z.2f})." if len(means) else ""
    caption = (
        "Skill is 1 − (MSE − floor) / (MSE of affine − floor): 0 is the affine map, 1 the limit, where the floor is "
        f"what a DEM run moved by a hair ends away from itself. Means over the test slurries.{sentence} From "
        "tables/skill.csv."
    )
    figure = figure_block(evaluation.figures, "skill", "Fig. E1", "Skill of every surrogate on each slurry.")
    return Section("Skill", [Table("Table E2", caption, columns, rows), *figure])


def noise_section(evaluation: Evaluation) -> Section:
    """tables/noise.csv: a column pair a replicated slurry."""
    noise = evaluation.noise
    slurries = list(dict.fromkeys(noise.slurry))
    by_key = noise.set_index(["slurry", "quantity"])
    rows = []
    for quantity in dict.fromkeys(noise.quantity):
        cells = []
        for slurry in slurries:
            known = (slurry, quantity) in by_key.index
            forms = {"mean": ".4g", "sd": ".2g"}
            cells += [
                number(by_key.loc[(slurry, quantity), name], form) if known else "–" for name, form in forms.items()
            ]
        rows.append([quantity_name(quantity), *cells])
    sentences = []
    for slurry in slurries:
        own = by_key.loc[slurry]
        if "density_g_cm3" in own.index:
            density = own.loc["density_g_cm3"]
            sentences.append(
                f"{density.runs:.0f} DEM runs of slurry {slurry} with other seeds ({density.particles:,.0f} "
                f"particles) end at {density['mean']:.4f} g/cm³ with a band of ±{2 * density.sd:.4f} g/cm³ "
                f"(±{2 * density.sd / density['mean']:.2%})."
            )
        if "perturbation_floor_um2" in own.index:
            floor = own["mean"]["perturbation_floor_um2"]
            sentences.append(f"A perturbed run of slurry {slurry} ends {floor:.3g} µm² (MSE) away from it.")
    columns = ["Quantity", *["mean", "sd"] * len(slurries)]
    groups = [("", 1), *((f"Slurry {slurry}", 2) for slurry in slurries)]
    caption = (
        "Replicas: the same slurry, other seeds. For an RDF, the mean is the mean difference |Δg| between two "
        "replicas, its spread. From tables/noise.csv."
    )
    return Section("Noise of the DEM", [Points(sentences), Table("Table E3", caption, columns, rows, groups=groups)])


def structure_section(evaluation: Evaluation) -> Section:
    """tables/structure_errors.csv."""
    table = deviations(evaluation.structure_errors)
    tested = table[table.slurry.isin(evaluation.test)]
    labels = surrogates.main_labels(labels_of(tested))
    blocks, count = [], 0
    for stage in ("predicted", "relaxed"):
        of_stage = tested[tested.stage == stage]
        for column, words in (("deviation", "absolute"), ("in_sd", "in replica sd")):
            means = of_stage.pivot_table(index="quantity", columns="surrogate", values=column, sort=False)
            rows = [
                [quantity_name(quantity), *(number(means.loc[quantity].get(name)) for name in labels)]
                for quantity in means.index
            ]
            count += 1
            caption = (
                f"Mean |value − that of the DEM| of the {stage} structure over the test slurries, {words}. Variants, "
                "earlier input frames and every slurry: tables/structure_errors.csv."
            )
            blocks.append(Table(f"Table E4.{count}", caption, ["Quantity", *labels], rows))
    caption = (
        "Mean deviation of relaxed structures from the DEM in replica sd (of an RDF: replica spreads), over the test "
        "slurries."
    )
    in_sd = pd.DataFrame({name: group_means(evaluation, name, "in_sd").mean() for name in labels_of(tested)})
    for group, means in in_sd.dropna(how="all").iterrows():
        caption += (
            f" In {group}, {means.idxmin()} is nearest to the DEM ({means.min():.2g}), {means.idxmax()} farthest "
            f"({means.max():.2g})."
        )
    figure = figure_block(evaluation.figures, "structure", "Fig. E2", caption)
    return Section("Structure", [*figure, *blocks])


FRONT_CAPTION = (
    "Error against cost: of the predicted coordinates as a share of the affine map's, and of density and RDF after "
    "relaxation. A surrogate with several last input frames is one line in their order, with the numbers of the frames."
)


def front_section(evaluation: Evaluation) -> Section:
    """tables/front.csv."""
    tested = evaluation.front[evaluation.front.slurry.isin(evaluation.test)]
    rows = []
    for (surrogate, frame), own in tested.groupby(["surrogate", "input_last_frame"], sort=False):
        by_slurry = own.set_index("slurry")
        density, rdf = mean_and_worst(by_slurry.density_error, ".2%"), mean_and_worst(by_slurry.rdf_error, ".3g")
        rows.append([surrogate, f"{frame}", f"{by_slurry.cost_share_of_full_dem.mean():.1%}", *density, *rdf])
    columns = ["Surrogate", "Last input frame", "Cost / full DEM", "mean", "worst", "mean", "worst"]
    groups = [("", 3), ("Density error", 2), ("RDF error, |Δg|", 2)]
    caption = (
        "Structural error after relaxation and cost end to end of every surrogate and input frame, means over the test "
        "slurries. From tables/front.csv."
    )
    sentence = "No test slurry has both."
    if not tested.empty:
        means = mean_front(tested)
        sentence = "On the front no other one is at most as dear and better; the full DEM, with no error, counts too."
        for column, words in (("density_error", "density"), ("rdf_error", "RDF")):
            those = means.surrogate[on_front(means.cost_share_of_full_dem, means[column])]
            sentence += f" On that of {words} error against cost: {listed([*those, 'the full DEM'])}."
        sentence += " Order within the band of the DEM's own noise is not resolved."
    figure = figure_block(evaluation.figures, "front", "Fig. E3", f"{FRONT_CAPTION} {sentence}")
    table = Table("Table E5", caption, columns, rows, groups=groups)
    return Section("Error against cost", [*figure, table] if figure else [Text(sentence), table])


def equal_cost_section(evaluation: Evaluation) -> Section:
    """tables/equal_cost.csv."""
    tested = evaluation.equal_cost[evaluation.equal_cost.slurry.isin(evaluation.test)]
    rows = []
    for surrogate, own in tested.groupby("surrogate", sort=False):
        known = own.dropna(subset=["early_dem_cost_share"])
        cells = []
        for column, form in {"cost_share": ".1%", **dict.fromkeys(ERRORS_AT_EQUAL_COST, ".3g")}.items():
            ours = "cost_share_of_full_dem" if column == "cost_share" else column
            both = known[[ours, f"early_dem_{column}"]].dropna()
            cells += [number(both[name].mean(), form) for name in both]
        notes = own.note.dropna().value_counts()
        beyond = "; ".join(f"{note} ({count})" for note, count in notes.items())
        rows.append([surrogate, *cells, f"{own.note.isna().sum()} of {len(own)}", beyond])
    words = ("Cost / full DEM", "MSE (µm²)", "Density error", "RDF error, |Δg|")
    columns = ["Surrogate", *["own", "early_dem"] * 4, "Slurries at equal cost", "The others"]
    groups = [("", 1), *((word, 2) for word in words), ("", 2)]
    caption = (
        "Each surrogate beside the DEM itself, hurried on with a faster barostat, at the same cost end to end: the "
        "errors of the one with the lowest MSE that costs at most as much, of all barostats and input frames, "
        "interpolated in between. Where none costs the same, beside the nearest in cost. Means over the test slurries "
        "where both are known. From tables/equal_cost.csv."
    )
    table = Table("Table E6", caption, columns, rows, texts=(0, 10), groups=groups)
    return Section("At equal cost", [Points(equal_cost_sentences(evaluation)), table])


UNITS = {"um2": "µm²", "um": "µm", "us": "µs", "s": "s", "min": "min", "g_cm3": "g/cm³"}


def heading(column: str) -> str:
    """Name of a column in words, with its unit in brackets: "validation mse (µm²)" of `validation_mse_um2`."""
    for ending, unit in UNITS.items():
        if column.endswith(f"_{ending}"):
            return f"{column.removesuffix(f'_{ending}').replace('_', ' ')} ({unit})"
    return column.replace("_", " ")


def plain_table(label: str, caption: str, table: pd.DataFrame) -> Table:
    """All rows and columns of `table` as they are, numbers with three digits."""
    texts = [place for place, column in enumerate(table) if not pd.api.types.is_numeric_dtype(table[column])]
    rows = [
        [cell if isinstance(cell, str) else number(cell, ",.0f" if abs(cell) >= 1000 else ".3g") for cell in row]
        for row in table.astype(object).itertuples(index=False)
    ]
    return Table(label, caption, [heading(column) for column in table], rows, texts=texts)


def payback_words(row: pd.Series) -> str:
    """Say when the training of one row of tables/cost_scaling.csv is paid back, never, or why that is not known."""
    if pd.isna(row.training_s):
        return "what its training took is not known, so neither is when it is paid back"
    if pd.isna(row.saved_s_per_slurry):
        return "no test slurry says when its training is paid back"
    if row.saved_s_per_slurry <= 0:
        return (
            f"its training is never paid back: the hybrid takes {-row.saved_s_per_slurry:,.3g} s longer than the full "
            "DEM (median of the test slurries)"
        )
    return (
        f"its training is paid back after {row.slurries_to_pay_training:,.0f} slurries, with the DEM of the training "
        f"slurries after {row.slurries_to_pay_training_and_dem:,.0f}"
    )


def payback_sentences(evaluation: Evaluation) -> list[str]:
    """When the training of each network is paid back, and how the cost with it grows, by wall clock."""
    scaling = evaluation.cost_scaling[evaluation.cost_scaling.clock == "wall_s"].set_index("surrogate")
    sentences = []
    for network in [name for name in evaluation.networks if name in scaling.index]:
        row = scaling.loc[network]
        sizes = f"{row.slurries:.0f} slurries of {row.fewest_particles:,.0f} to {row.most_particles:,.0f} particles"
        growth = f"{sizes} are too few or too alike to say how cost grows with size"
        if pd.notna(row.hybrid_exponent):
            growth = (
                f"over {sizes}, wall time of the hybrid goes with the number of particles to the "
                f"{row.hybrid_exponent:.2f} ± {row.hybrid_exponent_se:.2f}, of the full DEM to the "
                f"{row.dem_exponent:.2f} ± {row.dem_exponent_se:.2f} (standard errors)"
            )
        sentences.append(f"With {network}, {payback_words(row)}; {growth}.")
    return sentences


def cost_section(evaluation: Evaluation) -> Section:
    """tables/cost_scaling.csv and tables/article_costs.csv."""
    scaling, claims = evaluation.cost_scaling, evaluation.article_costs
    scaling = scaling[scaling.surrogate.isin(surrogates.main_labels(labels_of(scaling)))]
    caption = (
        "How cost grows with the number of particles (the exponent of a power law and its standard error, se, over all "
        "slurries with a full DEM; none for less than 3 slurries or sizes within a factor of 2), what learning costs "
        "once, and after how many slurries it is paid back by what a test slurry saves (median). Variants and earlier "
        "input frames: tables/cost_scaling.csv."
    )
    blocks = [plain_table("Table E7", caption, scaling)]
    caption = (
        "What the article says of its cost, and ours term by term, a column a surrogate; other machines and another "
        "scale. From tables/article_costs.csv."
    )
    labels = surrogates.main_labels(labels_of(claims))
    terms = [column for column in ("term", "unit", "article", "article_says") if column in claims]
    words = ["unit", "article_says"]  # both can be empty for all terms, and then are no text
    ours = claims[claims.surrogate.isin(labels)].astype(dict.fromkeys(words, object)).fillna(dict.fromkeys(words, ""))
    wide = ours.drop_duplicates(terms)[terms]
    for name in labels:
        own = ours[ours.surrogate == name]
        wide = wide.merge(own[["term", "ours"]].rename(columns={"ours": name}), on="term", how="left")
    return Section("Cost", [Points(payback_sentences(evaluation)), *blocks, plain_table("Table E8", caption, wide)])


def ablation_section(evaluation: Evaluation) -> Section | None:
    """tables/ablation.csv, where the run has one."""
    if evaluation.ablation is None:
        return None
    caption = "What each change from the published network buys."
    scored = evaluation.ablation.set_index("surrogate").validation_mse_um2.dropna()
    if len(scored):
        caption += f" The lowest MSE on the validation slurries is that of {scored.idxmin()}, {scored.min():.3g} µm²."
    caption += " From tables/ablation.csv."
    return Section("Ablation", [plain_table("Table E9", caption, evaluation.ablation)])


def relaxation_sentence(evaluation: Evaluation) -> str:
    """After how many steps each surrogate is within the band of the replicas."""
    tried = sorted(set(evaluation.relaxation.steps))
    by_steps = {}
    for name, steps in enough_steps(evaluation.relaxation).items():
        by_steps.setdefault(tuple(steps), []).append(name)
    parts = [
        f"{listed([f'{number:,}' for number in steps]) if steps else 'none of them'} for {listed(names)}"
        for steps, names in sorted(by_steps.items(), key=lambda part: (not part[0], part[0]))
    ]
    slurries = list(dict.fromkeys(evaluation.relaxation.slurry))
    return (
        f"Steps of relaxation, of {listed([f'{steps:,}' for steps in tried])}, after which the density is "
        f"within {BAND_SDS} replica sd and the RDF within {evaluation.rdf_tolerance:g} replica spreads of the DEM, for "
        f"validation {named(slurries)}: {'; '.join(parts)}."
    )


def relaxation_section(evaluation: Evaluation) -> Section | None:
    """tables/relaxation.csv, where the run has validation slurries."""
    table = evaluation.relaxation
    if table is None:
        return None
    labels, tried = labels_of(table), sorted(set(table.steps))
    found, by_surrogate = enough_steps(table), table.groupby("surrogate")
    overlap = by_surrogate.overlap_mean_predicted.mean()
    means = {column: mean_errors(table, column, labels) for column in ("density_in_sd", "rdf_in_spread", "cpu_s")}
    rows = []
    for name in labels:
        cells = [number(means[column].loc[name, steps]) for column in means for steps in tried]
        rows.append([name, f"{overlap[name]:.2%}", *cells, listed([f"{steps:,}" for steps in found[name]]) or "none"])
    columns = ["Surrogate", "predicted", *[f"{steps:,}" for steps in tried] * len(means), "within the band"]
    groups = [("", 1), ("Mean overlap", 1), ("Density error (replica sd)", len(tried))]
    groups += [("RDF difference (replica spreads)", len(tried)), ("CPU time (s)", len(tried)), ("Steps", 1)]
    caption = (
        "Predictions after relaxations of so many steps, each cooling to the temperature of the DEM at its end: means "
        "over the validation slurries. Mean overlap is that of the contacts of the prediction before relaxation, as a "
        "share of Ri + Rj. From tables/relaxation.csv."
    )
    sentence = relaxation_sentence(evaluation)
    shown = "Distance from the end of the DEM against steps of relaxation, means over the validation slurries."
    figure = figure_block(evaluation.figures, "relaxation", "Fig. E4", shown)
    blocks = [Points([sentence]), *figure, Table("Table E10", caption, columns, rows, groups=groups)]
    return Section("Physics in the loop: how long to relax", blocks)


def uncertainty_sentences(evaluation: Evaluation) -> list[str]:
    """Whether the calibrated intervals of each surrogate cover what they should on test slurries, and rank errors."""
    sentences = []
    low, high = COVERED_WELL
    for surrogate, own in evaluation.uncertainty.groupby("surrogate", sort=False):
        tested = own[own.slurry.isin(evaluation.test) & np.isclose(own.level, WIDEST_LEVEL)].set_index("slurry")
        opening = f"The {WIDEST_LEVEL:.0%} intervals of {surrogate}, calibrated on the validation slurries,"
        if tested.empty:
            sentences.append(f"{opening} have no test slurry to be judged on.")
            continue
        covered = tested.coverage.between(low, high)
        sentence = (
            f"{opening} cover {low:.0%} to {high:.0%} of the coordinates on {covered.sum()} of {len(tested)} test "
            f"slurries (all: {span(tested.coverage, '.1%')})"
        )
        known = tested.rank_correlation.dropna()
        ranks = "and no test slurry has particles of different spread, so it ranks nothing"
        if not known.empty:
            ranks = f"and the rank correlation of a particle's spread and its error is {span(known, 'z.2f')}"
        sentences.append(f"{sentence}, {ranks}.")
    return sentences


def uncertainty_section(evaluation: Evaluation) -> Section | None:
    """tables/uncertainty.csv, where a surrogate of the run says how sure it is."""
    table = evaluation.uncertainty
    if table is None:
        return None
    levels = sorted(set(table.level))
    rows = []
    for (surrogate, slurry), own in table.groupby(["surrogate", "slurry"], sort=False):
        by_level, first = own.set_index("level").reindex(levels), own.iloc[0]
        cells = [text for row in by_level.itertuples() for text in (number(row.factor), number(row.coverage, ".1%"))]
        means = [number(first[name]) for name in ("mean_spread_um", "rms_error_um")]
        rows.append([surrogate, slurry, first.role, *cells, number(first.rank_correlation, "z.2f"), *means])
    columns = ["Surrogate", "Slurry", "Role", *["factor", "coverage"] * len(levels)]
    columns += ["Rank correlation", "Mean spread (µm)", "RMS error (µm)"]
    groups = [("", 3), *((f"{level:.0%} intervals", 2) for level in levels), ("", 3)]
    caption = (
        "What the spread that a surrogate gives is worth. An interval is the coordinate ± factor × spread; the factor "
        "of a level is a conformal quantile over the coordinates of the validation slurries, so the rows of these only "
        "show that it was found there. Coverage is the share of coordinates within the interval. Rank correlation: "
        "Spearman's, of a particle's spread and the length of its error. From tables/uncertainty.csv."
    )
    sentences = uncertainty_sentences(evaluation)
    of_figure = (
        "Left: errors within the interval of a level, by the spread as it comes, taken as the standard deviation of a "
        "normal error (lines), and calibrated (dots). Right: error against spread, in bins of equally many "
        "coordinates. Dashed: what is expected."
    )
    figure = figure_block(evaluation.figures, "uncertainty", "Fig. E5", of_figure)
    table = Table("Table E11", caption, columns, rows, texts=(0, 1, 2), groups=groups)
    return Section("Uncertainty", [Points(sentences), *figure, table])


def evaluation_html(evaluation: Evaluation) -> str:
    """The page as one HTML text that loads nothing from elsewhere."""
    sections = [
        verdict_section(evaluation),
        skill_section(evaluation),
        noise_section(evaluation),
        structure_section(evaluation),
        front_section(evaluation),
        equal_cost_section(evaluation),
        cost_section(evaluation),
        ablation_section(evaluation),
        relaxation_section(evaluation),
        uncertainty_section(evaluation),
    ]
    lead = (
        "What surrogates are worth: beside the affine map, the DEM itself hurried on, the scatter between DEM runs, "
        f"and the limit that the DEM sets. Means run over the test {named(evaluation.test)}."
    )
    missing = np.setdiff1d(evaluation.networks, labels_of(evaluation.structure_errors))
    notices = Notices(
        "To keep in mind",
        [f"{name} is not in tables/structure_errors.csv." for name in missing],
        "Every sentence here is computed from the tables of the run.",
    )
    title = f"SlurryCast evaluation: {evaluation.run}"
    return page_html(title, lead, notices, [section for section in sections if section is not None])
