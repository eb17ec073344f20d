"""The report: one HTML file that holds all tables and figures of a run, and every sentence computed from them.

`Results` is what a run has left behind; each `..._section` turns a part of it into blocks (tables, figures, text), and
`report_html` puts them into report.html.jinja. The study's numbers stand in columns of their own.
"""

import base64
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

from slurrycast import study
from slurrycast.network_table import Network
from slurrycast.speedup import HYBRID_PARTS, time_unit

TEMPLATE = Path(__file__).with_name("report.html.jinja")
STUDY_GROUP = "Study (its own, larger scale)"
# A final density this far from the expected one is worth a notice.
DENSITY_TOLERANCE = 0.02
AXES = ("x", "y", "z")
# Figures have 150 pixels an inch and text of 9 to 10 points; this shows it at 13 to 15 CSS pixels.
CSS_PIXELS_PER_PIXEL = 0.7


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
    costs: pd.DataFrame
    speedup: pd.DataFrame
    histories: Mapping[str, pd.DataFrame]
    networks: Mapping[str, Network]
    figures: Mapping[str, Path]

    @property
    def surrogates(self) -> list[str]:
        """Names of the surrogates."""
        return list(self.networks)

    @property
    def adopted_model(self) -> str | None:
        """Path of the model that was trained elsewhere; None where this run trains its own."""
        return self.config["surrogate"]["model"]

    def slurries(self, *roles: str) -> list[str]:
        """Ids of the slurries in one of `roles`, in the order of the slurry table."""
        return list(self.equilibrium.slurry[self.equilibrium.role.isin(roles)])

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


@dataclass(frozen=True)
class Text:
    """A paragraph."""

    text: str
    kind: str = "text"


@dataclass(frozen=True)
class Heading:
    """A heading inside a section."""

    text: str
    kind: str = "heading"


@dataclass(frozen=True)
class Listing:
    """Text as it is, folded away."""

    title: str
    text: str
    kind: str = "listing"


@dataclass(frozen=True)
class FigureBlock:
    """An embedded picture (data URI), its caption and the width in CSS pixels at which its text is as large as ours."""

    label: str
    caption: str
    image: str
    width_px: int
    kind: str = "figure"


@dataclass(frozen=True)
class Table:
    """Cells are text already; columns whose number is in `texts` are set to the left, those in `study` marked."""

    label: str
    caption: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    texts: Sequence[int] = (0,)
    study: Sequence[int] = ()
    groups: Sequence[tuple[str, int]] = ()
    kind: str = "table"

    def style(self, column: int) -> str:
        """CSS classes of a column."""
        return " ".join(name for name, those in (("text", self.texts), ("study", self.study)) if column in those)


@dataclass
class Section:
    """A part of the report."""

    title: str
    blocks: list = field(default_factory=list)


# ---- numbers and words


def number(value: float | None, form: str = ".3g") -> str:
    """Text of a number; a dash where there is none."""
    return "–" if value is None or pd.isna(value) else format(value, form)


def duration(seconds: float | None) -> str:
    """Text of a time span in the unit that fits it."""
    if seconds is None or pd.isna(seconds):
        return "–"
    length_s, unit = time_unit(seconds)
    return f"{seconds / length_s:.3g} {unit}"


def span(values: pd.Series, form: str = ".3g", unit: str = "") -> str:
    """Text of a range: "a to b unit", or the one value."""
    low, high = format(values.min(), form), format(values.max(), form)
    return f"{low}{unit}" if low == high else f"{low} to {high}{unit}"


def listed(words: Sequence[str]) -> str:
    """Text of a list: "a, b and c"."""
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else list(words))


def named(slurries: Sequence[str]) -> str:
    """Text of some slurries: "slurry 1", "slurries 1 and 2"."""
    return f"{'slurry' if len(slurries) == 1 else 'slurries'} {listed(list(slurries))}"


def pair_name(pair: str) -> str:
    """Name of an RDF's pair in sentences and tables."""
    return "all particles" if pair == "all" else pair


