"""The report: one HTML file that holds all tables and figures of a run, and every sentence computed from them.

`Results` is what a run has left behind; each `..._section` turns a part of it into blocks (tables, figures, text), and
`report_html` puts them into report.html.jinja. The article's numbers stand in columns of their own. Every
surrogate has a column of its own; means and ranges run over the slurries of role `test`, those of role `validation` are
shown beside them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from slurrycast.analysis.training_range import FRACTION_PREFIX
from slurrycast.evaluation.speedup import HYBRID_PARTS, time_unit
from slurrycast.evaluation.verdicts import JUDGED_WORDS, TIE_RULE, judged, judged_list
from slurrycast.report import reference_article as article
from slurrycast.report.network_table import Network
from slurrycast.report.page import (
    FigureBlock,
    Heading,
    Listing,
    Notices,
    Points,
    Section,
    Table,
    Text,
    duration,
    figure_block,
    listed,
    named,
    number,
    page_html,
    pair_name,
    span,
)
from slurrycast.surrogates import family

ARTICLE_GROUP = "Reference article (its own, larger scale)"
# A final density this far from the expected one is worth a notice.
DENSITY_TOLERANCE = 0.02
AXES = ("x", "y", "z")
AFFINE = "affine"  # what a network is held against: it learns nothing but one packing fraction


@dataclass(frozen=True)
class Results:
    """What a run leaves behind. Tables as in results/<run>/tables; the rest by slurry, surrogate or file stem."""

    config: Mapping
    config_text: str
    versions: Mapping
    inputs: Mapping[str, Mapping]  # inputs.json by slurry
    runs: Mapping[str, Mapping]  # run.json by slurry
    density: pd.DataFrame
    coordinate_errors: pd.DataFrame
    rdf_errors: pd.DataFrame
    equilibrium: pd.DataFrame
    training_range: pd.DataFrame | None  # None without training slurries
    costs: pd.DataFrame
    speedup: pd.DataFrame
    surrogates: Sequence[str]  # labels, in the order of columns
    descriptions: Mapping[str, tuple[str, str]]  # what a surrogate looks at, and its rule for the final box, in words
    histories: Mapping[str, pd.DataFrame]  # of the surrogates that are Keras models, as are the networks
    networks: Mapping[str, Network]
    weights_of: Mapping[str, str]  # of the same: of the epoch of the "lowest" validation loss or of the "last"
    figures: Mapping[str, Path]

    @property
    def adopted_model(self) -> str | None:
        """Path of the model that was trained elsewhere; None where this run trains its own."""
        return self.config["surrogate"]["model"]

    def slurries(self, *roles: str) -> list[str]:
        """Ids of the slurries in one of `roles`, in the order of the slurry table."""
        return list(self.equilibrium.slurry[self.equilibrium.role.isin(roles)])

    @property
    def test(self) -> list[str]:
        """Ids of the slurries that means and ranges run over."""
        return self.slurries("test")

    @property
    def compared(self) -> list[str]:
        """Ids of the slurries that are predicted and have a target."""
        return self.slurries("validation", "test")

    def row_name(self, slurry: str) -> str:
        """Text of a slurry at the head of a row: those that choices are made on are marked."""
        return f"{slurry} (validation)" if slurry in self.slurries("validation") else slurry

    def structures(self, surrogate: str) -> pd.DataFrame:
        """Final DEM and hybrid structure of every slurry of the hybrid chain, by slurry; no DEM values for new ones.

        Columns: dem_density, dem_volume, density, volume, difference (hybrid less DEM, g/cm3), share (of the DEM's).
        """
        columns = ["density_g_cm3", "volume_um3"]
        by_slurry = self.density.set_index("slurry")
        hybrid = by_slurry.loc[(self.density.surrogate == surrogate).to_numpy(), columns]
        dem = by_slurry.loc[(self.density.model == "DEM").to_numpy(), columns]
        hybrid.columns, dem.columns = ["density", "volume"], ["dem_density", "dem_volume"]
        order = [slurry for slurry in self.equilibrium.slurry if slurry in hybrid.index]
        table = hybrid.loc[order].join(dem)
        table["difference"] = table.density - table.dem_density
        table["share"] = table.difference / table.dem_density
        return table

    def errors(self, surrogate: str, axis: str = "all") -> pd.DataFrame:
        """Coordinate errors along `axis`, by slurry."""
        table = self.coordinate_errors
        return table[(table.surrogate == surrogate) & (table.axis == axis)].set_index("slurry")

    def rdf_differences(self, surrogate: str, pair: str) -> pd.Series:
        """Mean absolute difference of target and relaxed RDF of `pair`, by slurry."""
        table = self.rdf_errors
        of_pair = table[(table.surrogate == surrogate) & (table.pair == pair)]
        return of_pair.set_index("slurry").mean_abs_difference

    def mean_over_test(self, values: pd.Series) -> float:
        """Mean of `values` (by slurry) over the test slurries; NaN where there are none."""
        return values.reindex(self.test).mean()


# ---- who is better


def gain_over_affine(results: Results, surrogate: str) -> list[str]:
    """Sentences on what `surrogate` adds to the affine map over the test slurries; none without both of them."""
    mse = pd.DataFrame({name: results.errors(name).mse_um2 for name in (surrogate, AFFINE)}).reindex(results.test)
    ratio = (mse[surrogate] / mse[AFFINE]).dropna()
    if ratio.empty:
        return []
    verdicts = {"coordinates": judged(ratio - 1)}
    sentences = [
        f"Coordinates: over the test slurries the MSE of {surrogate} is {ratio.mean():.3g} times that of the affine "
        f"map on average ({span(ratio)}): {JUDGED_WORDS[verdicts['coordinates']]}."
    ]
    density = pd.DataFrame({name: results.structures(name).share.abs() for name in (surrogate, AFFINE)})
    density = density.reindex(results.test)
    verdicts["density"] = judged(density[surrogate] - density[AFFINE])
    sentences.append(
        f"Density after relaxation: {surrogate} is {density[surrogate].mean():.2%} from the DEM on average, the affine "
        f"map {density[AFFINE].mean():.2%}: {JUDGED_WORDS[verdicts['density']]}."
    )
    for pair in dict.fromkeys(results.rdf_errors.pair):
        rdf = pd.DataFrame({name: results.rdf_differences(name, pair) for name in (surrogate, AFFINE)})
        rdf = rdf.reindex(results.test)
        about = f"the RDF of {pair_name(pair)}"
        verdicts[about] = judged(rdf[surrogate] - rdf[AFFINE])
        sentences.append(
            f"RDF after relaxation, {pair_name(pair)}: mean |Δg| is {rdf[surrogate].mean():.3g} with {surrogate} and "
            f"{rdf[AFFINE].mean():.3g} with the affine map: {JUDGED_WORDS[verdicts[about]]}."
        )
    relaxed = {about: verdict for about, verdict in verdicts.items() if about != "coordinates"}
    sentences.append(f"In short, {surrogate} against the affine map: {judged_list(verdicts)}.")
    if set(relaxed.values()) == {"tie"}:
        sentences[-1] += f" After relaxation, affine, which trains nothing, ties {surrogate}."
    elif set(relaxed.values()) <= {"tie", "worse"}:
        sentences[-1] += f" After relaxation, {surrogate} adds nothing to affine, which trains nothing."
    sentences.append(TIE_RULE)
    return sentences


# ---- what to keep in mind


NO_WARNINGS = "No warnings: every DEM run that went to its end is in equilibrium."


def warnings(results: Results) -> list[str]:
    """Sentences on what limits the results: runs not in equilibrium, odd densities, extrapolation, a foreign model."""
    notices = []
    if results.adopted_model:
        notices.append(
            f"Surrogate {listed(list(results.networks))} was trained elsewhere ({results.adopted_model}): neither its "
            "training range nor its recipe is known here."
        )
    notices += [f"Slurry {row.slurry}: {row.warning}." for row in results.equilibrium.itertuples() if row.warning]
    expected = results.config["formulation"]["expected_density_g_cm3"]
    dem = results.density[results.density.model == "DEM"]
    odd = dem[(dem.density_g_cm3 / expected - 1).abs() > DENSITY_TOLERANCE]
    notices += [
        f"Slurry {row.slurry}: the DEM ends at {row.density_g_cm3:.3f} g/cm³, more than {DENSITY_TOLERANCE:.0%} from "
        f"the expected {expected:g} g/cm³."
        for row in odd.itertuples()
    ]
    return notices + extrapolations(results)


def extrapolations(results: Results) -> list[str]:
    """In what slurries lie outside the training range, one sentence for all that do so on the same sides.

    None where the training range is not known.
    """
    if results.training_range is None:
        return []
    outside = results.training_range[results.training_range.outside == "yes"]
    alike = {}
    for slurry, rows in outside.groupby("slurry", sort=False):
        sides = tuple(zip(rows.quantity, rows.value > rows.training_max, strict=True))
        alike.setdefault(sides, []).append(slurry)
    sentences = []
    for sides, slurries in alike.items():
        own = outside[outside.slurry.isin(slurries)]
        parts = [out_of_range_text(own[own.quantity == quantity]) for quantity, _ in sides]
        those = named(slurries)
        sentences.append(
            f"{those[0].upper()}{those[1:]}: {'; '.join(parts)}; predictions of surrogates that learned extrapolate."
        )
    return sentences


# Of a quantity of tables/training_range.csv: head of its column, words before and behind a value in a sentence, form.
QUANTITIES = {
    "particles": ("Particles", "", " particles", ",.0f"),
    "shortest_edge_um": ("Shortest edge (µm)", "shortest box edge ", " µm", ".4g"),
    "longest_edge_um": ("Longest edge (µm)", "longest box edge ", " µm", ".4g"),
    "density_g_cm3": ("Density (g/cm³)", "density at the last input frame ", " g/cm³", ".5g"),
    "thickness_ratio": ("Lz/Lx", "Lz/Lx ", "", ".4g"),
    "mean_radius_um": ("Mean radius (µm)", "mean particle radius ", " µm", ".4g"),
}


def quantity_words(quantity: str) -> tuple[str, str, str, str]:
    """Words and form of a quantity, as in QUANTITIES; phases are those of the recipe."""
    if not quantity.startswith(FRACTION_PREFIX):
        return QUANTITIES[quantity]
    phase = quantity.removeprefix(FRACTION_PREFIX)
    return f"Number fraction, {phase}", f"number fraction of {phase} ", "", ".4f"


def out_of_range_text(rows: pd.DataFrame) -> str:
    """Text of rows of tables/training_range.csv on one quantity: it, its values and those of the training slurries."""
    first = next(rows.itertuples())
    _, before, behind, form = quantity_words(first.quantity)
    return f"{before}{span(rows.value, form)}{behind}, training range {training_range_text(first)}"


def training_range_text(row: NamedTuple) -> str:
    """Text of the range of the training slurries in a row of tables/training_range.csv."""
    return span(pd.Series([row.training_min, row.training_max]), quantity_words(row.quantity)[3])


# ---- sections


def summary_table(results: Results, comparison: pd.DataFrame) -> Table:
    """Key results, means over the test slurries, a column a surrogate and the article's last."""
    surrogates, test = results.surrogates, results.test
    structures = {name: results.structures(name).reindex(test) for name in surrogates}
    their_share, their_errors = article_shares(), pd.DataFrame(article.COORDINATE_ERRORS.values())

    def largest(share: pd.Series) -> str:
        known = share.abs().dropna()
        return f"{known.max():.2%} (slurry {known.idxmax()})" if len(known) else "–"

    def error_row(words: str, column: str, form: str, their_mean: str) -> list[str]:
        means = [results.mean_over_test(results.errors(name)[column]) for name in surrogates]
        return [words, *(number(mean, form) for mean in means), their_mean]

    def cost_row(words: str, table: pd.DataFrame, column: str, their_ratio: str) -> list[str]:
        means = [table[(table.surrogate == name) & table.slurry.isin(test)][column].mean() for name in surrogates]
        return [words, *(number(mean, ".2g") for mean in means), their_ratio]

    rows = [
        error_row("MSE of coordinates (µm²)", "mse_um2", ".3g", number(their_errors.mse_um2.mean())),
        error_row("R² of coordinates", "r2", ".4f", number(their_errors.r2.mean(), ".3f")),
        [
            "|hybrid − DEM| density after relaxation",
            *(number(structures[name].share.abs().mean(), ".2%") for name in surrogates),
            f"{their_share.abs().mean():.1%}",
        ],
        [
            "– largest",
            *(largest(structures[name].share) for name in surrogates),
            f"{their_share.abs().max():.0%} (slurry {their_share.abs().idxmax()})",
        ],
    ]
    for pair in dict.fromkeys(results.rdf_errors.pair):
        means = [results.mean_over_test(results.rdf_differences(name, pair)) for name in surrogates]
        rows.append([f"|Δg(r)| after relaxation, {pair_name(pair)}", *map(number, means), "–"])
    their_ratio = f"about {article.FULL_DEM_MIN / article.HYBRID_MIN:.0f}"
    rows += [
        cost_row("Wall time, full DEM / hybrid", comparison, "ratio", their_ratio),
        cost_row("Wall time, DEM to equilibrium / hybrid", comparison, "ratio_to_equilibrium", "–"),
    ]
    caption = f"Means over the test {named(test)}." if test else "No slurry of role test has a target to compare with."
    validation, new = results.slurries("validation"), results.slurries("new")
    if validation:
        caption += f" Not in them: the validation {named(validation)}, which choices are made on."
    if new:
        caption += f" New, without a target: {named(new)}."
    return Table("Key results", caption, ["", *surrogates, ARTICLE_GROUP], rows, article=(len(surrogates) + 1,))


def summary_section(results: Results, comparison: pd.DataFrame) -> Section:
    """What each network adds to the affine map, in sentences, and the key results beside the article's."""
    section = Section("Summary")
    for surrogate in results.networks:
        sentences = gain_over_affine(results, surrogate)
        if sentences:
            section.blocks += [Heading(f"What {surrogate} adds to the affine map"), Points(sentences)]
    section.blocks.append(summary_table(results, comparison))
    return section


def workflow_section(results: Results) -> Section:
    """Fig. 1."""
    caption = (
        "The workflow, drawn from its rules. Each box is one rule; an arrow means that files go from one to the other. "
        "Arrows that others imply are left out."
    )
    return Section("Workflow", figure_block(results.figures, "workflow", "Fig. 1", caption))


def settings_section(results: Results) -> Section:
    """Table 1 and the formulation with what was reached."""
    dem, learning = results.config["dem"], results.config["learning"]
    per_frame = dem["steps"] // (dem["frames"] - 1)
    full_runs = results.slurries("train", "validation", "test")
    wall_s = results.costs[(results.costs.stage == "run_slurry") & results.costs.slurry.isin(full_runs)].wall_s
    held_out, new = results.slurries("validation", "test"), results.slurries("new")

    def steps_of(frames: Sequence[int], interval: int) -> str:
        return ", ".join(f"{frame * interval:,}" for frame in frames)

    rows = [
        ["Time step (µs)", f"{dem['timestep_us']:g}", f"{article.TIMESTEP_US:g}"],
        ["Steps", f"{dem['steps']:,}", f"{article.STEPS:,}"],
        [
            "Simulated time (µs)",
            f"{dem['steps'] * dem['timestep_us']:g}",
            f"{article.STEPS * article.TIMESTEP_US:g}",
        ],
        ["Frames", f"{dem['frames']}", f"{article.FRAMES}"],
        ["Steps between frames", f"{per_frame:,}", f"{article.STEPS_PER_FRAME:,}"],
        [
            "Input frames, at steps",
            steps_of(learning["input_frames"], per_frame),
            steps_of(article.INPUT_FRAMES, article.STEPS_PER_FRAME),
        ],
        [
            "Target frame, at step",
            f"{learning['target_frame'] * per_frame:,}",
            f"{article.STEPS:,}",
        ],
        ["Pressure (kPa)", f"{dem['pressure_kpa']:g}", "not stated"],
        ["Pressure damping (µs)", f"{dem['pressure_damping_us']:g}", "not stated"],
        ["Temperature (K)", f"{dem['temperature_k']:g}", "not stated"],
        ["MPI ranks a simulation", str(dem["ranks"]), f"one node of {article.RANKS} cores"],
        [
            "Wall time of a full simulation",
            " to ".join(dict.fromkeys(map(duration, (wall_s.min(), wall_s.max())))),
            duration(60 * article.FULL_DEM_MIN),
        ],
        ["Slurries: training", str(len(results.slurries("train"))), str(article.TRAINING_SLURRIES)],
        ["Slurries: held out", str(len(held_out)), str(article.HELD_OUT_SLURRIES)],
        ["Slurries: new, only to the last input frame", str(len(new)), "–"],
        ["Relaxation after the prediction (steps)", relaxed_for(results), "not stated"],
    ]
    if not results.adopted_model:
        samples = results.equilibrium.particles[results.equilibrium.role == "train"].sum()
        rows.append(["Samples (particles of the training slurries)", f"{samples:,}", f"{article.SAMPLES:,}"])
        for surrogate in results.networks:
            settings = results.config["surrogate"].get(family(surrogate), {})
            rows += [
                [f"{words}, {surrogate}", f"{settings[key]:,}", f"{theirs:,}"]
                for key, words, theirs in (
                    ("epochs", "Epochs", article.EPOCHS),
                    ("batch_size", "Batch size", article.BATCH_SIZE),
                    ("learning_rate", "Learning rate", article.LEARNING_RATE),
                )
                if key in settings
            ]
    caption = (
        f"Settings of simulation{'' if results.adopted_model else ' and training'} in this run and in the article."
    )
    blocks = [Table("Table 1", caption, ["", "This run", ARTICLE_GROUP], rows, article=(2,))]

    reached = pd.DataFrame({slurry: inputs["mass_fractions_reached"] for slurry, inputs in results.inputs.items()})
    rows = []
    for phase, settings in results.config["formulation"]["phases"].items():
        classes = ", ".join(f"{c['diameter_um']:g} ({c['number_fraction']:g})" for c in settings["size_classes"])
        values = reached.loc[phase]
        rows.append(
            [
                phase,
                f"{settings['density_g_cm3']:g}",
                classes,
                f"{settings['mass_fraction']:.4f}",
                span(values, ".4f"),
                f"{100 * (values - settings['mass_fraction']).abs().max():.2f}",
            ]
        )
    columns = [
        "Phase",
        "Density (g/cm³)",
        "Diameters, µm (number fraction)",
        "Mass fraction wanted",
        "reached, over all slurries",
        "largest deviation (percentage points)",
    ]
    caption = "Formulation. Particles are whole, so the mass fractions reached are not exactly the wanted ones."
    blocks.append(Table("Table S1", caption, columns, rows, texts=(0, 2)))
    return Section("Settings and formulation", blocks)


ROLE_WORDS = {"train": "training", "validation": "validation", "test": "test", "new": "new"}


def dem_section(results: Results) -> Section:
    """Table S2 and Fig. S1: the slurries and their way to equilibrium."""
    equilibrium = results.equilibrium
    rows = [
        [
            row.slurry,
            ROLE_WORDS[row.role],
            f"{row.mass_units:g}",
            f"{row.thickness_ratio:g}",
            f"{row.particles:,}",
            f"{row.run_time_us:g}",
            f"{row.density_g_cm3:.4f}",
            f"{row.mean_contacts:.2f}",
            number(row.density_drift, "z.2%"),
            number(None if row.warning else row.time_to_equilibrium_us, "g"),
        ]
        for row in equilibrium.itertuples()
    ]
    columns = [
        "Slurry",
        "Role",
        "Mass (units)",
        "Lz/Lx",
        "Particles",
        "Run (µs)",
        "Last density (g/cm³)",
        "Mean contacts",
        "Drift over the last 10 %",
        "Equilibrium after (µs)",
    ]
    caption = (
        "The slurries at the end of their DEM run; that of a new slurry ends at the last input frame. One unit of mass "
        f"is {results.config['formulation']['unit_mass_pg']:g} pg."
    )
    complete = equilibrium[equilibrium.role != "new"]
    flagged = list(complete.slurry[complete.warning != ""])
    sound = complete[complete.warning == ""].dropna(subset=["time_to_equilibrium_us"])
    sentence = ""
    if not sound.empty:
        slowest = sound.loc[sound.time_to_equilibrium_us.idxmax()]
        sentence = (
            f" Equilibrium is reached after {span(sound.time_to_equilibrium_us, 'g', ' µs')}, last by slurry "
            f"{slowest.slurry} (mass {slowest.mass_units:g})."
        )
    if flagged:
        sentence += f" Not in equilibrium at its end: {named(flagged)}."
    frames = ", ".join(map(str, results.config["learning"]["input_frames"]))
    figure = figure_block(
        results.figures,
        "densification",
        "Fig. S1",
        f"Density of every slurry against time in the DEM. The band marks input frames {frames}." + sentence,
    )
    return Section("DEM runs", [Table("Table S2", caption, columns, rows, texts=(0, 1)), *figure])


def surrogates_section(results: Results) -> Section:
    """What the surrogates are, and of each network Table 2 and Fig. 2."""
    rows = [[name, *results.descriptions[name]] for name in results.surrogates]
    caption = "The surrogates of this run: what a prediction may depend on, and where the final box comes from."
    blocks = [Table("Table S8", caption, ["Surrogate", "Looks at", "Box"], rows, texts=(0, 1, 2))]
    for surrogate in results.networks:
        blocks += [Heading(f"Network {surrogate}"), *network_blocks(results, surrogate)]
    return Section("Surrogates", blocks)


def training_range_section(results: Results) -> Section:
    """Table S9, or a line where there is nothing to show: the training range, and which slurries lie outside."""
    section = Section("Training range")
    table = results.training_range
    if table is None:
        section.blocks.append(
            Text(
                "The slurries that the model was trained on are not part of this run: their range is not known "
                "here, so whether a slurry lies outside is not checked."
            )
        )
        return section
    if not (table.outside == "yes").any():
        section.blocks.append(Text("No predicted slurry lies outside the range of the training slurries."))
        return section
    by_quantity = dict(list(table.groupby("quantity", sort=False)))
    rows = [["training", *(training_range_text(next(own.itertuples())) for own in by_quantity.values())]]
    for slurry in dict.fromkeys(table.slurry):
        cells = [next(own[own.slurry == slurry].itertuples()) for own in by_quantity.values()]
        rows.append([results.row_name(slurry), *map(range_cell, cells)])
    caption = (
        "The predicted slurries at the last input frame beside the range of the training slurries; ▲ is above it, ▼ "
        "below. Densities of earlier frames that all surrogates learned from belong to it. Lz/Lx, fractions and mean "
        "radius may leave it by their rounding: particles are whole. Surrogates that learned extrapolate to what is "
        "outside."
    )
    columns = ["Slurry", *(quantity_words(quantity)[0] for quantity in by_quantity)]
    section.blocks.append(Table("Table S9", caption, columns, rows))
    return section


def relaxed_for(results: Results) -> str:
    """Steps of the relaxation of each surrogate, as they were taken: "3,500 of affine; 2,000 of neighbours"."""
    relaxations = results.costs[results.costs.stage == "relax_slurry"]
    by_steps = {}
    for surrogate in results.surrogates:
        for steps in relaxations[relaxations.surrogate == surrogate].steps.dropna().unique():
            by_steps.setdefault(int(steps), []).append(surrogate)
    if [list(results.surrogates)] == list(by_steps.values()):
        return f"{next(iter(by_steps)):,}"
    return "; ".join(f"{steps:,} of {listed(surrogates)}" for steps, surrogates in by_steps.items())


def range_cell(row: NamedTuple) -> str:
    """Text of a value in Table S9, marked where it is outside."""
    mark = (" ▲" if row.value > row.training_max else " ▼") if row.outside == "yes" else ""
    return f"{format(row.value, quantity_words(row.quantity)[3])}{mark}"


def network_blocks(results: Results, surrogate: str) -> list:
    """Table 2 and Fig. 2."""
    network, history = results.networks[surrogate], results.histories[surrogate]
    rows = [
        [
            layer.name,
            "–" if layer.output_shape is None else " × ".join(map(str, layer.output_shape)),
            number(layer.parameters, ","),
        ]
        for layer in network.layers
    ]
    rows.append(["Total", "", f"{network.parameters:,}"])
    same = "the same number as" if network.parameters == article.PARAMETERS else "against"
    inputs = [layer for layer in network.layers if layer.name.startswith("Input")]
    shapes = "Shapes are frames (or pooled positions) × channels."
    if len(inputs) > 1:
        shapes = "Shapes are those of one particle, or of one pair."
    caption = (
        f"The network {surrogate} layer by layer, read from the model file: {network.parameters:,} parameters, {same} "
        f"the article's {article.PARAMETERS:,}. {shapes}"
    )
    blocks = [Table("Table 2", caption, ["Layer", "Output shape", "Parameters"], rows)]
    if history.empty:
        caption = "The model was trained elsewhere and came without learning curves."
    else:
        first, last = history.iloc[0], history.iloc[-1]
        used = None if results.adopted_model else results.weights_of[surrogate]
        origin = " of the adopted model, as they came with it," if results.adopted_model else ""
        caption = f"Learning curves{origin} over {len(history)} epochs. "
        if history.val_loss.isna().all():
            caption += (
                f"There was no validation slurry. Training MSE goes from {first.loss:.3g} to {last.loss:.3g} µm² in "
                "the last epoch."
            )
        else:
            best = history.loc[history.val_loss.idxmin()]
            of_lowest = ", whose weights are used" if used == "lowest" else ""
            of_last = ", whose weights are used," if used == "last" else ""
            caption += (
                f"Validation MSE goes from {first.val_loss:.3g} to its lowest, {best.val_loss:.3g} µm² (MAE "
                f"{best.val_mae:.3g} µm), at epoch {best.epoch:.0f}{of_lowest}; in the last epoch{of_last} it is "
                f"{last.val_loss:.3g} µm², that of training {last.loss:.3g} µm²."
            )
            if best.epoch == last.epoch and len(history) > 1 and used == "lowest":
                caption += " The lowest value is in the last epoch: more epochs may lower it further."
        caption += f" The article trains for {article.EPOCHS:,} epochs at batch {article.BATCH_SIZE}."
    return blocks + figure_block(results.figures, f"learning_curves_{surrogate}", "Fig. 2", caption)


def article_differences() -> pd.Series:
    """Hybrid less DEM density (g/cm3) in the article, by slurry."""
    return pd.Series(
        {
            slurry: article.HYBRID_STRUCTURE[slurry].density_g_cm3 - structure.density_g_cm3
            for slurry, structure in article.DEM_STRUCTURE.items()
        }
    )


def article_shares() -> pd.Series:
    """Hybrid less DEM density in the article as a share of the DEM's, by slurry."""
    dem = pd.Series({slurry: structure.density_g_cm3 for slurry, structure in article.DEM_STRUCTURE.items()})
    return article_differences() / dem


def coordinates_caption(results: Results, slurry: str) -> str:
    """What the panels of one slurry show."""
    parts = []
    for surrogate in results.surrogates:
        per_axis = {axis: results.errors(surrogate, axis).loc[slurry] for axis in AXES}
        worst = max(AXES, key=lambda axis, errors=per_axis: errors[axis].mse_um2)
        mse = results.errors(surrogate).loc[slurry].mse_um2
        parts.append(f"{mse:.3g} µm² ({surrogate}, largest along {worst})")
    caption = (
        f"MSE over all axes is {listed(parts)}. Upper panels have one scale for all surrogates, the deviations below "
        "them one each."
    )
    if slurry in article.R2_PER_AXIS:
        theirs = " / ".join(f"{article.R2_PER_AXIS[slurry][axis]:.3f}" for axis in AXES)
        caption += f" The article, at its own scale, has R² of {theirs} on x / y / z for its slurry {slurry}."
    return caption


def picture_caption(results: Results, surrogate: str, slurry: str) -> str:
    """What the 3D pictures of one slurry show."""
    structure = results.structures(surrogate).loc[slurry]
    if np.isnan(structure.dem_volume):
        return (
            "Predicted structure, wrapped into its periodic box, and relaxed structure "
            f"({structure.density:.3f} g/cm³). Spheres are drawn at true size, both panels at the same scale."
        )
    # The boxes keep their proportions, so edges go with the cube root of the volume.
    change = np.cbrt(structure.volume / structure.dem_volume) - 1
    return (
        f"Target of the DEM, predicted structure wrapped into its periodic box, and relaxed structure, whose box is "
        f"{abs(change):.2%} {'thicker' if change > 0 else 'thinner'} than the target's. Spheres are drawn at true "
        "size, all panels at the same scale."
    )


def density_tables(results: Results) -> list[Table]:
    """Table 3, density and volume."""
    structures = {name: results.structures(name) for name in results.surrogates}
    count = len(structures)
    densities, volumes = [], []
    for slurry in results.compared:
        ours = [table.loc[slurry] for table in structures.values()]
        theirs = article.DEM_STRUCTURE.get(slurry), article.HYBRID_STRUCTURE.get(slurry)
        density_beside, volume_beside = ["–"] * 3, ["–"] * 2
        if None not in theirs:
            dem, hybrid = theirs
            share = hybrid.density_g_cm3 / dem.density_g_cm3 - 1
            density_beside = [f"{dem.density_g_cm3:.4f}", f"{hybrid.density_g_cm3:.4f}", f"{share:+.1%}"]
            volume_beside = [f"{dem.volume_um3:,.0f}", f"{hybrid.volume_um3:,.0f}"]
        name = results.row_name(slurry)
        values = [f"{row.density:.4f}" for row in ours] + [f"{row.share:+z.2%}" for row in ours]
        densities.append([name, f"{ours[0].dem_density:.4f}", *values, *density_beside])
        volumes.append([name, f"{ours[0].dem_volume:,.1f}", *(f"{row.volume:,.1f}" for row in ours), *volume_beside])
    if results.test:
        shares = [number(results.mean_over_test(table.share.abs()), ".2%") for table in structures.values()]
        theirs = f"{article_shares().abs().mean():.1%}"
        densities.append(["mean, test, absolute", *["–"] * (1 + count), *shares, "–", "–", theirs])
    caption = f"Density of the final microstructure, full DEM and hybrid. {density_sentence(results)}"
    columns = ["Slurry", "DEM", *structures, *structures, "DEM", "hybrid", "difference"]
    groups = [("", 1), ("Density (g/cm³)", 1 + count), ("Hybrid against DEM", count), (ARTICLE_GROUP, 3)]
    beside = range(2 + 2 * count, 5 + 2 * count)
    tables = [Table("Table 3", caption, columns, densities, article=beside, groups=groups)]
    columns = ["Slurry", "DEM", *structures, "DEM", "hybrid"]
    groups = [("", 1), ("Volume (µm³)", 1 + count), (ARTICLE_GROUP, 2)]
    caption = "Volume of the final microstructure, full DEM and hybrid."
    beside = range(2 + count, 4 + count)
    return [*tables, Table("Table 3, volumes", caption, columns, volumes, article=beside, groups=groups)]


def density_sentence(results: Results) -> str:
    """How far hybrid densities are from the DEM's, over the test slurries."""
    parts = []
    for surrogate in results.surrogates:
        known = results.structures(surrogate).reindex(results.test).dropna()
        if known.empty:
            continue
        worst = known.difference.abs().idxmax()
        share = known.share[worst]
        parts.append(
            f"{known.difference.abs().mean():.3g} g/cm³ with {surrogate}, the largest "
            f"{abs(known.difference[worst]):.3g} g/cm³ (slurry {worst}, {abs(share):.1%} "
            f"{'denser' if share > 0 else 'less dense'} than its DEM)"
        )
    if not parts:
        return "No slurry of role test has a target to compare with."
    theirs = article_differences().abs()
    return (
        f"The mean absolute difference of density over the test slurries is {'; '.join(parts)}. The article has "
        f"{theirs.mean():.2f} and {theirs.max():.2f} g/cm³."
    )


def density_figure(results: Results) -> list[FigureBlock]:
    """Fig. S2: all slurries of the hybrid chain."""
    if results.compared:
        caption = (
            "Final density of the full DEM and of every surrogate's hybrid chain, and how far the two are apart. The "
            "band is ±1 %; beyond it the lower scale is logarithmic."
        )
    else:
        caption = "Final density of the hybrid chain; there is no full DEM to compare with."
    return figure_block(results.figures, "density", "Fig. S2", caption)


def coordinate_tables(results: Results) -> list[Table]:
    """Table 4: MSE and R2 in the own box, which are primary; MAE, and MSE in the true box."""
    errors = {name: results.errors(name) for name in results.surrogates}
    count = len(errors)
    their_mean = pd.DataFrame(article.COORDINATE_ERRORS.values()).mean()

    def rows(forms: Mapping[str, str], theirs: Sequence[str]) -> list[list[str]]:
        """Rows of the columns named in `forms`, every one for all surrogates, and of the article's in `theirs`."""
        lines = []
        for slurry in results.compared:
            known = article.COORDINATE_ERRORS.get(slurry)
            ours = [number(table[name][slurry], form) for name, form in forms.items() for table in errors.values()]
            beside = ["–" if known is None else f"{getattr(known, name)}" for name in theirs]
            lines.append([results.row_name(slurry), *ours, *beside])
        if results.test:
            values = [
                (results.mean_over_test(table[name]), form) for name, form in forms.items() for table in errors.values()
            ]
            means = [number(value, form) for value, form in values]
            lines.append(["mean, test", *means, *(number(their_mean[name]) for name in theirs)])
        return lines

    caption = (
        "Errors of the predicted coordinates before relaxation, over all axes, in each prediction's own box (the "
        "primary measure)."
    )
    second = "Mean absolute error, and MSE with the prediction rescaled to the true box."
    for surrogate, table in errors.items():
        tested = table.reindex(results.test).dropna()
        if tested.empty:
            continue
        caption += (
            f" With {surrogate}, MSE is lowest for slurry {tested.mse_um2.idxmin()} and highest for slurry "
            f"{tested.mse_um2.idxmax()}."
        )
        gain = 1 - tested.mse_um2_true_box / tested.mse_um2
        if gain.max() > 0:
            second += (
                f" With {surrogate}, knowing the true box would lower the MSE most for slurry {gain.idxmax()}, by "
                f"{gain.max():.0%}."
            )
    groups = [("", 1), ("MSE (µm²)", count), ("R²", count), (ARTICLE_GROUP, 2)]
    columns = ["Slurry", *errors, *errors, "MSE (µm²)", "R²"]
    own = rows({"mse_um2": ".3g", "r2": ".4f"}, ["mse_um2", "r2"])
    beside = range(1 + 2 * count, 3 + 2 * count)
    tables = [Table("Table 4", caption, columns, own, article=beside, groups=groups)]
    groups = [("", 1), ("MAE (µm)", count), ("MSE in the true box (µm²)", count), (ARTICLE_GROUP, 1)]
    columns = ["Slurry", *errors, *errors, "MAE (µm)"]
    true = rows({"mae_um": ".3g", "mse_um2_true_box": ".3g"}, ["mae_um"])
    return [*tables, Table("Table 4, continued", second, columns, true, article=beside[:1], groups=groups)]


def rdf_caption(results: Results) -> str:
    """What the RDF panels show."""
    errors = results.rdf_errors
    if errors.empty:
        return "Radial distribution functions of the relaxed structures; there is no target."
    cutoff_um = results.config["analysis"]["rdf_cutoff_um"]
    caption = "Radial distribution functions of the target and of every surrogate's relaxed structure. "
    for pair in dict.fromkeys(errors.pair):
        parts = []
        for surrogate in results.surrogates:
            known = results.rdf_differences(surrogate, pair).reindex(results.test).dropna()
            if not known.empty:
                parts.append(f"{span(known)} ({surrogate}, farthest for slurry {known.idxmax()})")
        if parts:
            caption += f"For {pair_name(pair)} the mean distance from the target is {listed(parts)}. "
    if errors.r_max_um.min() < 0.99 * cutoff_um:
        caption += (
            f"Curves end at {span(errors.r_max_um, '.2f', ' µm')} instead of {cutoff_um:g} µm, since distances beyond "
            "half of the shortest box edge are not complete. "
        )
    return caption + (
        "The article sees first peaks near 0.8 and 1.1 µm for all pairs, deviations at 0.3 to 0.9 µm for NiO-8YSZ, and "
        "agreement beyond 2 µm except for its slurry 6."
    )


def rdf_figure(results: Results) -> list[FigureBlock]:
    """Fig. 6: all slurries of the hybrid chain."""
    return figure_block(results.figures, "rdf", "Fig. 6", rdf_caption(results))


def rdf_table(results: Results) -> Table:
    """Table S3. The range of a slurry depends on the boxes of the surrogates, so it has the shortest and longest."""
    errors = results.rdf_errors
    pairs = list(dict.fromkeys(errors.pair))
    differences = [results.rdf_differences(name, pair) for pair in pairs for name in results.surrogates]
    rows = []
    for slurry in results.compared:
        ranges = errors[errors.slurry == slurry]
        values = [number(by_slurry.get(slurry)) for by_slurry in differences]
        rows.append([results.row_name(slurry), span(ranges.r_max_um), span(ranges.bins, ".0f"), *values])
    if results.test:
        rows.append(["mean, test", "", "", *(number(results.mean_over_test(by_slurry)) for by_slurry in differences)])
    caption = "Mean absolute difference of the RDF of target and relaxed structure over all bins up to r max."
    columns = ["Slurry", "r max (µm)", "Bins", *list(results.surrogates) * len(pairs)]
    groups = [("", 3), *((pair_name(pair), len(results.surrogates)) for pair in pairs)]
    return Table("Table S3", caption, columns, rows, groups=groups)


def pictures(results: Results, slurries: Sequence[str]) -> list[FigureBlock]:
    """Fig. 4: 3D pictures of `slurries`, for the surrogates that have them."""
    blocks = []
    for slurry in slurries:
        for surrogate in results.surrogates:
            label = f"Fig. 4, slurry {slurry}, {surrogate}"
            stem = f"slurry_{surrogate}_{slurry}"
            if stem in results.figures:
                blocks += figure_block(results.figures, stem, label, picture_caption(results, surrogate, slurry))
    return blocks


def prediction_section(results: Results) -> Section:
    """Fig. 3 to 6, Tables 3, 4 and S3: slurries with a target."""
    section = Section("Hybrid against DEM")
    if not results.compared:
        section.blocks.append(Text("No slurry of this run has a target to compare with."))
        return section
    section.blocks += [
        Heading("Coordinates"),
        Text(
            "Predicted against target coordinates of each particle, unwrapped, each structure in its own box and less "
            "its mean over the particles; the lower panels show predicted less target. R² mostly says how large the "
            "box is against the error, so the deviations and the MSE are what to compare."
        ),
        *coordinate_tables(results),
    ]
    for place, slurry in enumerate(results.compared):
        stem = f"coordinates_{slurry}"
        if stem in results.figures:
            label = f"Fig. {3 if place == 0 else 5}, slurry {slurry}"
            section.blocks += figure_block(results.figures, stem, label, coordinates_caption(results, slurry))
    section.blocks += [
        Heading("Density and volume"),
        *density_tables(results),
        *density_figure(results),
        Heading("Radial distribution functions"),
        *rdf_figure(results),
        rdf_table(results),
        Heading("Microstructures"),
        *(
            pictures(results, results.compared)
            or [Text("This configuration asks for no 3D pictures (report.pictures).")]
        ),
    ]
    return section


def new_section(results: Results) -> Section | None:
    """Slurries without a target: what the chain says of them."""
    new = results.slurries("new")
    if not new:
        return None
    rows = []
    expected = results.config["formulation"]["expected_density_g_cm3"]
    equilibrium = results.equilibrium.set_index("slurry")
    for surrogate in results.surrogates:
        structures = results.structures(surrogate)
        for slurry in [slurry for slurry in new if slurry in structures.index]:
            structure, run = structures.loc[slurry], equilibrium.loc[slurry]
            rows.append(
                [
                    slurry,
                    surrogate,
                    f"{run.mass_units:g}",
                    f"{run.particles:,}",
                    f"{run.density_g_cm3:.4f}",
                    f"{structure.density:.4f}",
                    f"{structure.density / expected - 1:+.1%}",
                    f"{structure.volume:,.1f}",
                ]
            )
    columns = [
        "Slurry",
        "Surrogate",
        "Mass (units)",
        "Particles",
        "Density at the last input frame (g/cm³)",
        "Hybrid density (g/cm³)",
        f"against the expected {expected:g}",
        "Hybrid volume (µm³)",
    ]
    caption = (
        "New slurries: the DEM stops at the last input frame and the surrogate takes over. There is no target, so "
        "there are no errors."
    )
    if results.compared:
        curves = [Text("Their densities are in Fig. S2 and their radial distribution functions in Fig. 6, above.")]
    else:
        curves = [*density_figure(results), *rdf_figure(results)]
    table = Table("Table S4", caption, columns, rows, texts=(0, 1))
    return Section("New slurries", [table, *pictures(results, new), *curves])


def ratio_table(results: Results, comparison: pd.DataFrame, cpu: pd.DataFrame) -> Table:
    """How many times the hybrid run fits into the DEM, for every slurry and surrogate."""
    kinds = (
        (comparison, "ratio", "Whole DEM / hybrid, wall time"),
        (comparison, "ratio_to_equilibrium", "DEM to equilibrium / hybrid, wall time"),
        (cpu, "ratio", "Whole DEM / hybrid, CPU time"),
    )
    by_pair = [(table.set_index(["surrogate", "slurry"])[column], words) for table, column, words in kinds]
    rows = [
        [
            results.row_name(slurry),
            *(number(ratio.get((name, slurry)), ".2f") for ratio, _ in by_pair for name in results.surrogates),
        ]
        for slurry in results.compared
    ]
    columns = ["Slurry", *list(results.surrogates) * len(kinds)]
    groups = [("", 1), *((words, len(results.surrogates)) for _, words in by_pair)]
    return Table("Table S5, ratios", "How many times the hybrid run fits into the DEM.", columns, rows, groups=groups)


def cost_section(results: Results, comparison: pd.DataFrame, cpu: pd.DataFrame) -> Section:
    """Fig. S3 and Tables S5, S6: what each slurry and each stage took."""
    section = Section("Cost")
    scope = results.test or list(dict.fromkeys(comparison.slurry))
    shown = comparison[comparison.slurry.isin(scope)]
    length_s, unit = time_unit(shown[["dem", "hybrid"]].max(axis=None))
    seconds = [*HYBRID_PARTS, "hybrid", "dem", "dem_to_equilibrium"]
    rows = []
    for surrogate in results.surrogates:
        means = shown.loc[shown.surrogate == surrogate, seconds].mean()
        rows.append([surrogate, *(number(means[column] / length_s) for column in seconds)])
    columns = ["Surrogate", *HYBRID_PARTS.values(), "sum", "whole run", "to equilibrium"]
    groups = [("", 1), (f"Hybrid ({unit})", len(HYBRID_PARTS) + 1), (f"Full DEM ({unit})", 2)]
    caption = (
        f"Mean wall time of a slurry in {unit} over {named(scope)}, start-up of programs included. The article, at its "
        f"own, larger scale and on other machines: {article.FULL_DEM_MIN:,} min full DEM, about {article.HYBRID_MIN} "
        f"min hybrid, {article.FULL_DEM_MIN / article.HYBRID_MIN:.0f} times; whether the DEM up to the input frames is "
        f"inside the {article.HYBRID_MIN} min is not stated. CPU time too, and every slurry: tables/speedup.csv."
    )
    parts_table = Table("Table S5", caption, columns, rows, groups=groups)

    sentence = "Wall time of the hybrid run with its parts. No slurry was run both ways."
    finite = shown.dropna(subset=["ratio"])
    blocks = [parts_table]
    if not finite.empty:
        sentence = "Wall time of the full DEM and of the hybrid run with its parts."
        ratios, early, largest = [], [], []
        for surrogate, own in finite.groupby("surrogate", sort=False):
            parts = own[list(HYBRID_PARTS)].sum()
            ratios.append(f"{span(own.ratio, '.2g')} ({surrogate})")
            if own.ratio_to_equilibrium.notna().any():
                early.append(f"{span(own.ratio_to_equilibrium.dropna(), '.2g')} ({surrogate})")
            largest.append(f"{HYBRID_PARTS[parts.idxmax()]} with {surrogate} ({parts.max() / parts.sum():.0%})")
        sentence += f" The full DEM takes {listed(ratios)} times as long as the hybrid run."
        if early:
            sentence += f" The DEM up to its own equilibrium takes {listed(early)} times as long."
        sentence += f" The largest part of the hybrid time is {listed(largest)}."
        blocks.append(ratio_table(results, comparison, cpu))
    if results.adopted_model:
        sentence += " Not in it: what the training of the model took elsewhere."
    training = results.costs[results.costs.stage == "train_surrogate"]
    sentence += "".join(
        f" Not in it, and needed once: the training of {row.surrogate}, {duration(row.wall_s)}, and the DEM of its "
        "training slurries."
        for row in training.itertuples()
    )
    section.blocks += [
        *figure_block(
            results.figures,
            "costs",
            "Fig. S3",
            f"{sentence} The article, at its own scale, has {article.FULL_DEM_MIN:,} min against about "
            f"{article.HYBRID_MIN} min.",
        ),
        *blocks,
    ]
    stages = results.costs[results.costs.stage != "run_slurry_to_input"].groupby("stage", sort=False)
    rows = [
        [
            stage.replace("_", " "),
            str(len(jobs)),
            duration(jobs.wall_s.sum()),
            duration(jobs.cpu_s.sum()),
            duration(jobs.wall_s.max()),
            number(jobs.max_rss_mb.max(), ",.0f"),
        ]
        for stage, jobs in stages
    ]
    columns = ["Stage", "Jobs", "Wall time, summed", "CPU time, summed", "Longest job", "Peak memory (MB)"]
    caption = (
        "All jobs by stage. Jobs can run side by side: the sum of wall times is not the length of the run. The stage "
        "run_slurry_to_input of tables/cost.csv is a part of run_slurry and not counted again."
    )
    section.blocks.append(Table("Table S6", caption, columns, rows))
    return section


def provenance_section(results: Results) -> Section:
    """Versions, seeds and the configuration."""
    flat = {}
    for key, value in results.versions.items():
        flat.update(value if isinstance(value, Mapping) else {key: value})
    lammps = sorted({str(run["lammps_version"]) for run in results.runs.values()})
    rows = [[str(key).replace("_", " "), str(value)] for key, value in flat.items()]
    rows.append(["LAMMPS, as its logs say", listed(lammps)])
    caption = (
        "Versions at the time when the configuration of this run was last recorded. Seeds and physics of every slurry "
        "are in its inputs.json."
    )
    return Section(
        "Versions and configuration",
        [
            Table("Table S7", caption, ["", "Version"], rows, texts=(0, 1)),
            Listing("Effective configuration", results.config_text),
        ],
    )


def build_sections(results: Results) -> list[Section]:
    """All sections in their order."""
    comparison, cpu = (results.speedup[results.speedup.clock == clock] for clock in ("wall_s", "cpu_s"))
    sections = [
        summary_section(results, comparison),
        workflow_section(results),
        settings_section(results),
        dem_section(results),
        surrogates_section(results),
        training_range_section(results),
        prediction_section(results),
        new_section(results),
        cost_section(results, comparison, cpu),
        provenance_section(results),
    ]
    return [section for section in sections if section is not None]


def report_html(results: Results) -> str:
    """The whole report."""
    groups = (("to train on", ["train"]), ("held out", ["validation", "test"]), ("new", ["new"]))
    counts = [f"{len(results.slurries(*roles))} {words}" for words, roles in groups if results.slurries(*roles)]
    lead = (
        f"Tape-casting slurries by DEM and by a hybrid of DEM and {listed(results.surrogates)}: {listed(counts)}; "
        f"{results.equilibrium.particles.sum():,} particles in all."
    )
    notices = Notices("To keep in mind", warnings(results), NO_WARNINGS)
    title = f"SlurryCast report: {results.config['run']['name']}"
    return page_html(title, lead, notices, build_sections(results))