def figure_block(results: Results, stem: str, label: str, caption: str) -> list[FigureBlock]:
    """Block of the figure with file name `stem`; none where this run does not make it (3D pictures can be off)."""
    from PIL import Image

    if stem not in results.figures:
        return []
    path = results.figures[stem]
    content, kind = path.read_bytes(), "png"
    with Image.open(path) as image:
        width_px = round(image.width * CSS_PIXELS_PER_PIXEL)
        if stem.startswith("slurry_"):  # 3D pictures are several times smaller as WebP
            buffer = io.BytesIO()
            image.convert("RGB").save(buffer, "WEBP", quality=88)
            content, kind = buffer.getvalue(), "webp"
    uri = f"data:image/{kind};base64,{base64.b64encode(content).decode('ascii')}"
    return [FigureBlock(label, caption, uri, width_px)]


# ---- what to keep in mind


def warnings(results: Results) -> list[str]:
    """Sentences on what limits the results: runs not in equilibrium, odd densities, extrapolation, a foreign model."""
    equilibrium = results.equilibrium
    notices = []
    if results.adopted_model:
        notices.append(
            f"Surrogate {listed(results.surrogates)} was trained elsewhere ({results.adopted_model}): neither its "
            "training range nor its recipe is known here."
        )
    notices += [f"Slurry {row.slurry}: {row.warning}." for row in equilibrium.itertuples() if row.warning]
    expected = results.config["formulation"]["expected_density_g_cm3"]
    dem = results.density[results.density.model == "DEM"]
    odd = dem[(dem.density_g_cm3 / expected - 1).abs() > DENSITY_TOLERANCE]
    notices += [
        f"Slurry {row.slurry}: the DEM ends at {row.density_g_cm3:.3f} g/cm³, more than {DENSITY_TOLERANCE:.0%} from "
        f"the expected {expected:g} g/cm³."
        for row in odd.itertuples()
    ]
    if not results.adopted_model:
        trained = equilibrium.mass_units[equilibrium.role == "train"]
        beyond = equilibrium[~equilibrium.role.eq("train") & (equilibrium.mass_units > trained.max())]
        notices += [
            f"Slurry {row.slurry} ({row.mass_units:g} units) is larger than anything trained on (at most "
            f"{trained.max():g} units): its prediction is an extrapolation."
            for row in beyond.itertuples()
        ]
    return notices


# ---- sections


def summary_section(results: Results, comparison: pd.DataFrame) -> Section:
    """Key results, with the study's beside them."""
    rows = [
        ["DEM runs", str(len(results.runs)), str(study.TRAINING_SLURRIES + study.HELD_OUT_SLURRIES)],
    ]
    for surrogate in results.surrogates:
        prefix = f"{surrogate}: " if len(results.surrogates) > 1 else ""
        structures = results.structures(surrogate).dropna()
        if not structures.empty:
            worst = structures.difference.abs().idxmax()
            theirs = study_differences()
            their_worst = theirs.abs().idxmax()
            rows += [
                [
                    f"{prefix}Mean |hybrid − DEM| density (g/cm³)",
                    number(structures.difference.abs().mean()),
                    f"{theirs.abs().mean():.2f}",
                ],
                [
                    f"{prefix}Largest |hybrid − DEM| density (g/cm³)",
                    f"{abs(structures.difference[worst]):.3g} (slurry {worst}, {abs(structures.share[worst]):.1%})",
                    f"{abs(theirs[their_worst]):.2f} (slurry {their_worst}, "
                    f"{abs(theirs[their_worst]) / study.DEM_STRUCTURE[their_worst].density_g_cm3:.0%})",
                ],
            ]
        errors = results.errors(surrogate)
        if not errors.empty:
            theirs = pd.DataFrame(study.COORDINATE_ERRORS.values())
            rows += [
                [f"{prefix}MSE of coordinates (µm²)", span(errors.mse_um2), span(theirs.mse_um2)],
                [f"{prefix}R² of coordinates", span(errors.r2, ".4f"), span(theirs.r2, ".3f")],
            ]
        differences = results.rdf_errors[results.rdf_errors.surrogate == surrogate]
        for pair, of_pair in differences.groupby("pair", sort=False):
            label = f"{prefix}Mean |Δg(r)|, {pair_name(pair)}"
            rows.append([label, span(of_pair.mean_abs_difference), "–"])
        ratios = comparison.ratio[comparison.surrogate == surrogate].dropna()
        if not ratios.empty:
            rows.append(
                [
                    f"{prefix}Wall time, full DEM / hybrid",
                    span(ratios, ".2g"),
                    f"about {study.FULL_DEM_MIN / study.HYBRID_MIN:.0f}",
                ]
            )
    held_out = results.slurries("test", "validation")
    new = results.slurries("new")
    sentence = f"Ranges run over {named(held_out)}." if held_out else "No slurry has a target to compare with."
    if new:
        sentence += f" New, without a target: {named(new)}."
    table = Table("Key results", sentence, ["", "This run", STUDY_GROUP], rows, study=(2,))
    return Section("Summary", [table])


def workflow_section(results: Results) -> Section:
    """Fig. 1."""
    caption = (
        "The workflow, drawn from its rules. Each box is one rule; an arrow means that files go from one to the other. "
        "Arrows that others imply are left out."
    )
    return Section("Workflow", figure_block(results, "workflow", "Fig. 1", caption))


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
        ["Time step (µs)", f"{dem['timestep_us']:g}", f"{study.TIMESTEP_US:g}"],
        ["Steps", f"{dem['steps']:,}", f"{study.STEPS:,}"],
        ["Simulated time (µs)", f"{dem['steps'] * dem['timestep_us']:g}", f"{study.STEPS * study.TIMESTEP_US:g}"],
        ["Frames", f"{dem['frames']}", f"{study.FRAMES}"],
        ["Steps between frames", f"{per_frame:,}", f"{study.STEPS_PER_FRAME:,}"],
        [
            "Input frames, at steps",
            steps_of(learning["input_frames"], per_frame),
            steps_of(study.INPUT_FRAMES, study.STEPS_PER_FRAME),
        ],
        [
            "Target frame, at step",
            f"{learning['target_frame'] * per_frame:,}",
            f"{study.STEPS:,}",
        ],
        ["Pressure (kPa)", f"{dem['pressure_kpa']:g}", "not stated"],
        ["Pressure damping (µs)", f"{dem['pressure_damping_us']:g}", "not stated"],
        ["Temperature (K)", f"{dem['temperature_k']:g}", "not stated"],
        ["MPI ranks a simulation", str(dem["ranks"]), f"one node of {study.RANKS} cores"],
        [
            "Wall time of a full simulation",
            " to ".join(dict.fromkeys(map(duration, (wall_s.min(), wall_s.max())))),
            duration(60 * study.FULL_DEM_MIN),
        ],
        ["Slurries: training", str(len(results.slurries("train"))), str(study.TRAINING_SLURRIES)],
        ["Slurries: held out", str(len(held_out)), str(study.HELD_OUT_SLURRIES)],
        ["Slurries: new, only to the last input frame", str(len(new)), "–"],
        ["Relaxation after the prediction (steps)", f"{results.config['relaxation']['steps']:,}", "not stated"],
    ]
    if not results.adopted_model:
        samples = results.equilibrium.particles[results.equilibrium.role == "train"].sum()
        rows.append(["Samples (particles of the training slurries)", f"{samples:,}", f"{study.SAMPLES:,}"])
        for surrogate in results.surrogates:
            settings = results.config["surrogate"].get(surrogate, {})
            rows += [
                [f"{words}, {surrogate}", f"{settings[key]:,}", f"{theirs:,}"]
                for key, words, theirs in (
                    ("epochs", "Epochs", study.EPOCHS),
                    ("batch_size", "Batch size", study.BATCH_SIZE),
                    ("learning_rate", "Learning rate", study.LEARNING_RATE),
                )
                if key in settings
            ]
    caption = f"Settings of simulation{'' if results.adopted_model else ' and training'} in this run and in the study."
    blocks = [Table("Table 1", caption, ["", "This run", STUDY_GROUP], rows, study=(2,))]

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


ROLE_WORDS = {"train": "training", "validation": "validation", "test": "held out", "new": "new"}


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
        results,
        "densification",
        "Fig. S1",
        f"Density of every slurry against time in the DEM. The band marks input frames {frames}." + sentence,
    )
    return Section("DEM runs", [Table("Table S2", caption, columns, rows, texts=(0, 1)), *figure])


def network_section(results: Results, surrogate: str) -> Section:
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
    same = "the same number as" if network.parameters == study.PARAMETERS else "against"
    caption = (
        f"The network {surrogate} layer by layer, read from the model file: {network.parameters:,} parameters, {same} "
        f"the study's {study.PARAMETERS:,}. Shapes are frames (or pooled positions) × channels."
    )
    blocks = [Table("Table 2", caption, ["Layer", "Output shape", "Parameters"], rows)]
    if history.empty:
        caption = "The model was trained elsewhere and came without learning curves."
    else:
        best = history.loc[history.val_loss.idxmin()]
        first, last = history.iloc[0], history.iloc[-1]
        origin, use = "", ", whose weights are used"
        if results.adopted_model:
            origin, use = " of the adopted model, as they came with it,", ""
        caption = (
            f"Learning curves{origin} over {len(history)} epochs. Validation MSE goes from {first.val_loss:.3g} to its "
            f"lowest, {best.val_loss:.3g} µm² (MAE {best.val_mae:.3g} µm), at epoch {best.epoch:.0f}{use}; in the last "
            f"epoch it is {last.val_loss:.3g} µm², that of training {last.loss:.3g} µm²."
        )
        if best.epoch == last.epoch and len(history) > 1 and not results.adopted_model:
            caption += " The lowest value is in the last epoch: more epochs may lower it further."
        caption += f" The study trains for {study.EPOCHS:,} epochs at batch {study.BATCH_SIZE}."
    blocks += figure_block(results, f"learning_curves_{surrogate}", "Fig. 2", caption)
    return Section(f"Surrogate {surrogate}", blocks)


def study_differences() -> pd.Series:
    """Hybrid less DEM density (g/cm3) in the study, by slurry."""
    return pd.Series(
        {
            slurry: study.HYBRID_STRUCTURE[slurry].density_g_cm3 - structure.density_g_cm3
            for slurry, structure in study.DEM_STRUCTURE.items()
        }
    )


def coordinates_caption(results: Results, surrogate: str, slurry: str) -> str:
    """What the panels of one slurry show."""
    per_axis = {axis: results.errors(surrogate, axis).loc[slurry] for axis in AXES}
    overall = results.errors(surrogate).loc[slurry]
    worst = max(AXES, key=lambda axis: per_axis[axis].mse_um2)
    caption = (
        f"R² is {' / '.join(f'{per_axis[axis].r2:.4f}' for axis in AXES)} on x / y / z. MSE is {overall.mse_um2:.3g} "
        f"µm² over all axes, largest along {worst} ({per_axis[worst].mse_um2:.3g} µm²); rescaled to the true box it is "
        f"{overall.mse_um2_true_box:.3g} µm² over all axes."
    )
    if slurry in study.R2_PER_AXIS:
        theirs = " / ".join(f"{study.R2_PER_AXIS[slurry][axis]:.3f}" for axis in AXES)
        caption += f" The study, at its own scale, has R² of {theirs} for its slurry {slurry}."
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


def density_table(results: Results, surrogate: str) -> Table:
    """Table 3."""
    structures = results.structures(surrogate).dropna()
    rows = []
    for slurry, row in structures.iterrows():
        theirs = study.DEM_STRUCTURE.get(slurry), study.HYBRID_STRUCTURE.get(slurry)
        if None in theirs:
            beside = ["–"] * 5
        else:
            dem, hybrid = theirs
            share = hybrid.density_g_cm3 / dem.density_g_cm3 - 1
            beside = [f"{dem.density_g_cm3:.4f}", f"{hybrid.density_g_cm3:.4f}", f"{share:+.1%}"]
            beside += [f"{dem.volume_um3:,.0f}", f"{hybrid.volume_um3:,.0f}"]
        ours = [f"{row.dem_density:.4f}", f"{row.density:.4f}", f"{row.share:+.1%}"]
        rows.append([slurry, *ours, f"{row.dem_volume:,.1f}", f"{row.volume:,.1f}", *beside])
    caption = f"Density and volume of the final microstructure, full DEM and hybrid. {density_sentence(structures)}"
    columns = ["Slurry", *["DEM (g/cm³)", "hybrid (g/cm³)", "difference", "DEM (µm³)", "hybrid (µm³)"] * 2]
    groups = [("", 1), ("This run", 5), (STUDY_GROUP, 5)]
    return Table("Table 3", caption, columns, rows, study=range(6, 11), groups=groups)


def density_sentence(structures: pd.DataFrame) -> str:
    """How far hybrid densities are from the DEM's."""
    worst = structures.difference.abs().idxmax()
    share = structures.share[worst]
    return (
        f"The mean absolute difference of density is {structures.difference.abs().mean():.3g} g/cm³, the largest "
        f"{abs(structures.difference[worst]):.3g} g/cm³ (slurry {worst}, {abs(share):.1%} "
        f"{'denser' if share > 0 else 'less dense'} than its DEM); the study has "
        f"{study_differences().abs().mean():.2f} and {study_differences().abs().max():.2f} g/cm³."
    )


def density_figure(results: Results, surrogate: str) -> list[FigureBlock]:
    """Fig. S2: all slurries of the hybrid chain."""
    structures = results.structures(surrogate).dropna()
    if structures.empty:
        caption = "Final density of the hybrid chain; there is no full DEM to compare with."
    else:
        caption = f"Final density of the full DEM and the hybrid chain. {density_sentence(structures)}"
    return figure_block(results, f"density_{surrogate}", "Fig. S2", caption)


def coordinate_table(results: Results, surrogate: str) -> Table:
    """Table 4."""
    errors = results.errors(surrogate)
    rows = []
    for slurry, row in errors.iterrows():
        theirs = study.COORDINATE_ERRORS.get(slurry)
        per_axis = " / ".join(f"{results.errors(surrogate, axis).loc[slurry].r2:.3f}" for axis in AXES)
        rows.append(
            [
                slurry,
                *(number(row[name]) for name in ("mse_um2", "mae_um")),
                f"{row.r2:.4f}",
                per_axis,
                *(number(row[name]) for name in ("mse_um2_true_box", "mae_um_true_box")),
                f"{row.r2_true_box:.4f}",
                *(["–"] * 3 if theirs is None else [f"{theirs.mse_um2}", f"{theirs.mae_um}", f"{theirs.r2}"]),
            ]
        )
    caption = (
        "Errors of the predicted coordinates before relaxation, over all axes, in each prediction's own box (primary) "
        "and rescaled to the true box."
    )
    if not errors.empty:
        worst, best = errors.mse_um2.idxmax(), errors.mse_um2.idxmin()
        caption += f" MSE is lowest for slurry {best} and highest for slurry {worst}."
        gain = 1 - (errors.mse_um2_true_box / errors.mse_um2)
        most = gain.idxmax()
        if gain[most] > 0:
            caption += (
                f" The error of the predicted box makes up most for slurry {most}: "
                f"knowing the true box would lower its MSE by {gain[most]:.0%}."
            )
    columns = ["Slurry", "MSE (µm²)", "MAE (µm)", "R²", "R² x / y / z"]
    columns += ["MSE (µm²)", "MAE (µm)", "R²"] * 2
    groups = [("", 1), ("This run, own box", 4), ("This run, true box", 3), (STUDY_GROUP, 3)]
    return Table("Table 4", caption, columns, rows, study=range(8, 11), groups=groups)


def rdf_caption(results: Results, surrogate: str) -> str:
    """What the RDF panels show."""
    errors = results.rdf_errors[results.rdf_errors.surrogate == surrogate]
    if errors.empty:
        return "Radial distribution functions of the predicted and the relaxed structure; there is no target."
    cutoff_um = results.config["analysis"]["rdf_cutoff_um"]
    caption = "Radial distribution functions of the target, the predicted and the relaxed structure. "
    for pair, of_pair in errors.groupby("pair", sort=False):
        worst = of_pair.loc[of_pair.mean_abs_difference.idxmax()]
        caption += (
            f"For {pair_name(pair)} the relaxed curve is {span(of_pair.mean_abs_difference)} "
            f"from the target on average, farthest for slurry {worst.slurry}. "
        )
    if errors.r_max_um.min() < 0.99 * cutoff_um:
        caption += (
            f"Curves end at {span(errors.r_max_um, '.2f', ' µm')} instead of {cutoff_um:g} µm, since distances beyond "
            "half of the shortest box edge are not complete. "
        )
    return caption + (
        "The study sees first peaks near 0.8 and 1.1 µm for all pairs, deviations at 0.3 to 0.9 µm for NiO-8YSZ, and "
        "agreement beyond 2 µm except for its slurry 6."
    )


def rdf_figure(results: Results, surrogate: str) -> list[FigureBlock]:
    """Fig. 6: all slurries of the hybrid chain."""
    return figure_block(results, f"rdf_{surrogate}", "Fig. 6", rdf_caption(results, surrogate))


def rdf_table(results: Results, surrogate: str) -> Table:
    """Table S3."""
    errors = results.rdf_errors[results.rdf_errors.surrogate == surrogate]
    pairs = list(dict.fromkeys(errors.pair))
    rows = []
    for slurry, of_slurry in errors.groupby("slurry", sort=False):
        by_pair = of_slurry.set_index("pair").mean_abs_difference
        first = of_slurry.iloc[0]
        values = [number(by_pair.get(pair)) for pair in pairs]
        rows.append([slurry, f"{first.r_max_um:.3f}", f"{first.bins:.0f}", *values])
    caption = "Mean absolute difference of the RDF of target and relaxed structure over all bins up to r max."
    columns = ["Slurry", "r max (µm)", "Bins", *map(pair_name, pairs)]
    return Table("Table S3", caption, columns, rows)


def prediction_section(results: Results, surrogate: str) -> Section:
    """Fig. 3 to 6, Tables 3, 4 and S3: slurries with a target."""
    complete = results.slurries("validation", "test")
    compared = [slurry for slurry in results.structures(surrogate).index if slurry in complete]
    section = Section(f"Hybrid against DEM, {surrogate}")
    if not compared:
        section.blocks.append(Text("No slurry of this run has a target to compare with."))
        return section
    section.blocks += [
        Heading("Coordinates"),
        Text(
            "Predicted against target coordinates of each particle, unwrapped, each structure in its own box and less "
            "its mean over the particles; the lower panels show predicted less target. R² mostly says how large the "
            "box is against the error, so the deviations and the MSE are what to compare."
        ),
    ]
    for place, slurry in enumerate(compared):
        label = f"Fig. {3 if place == 0 else 5}, slurry {slurry}"
        section.blocks += figure_block(
            results, f"coordinates_{surrogate}_{slurry}", label, coordinates_caption(results, surrogate, slurry)
        )
    section.blocks += [coordinate_table(results, surrogate), Heading("Microstructures")]
    pictures = []
    for slurry in compared:
        caption = picture_caption(results, surrogate, slurry)
        pictures += figure_block(results, f"slurry_{surrogate}_{slurry}", f"Fig. 4, slurry {slurry}", caption)
    section.blocks += pictures or [Text("3D pictures are off in this configuration (report.pictures).")]
    section.blocks += [
        Heading("Density and volume"),
        density_table(results, surrogate),
        *density_figure(results, surrogate),
        Heading("Radial distribution functions"),
        *rdf_figure(results, surrogate),
        rdf_table(results, surrogate),
    ]
    return section


def new_section(results: Results) -> Section | None:
    """Slurries without a target: what the chain says of them."""
    new = results.slurries("new")
    if not new:
        return None
    rows, pictures = [], []
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
            pictures += figure_block(
                results,
                f"slurry_{surrogate}_{slurry}",
                f"Fig. 4, slurry {slurry}",
                picture_caption(results, surrogate, slurry),
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
    if results.slurries("validation", "test"):
        curves = [Text("Their densities are in Fig. S2 and their radial distribution functions in Fig. 6, above.")]
    else:
        curves = [
            block
            for surrogate in results.surrogates
            for block in (*density_figure(results, surrogate), *rdf_figure(results, surrogate))
        ]
    return Section("New slurries", [Table("Table S4", caption, columns, rows, texts=(0, 1)), *pictures, *curves])


def cost_section(results: Results, comparison: pd.DataFrame, cpu: pd.DataFrame) -> Section:
    """Fig. S3 and Tables S5, S6: what each slurry and each stage took."""
    section = Section("Cost")
    length_s, unit = time_unit(comparison[["dem", "hybrid"]].max(axis=None))
    many = len(results.surrogates) > 1
    rows = [
        [
            f"{row.slurry} ({row.surrogate})" if many else row.slurry,
            *(number(getattr(row, stage) / length_s) for stage in HYBRID_PARTS),
            *(number(seconds / length_s) for seconds in (row.hybrid, row.dem, row.dem_to_equilibrium)),
            *(number(ratio, ".2f") for ratio in (row.ratio, row.ratio_to_equilibrium, cpu_ratio)),
        ]
        for row, cpu_ratio in zip(comparison.itertuples(), cpu.ratio, strict=True)
    ]
    columns = ["Slurry", "DEM to input", "Prediction", "Wrapping", "Relaxation", "Sum"]
    columns += ["Whole run", "To equilibrium", "Whole run", "To equilibrium", "Whole run, CPU time"]
    groups = [("", 1), (f"Hybrid ({unit})", 5), (f"Full DEM ({unit})", 2), ("Full DEM / hybrid", 3)]
    caption = (
        f"Wall time of each slurry in {unit}, start-up of programs included. The study, at its own, larger scale and "
        f"on other machines: {study.FULL_DEM_MIN:,} min full DEM, about {study.HYBRID_MIN} min hybrid, "
        f"{study.FULL_DEM_MIN / study.HYBRID_MIN:.0f} times; whether the DEM up to the input frames is inside the "
        f"{study.HYBRID_MIN} min is not stated."
    )
    finite = comparison.dropna(subset=["ratio"])
    sentence = "Wall time of the hybrid run with its parts. No slurry was run both ways."
    if not finite.empty:
        parts = finite[list(HYBRID_PARTS)].sum()
        sentence = (
            "Wall time of the full DEM and of the hybrid run with its parts. "
            f"The full DEM takes {span(finite.ratio, '.2g')} times as long as the hybrid run, most for slurry "
            f"{finite.slurry[finite.ratio.idxmax()]}; of the hybrid time, {parts.max() / parts.sum():.0%} goes into "
            f"{HYBRID_PARTS[parts.idxmax()]}, its largest part."
        )
        early = finite.ratio_to_equilibrium.dropna()
        if not early.empty:
            sentence += f" Against the DEM up to its equilibrium the ratio is {span(early, '.2g')}."
    if results.adopted_model:
        sentence += " Not in it: what the training of the model took elsewhere."
    training = results.costs[results.costs.stage == "train_surrogate"]
    sentence += "".join(
        f" Not in it, and needed once: the training of {row.surrogate}, {duration(row.wall_s)}, and the DEM of its "
        "training slurries."
        for row in training.itertuples()
    )
    for surrogate in results.surrogates:
        section.blocks += figure_block(
            results,
            f"costs_{surrogate}",
            "Fig. S3",
            f"{sentence} The study, at its own scale, has {study.FULL_DEM_MIN:,} min against about "
            f"{study.HYBRID_MIN} min.",
        )
    section.blocks.append(Table("Table S5", caption, columns, rows, groups=groups))
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
    ]
    for surrogate in results.surrogates:
        sections += [network_section(results, surrogate), prediction_section(results, surrogate)]
    sections += [new_section(results), cost_section(results, comparison, cpu), provenance_section(results)]
    return [section for section in sections if section is not None]


def report_html(results: Results) -> str:
    """The whole report as one HTML text that loads nothing from elsewhere."""
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(TEMPLATE.parent), autoescape=True, undefined=jinja2.StrictUndefined
    )
    groups = (("to train on", ["train"]), ("held out", ["validation", "test"]), ("new", ["new"]))
    counts = [f"{len(results.slurries(*roles))} {words}" for words, roles in groups if results.slurries(*roles)]
    lead = (
        f"Tape-casting slurries by DEM and by a hybrid of DEM and {listed(results.surrogates)}: {listed(counts)}; "
        f"{results.equilibrium.particles.sum():,} particles in all."
    )
    return environment.get_template(TEMPLATE.name).render(
        title=f"SlurryCast report: {results.config['run']['name']}",
        lead=lead,
        warnings=warnings(results),
        sections=build_sections(results),
        study=study,
    )
