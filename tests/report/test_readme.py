"""Numbers in the README and in docs/ against the files that the workflow wrote."""

import json
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from reference_results import read_reference
from slurrycast.data.tables import read_equilibrium, read_table
from slurrycast.evaluation.relaxation import enough_steps
from slurrycast.report import reference_article


@pytest.fixture
def reference(root) -> Path:
    return root / "results" / "reference"


def rows(text: str) -> dict[str, list[str]]:
    """Rows of the tables in Markdown whose first cell is code, by that cell."""
    lines = [[cell.strip() for cell in line.strip().strip("|").split("|")] for line in text.splitlines()]
    return {cells[0].strip("`"): cells[1:] for cells in lines if re.fullmatch(r"`\w+`", cells[0]) and len(cells) > 4}


def summary(folder: Path) -> dict[str, list[str]]:
    """The results table: means over the test slurries of a run with the evaluation."""
    roles = read_equilibrium(folder / "tables" / "equilibrium.csv").set_index("slurry").role
    tables = {name: read_table(folder / "tables" / f"{name}.csv") for name in ("skill", "structure_errors", "front")}
    tables = {name: table[table.slurry.map(roles) == "test"] for name, table in tables.items()}
    relaxed = tables["structure_errors"].query("stage == 'relaxed'")
    expected = {}
    for label in tables["skill"].surrogate.unique():
        skill, structure, front = (
            table[table.surrogate == label] for table in (tables["skill"], relaxed, tables["front"])
        )
        density = structure[structure.quantity == "density_g_cm3"]
        density_error = abs(density.value / density.dem_value - 1)
        rdf = structure[structure.quantity == "rdf_all"]
        expected[label] = [
            f"{skill.mse_um2.mean():.3f}",
            f"{skill.skill.mean():.2f}",
            f"{density_error.mean():.2%} ({density_error.max():.2%})",
            f"{(rdf.value / rdf.replica_sd).mean():.2f}",
            f"{front.cost_share_of_full_dem.mean():.1%}",
        ]
    return expected


def test_results_table(root, reference):
    assert rows((root / "README.md").read_text(encoding="utf-8")) == summary(reference / "reduced")


def test_machine_and_commit(root, reference):
    text = re.sub(r"\s+", " ", (root / "README.md").read_text(encoding="utf-8"))
    versions = json.loads((reference / "reduced" / "versions.json").read_text())
    assert re.sub(r", \d+ GiB$", "", versions["machine"]) in text
    for network in ("vgg16", "vgg16_box"):
        epochs = len(pd.read_csv(reference / "reduced" / "models" / network / "history.csv"))
        assert f"`{network}` {epochs} epochs" in text


def test_the_affine_error_of_one_slurry_can_be_computed_anew(reference):
    """From its last input frame and the packing fraction of the training slurries alone, by the code as it is."""
    from slurrycast.analysis.errors import coordinate_errors
    from slurrycast.data.final_box import scale_to_packing_fraction
    from slurrycast.data.frames import read_frames
    from slurrycast.dem.recipe import sphere_volume_um3
    from slurrycast.surrogates import affine
    from slurrycast.surrogates.prediction import PredictionInput

    folder = reference / "reduced"
    packing_fraction = json.loads((folder / "packing_fraction.json").read_text())["mean"]
    with read_frames(folder / "frames" / "2.h5") as store:
        last, target = (store.frame(int(k)) for k in store.frame_numbers)
        volume_um3 = float(sphere_volume_um3(2 * store.particles.radius_um).sum())
        edges_um = last.edges_um * scale_to_packing_fraction(packing_fraction, volume_um3, last.edges_um)
        prediction = affine.predict(PredictionInput("2", store.particles, (last,), edges_um), None, {})
    error = coordinate_errors(target.position_um, prediction.position_um)["all"].mse_um2
    skill = read_table(folder / "tables" / "skill.csv").set_index(["surrogate", "slurry"])
    assert error == pytest.approx(skill.mse_um2["affine", "2"], rel=1e-6)


def one_line(path: Path) -> str:
    return re.sub(r"\s+", " ", path.read_text(encoding="utf-8"))


def test_time_step(root, reference):
    text = one_line(root / "docs" / "evaluation.md")
    summary = pd.read_csv(reference / "timestep" / "timestep_summary.csv").set_index("timestep_us")
    coarse, fine = summary.loc[2e-3], summary.iloc[0]
    assert f"{coarse.density_difference:+.2%} ± {coarse.standard_error:.2%} from that with 1e-4 µs" in text
    assert f"a shift of up to {coarse.density_difference_bound:.2%} is not excluded" in text
    later, error = coarse.time_to_equilibrium_us_difference, coarse.time_to_equilibrium_us_standard_error
    assert f"{later:+.0%} ± {error:.0%} later" in text
    assert f"{fine.cpu_s_mean / coarse.cpu_s_mean:.0f} times the CPU time" in text


def noise_lines(folder: Path) -> list[str]:
    """What the replicas and perturbed runs of a run say, a line for each replicated slurry."""
    noise = read_reference(folder / "tables" / "noise.csv").set_index(["slurry", "quantity"])
    lines = []
    for slurry in noise.index.unique("slurry"):
        of = noise.loc[slurry]
        density = of.loc["density_g_cm3"]
        spread = {pair: of["mean"][f"rdf_{pair}"] for pair in ("all", "NiO-8YSZ")}
        lines.append(
            f"Slurry {slurry} ({int(density.particles):,} particles): "
            f"{density['mean']:.4f} ± {2 * density.sd:.4f} g/cm³, "
            f"|Δg| {spread['all']:.4f} (all) and {spread['NiO-8YSZ']:.4f} (NiO-8YSZ), "
            f"floor {of['mean']['perturbation_floor_um2']:.4f} µm²"
        )
    return lines


def test_noise_and_cost(root, reference):
    text = one_line(root / "docs" / "evaluation.md")
    for line in noise_lines(reference / "reduced"):
        assert line in text
    scaling = read_table(reference / "reduced" / "tables" / "cost_scaling.csv").query("clock == 'cpu_s'")
    scaling = scaling.set_index("surrogate")
    for label in ("affine", "vgg16", "early_dem_x10"):
        row = scaling.loc[label]
        assert f"`{label}` N^{row.hybrid_exponent:.2f} ± {row.hybrid_exponent_se:.2f}" in text
    assert f"the full DEM N^{row.dem_exponent:.2f} ± {row.dem_exponent_se:.2f}" in text
    assert f"{scaling.training_s['vgg16'] / 60:.0f} min of CPU time" in text
    alone, with_dem = (
        scaling[column]["vgg16"] for column in ("slurries_to_pay_training", "slurries_to_pay_training_and_dem")
    )
    assert f"paid back after {alone:.0f} new slurries, or {with_dem:.0f} with the DEM" in text
    ends = read_equilibrium(reference / "reduced" / "tables" / "equilibrium.csv").query("role != 'new'").density_g_cm3
    assert f"the {len(ends)} slurries" in text
    assert f"end at {ends.min():.3f} to {ends.max():.3f} g/cm³" in text


def article_volume_error() -> float:
    """Of the reference article's slurry 6: hybrid over DEM, less 1."""
    return reference_article.HYBRID_STRUCTURE["6"].volume_um3 / reference_article.DEM_STRUCTURE["6"].volume_um3 - 1


def test_predicted_volumes(root, reference):
    text = one_line(root / "docs" / "evaluation.md")
    errors = read_table(reference / "reduced" / "tables" / "structure_errors.csv")
    density = errors[(errors.stage == "predicted") & (errors.quantity == "density_g_cm3")]
    volume_error = (density.dem_value / density.value - 1).groupby([density.surrogate, density.slurry]).first()
    for label in ("linear", "vgg16"):
        small, large = volume_error[label, "3"], volume_error[label, "6"]
        assert f"`{label}` {small:+.1%} for slurry 3 (1 unit) and {large:+.1%} for slurry 6 (5 units)" in text
    assert f"The reference article's slurry 6 errs the other way, {100 * article_volume_error():.0f} %" in text
    volumes = reference_article.HYBRID_STRUCTURE["6"].volume_um3, reference_article.DEM_STRUCTURE["6"].volume_um3
    assert "{:,} against {:,} µm³".format(*volumes) in text
    assert f"its slurry 6 is {-100 * article_volume_error():.0f} % too small" in text


def test_sizes(root, reference):
    text = one_line(root / "docs" / "evaluation.md")
    clocks, errors = (
        [pd.read_csv(reference / run / f"size_{table}.csv") for run in ("size", "size_clock")]
        for table in ("clock", "errors")
    )
    one, same = (clock.iloc[0] for clock in clocks)
    assert (one.damping_exponent, same.damping_exponent) == (0, -0.3)
    assert f"grows as N^{one.exponent:.3f} ± {one.standard_error:.3f}" in text
    assert f"take this out: N^{same.exponent:.3f} ± {same.standard_error:.3f} is left" in text
    assert set(errors[0].slurry) == set(errors[1].slurry)

    def span(values: pd.Series) -> str:
        return f"{values.min():+.1%} to {values.max():+.1%}"

    largest = 0
    for label in ("linear", "vgg16", "vgg16_relative"):
        one, same = (table[table.surrogate == label] for table in errors)
        small, large = (one[one.mass_units == units].predicted_volume_error for units in (1, 5))
        assert f"`{label}` {span(small)} (1 unit) and {span(large)} (5 units)" in text
        assert small.max() < 0 < large.min()
        assert f"`{label}` {span(same.predicted_volume_error)}" in text
        largest = max(largest, abs(same.predicted_volume_error).max())
    assert largest < 0.04 < abs(article_volume_error())  # neither makes the reference article's error
    shares = [f"{table.outside_share.max():.0%}" for table in errors]
    assert f"up to {shares[0]} of them are with one clock, and up to {shares[1]} at the same rate" in text


def test_ablation(root, reference):
    text = (root / "docs" / "evaluation.md").read_text(encoding="utf-8")
    table = pd.read_csv(reference / "ablation" / "ablation.csv").set_index("surrogate")
    affine = table.loc["affine"]
    networks = table.drop(index="affine")
    expected = {
        label: [
            row.target,
            row.coordinates,
            row.box,
            f"{row.best_val_loss_um2:.4f}",
            f"{row.validation_skill:.2f}",
            f"{row.test_skill:.2f}",
        ]
        for label, row in networks.iterrows()
    }
    assert {label: cells for label, cells in rows(text).items() if label.startswith("vgg16")} == expected
    assert f"The loss of the affine map is {affine.best_val_loss_um2:.4f} µm²" in text
    assert set(networks.epochs) == {30, 15} and networks.epochs["vgg16"] == 30
    # fed with the box: better on particles of the training slurries, worse on other slurries
    box, blind = networks.loc["vgg16_box"], networks.loc["vgg16_box_nobox"]
    assert box.best_val_loss_um2 < blind.best_val_loss_um2 < affine.best_val_loss_um2
    assert max(box.validation_skill, box.test_skill) < min(blind.validation_skill, blind.test_skill) < 0
    skill = read_table(reference / "ablation" / "skill.csv").query("surrogate == 'vgg16_box'").set_index("slurry").skill
    assert set(skill.nsmallest(2).index) == {"6", "V2"}  # of 5 units, the largest trained on has 4


def test_sentences_on_the_results(root, reference):
    text = one_line(root / "README.md")
    folder = reference / "reduced"
    roles = read_equilibrium(folder / "tables" / "equilibrium.csv").set_index("slurry").role
    skill, errors, front = (
        read_table(folder / "tables" / f"{name}.csv") for name in ("skill", "structure_errors", "front")
    )
    skill, errors, front = (table[table.slurry.map(roles) == "test"] for table in (skill, errors, front))
    of = skill.groupby("surrogate").skill
    assert f"worse on every test slurry (skill {of.min()['vgg16']:.2f} to {of.max()['vgg16']:.2f})" in text
    assert of.max()["vgg16"] < 0
    assert f"not beyond (skill {of.min()['vgg16_box']:.2f} to {of.max()['vgg16_box']:.2f})" in text
    assert f"a skill of {of.min()['early_dem_x2']:.2f} to {of.max()['early_dem_x2']:.2f}" in text
    better = set(of.mean()[of.mean() > 0].index)
    assert better == {"early_dem_x2", "early_dem_x10", "early_dem_x32"}
    cost = front.groupby("surrogate").cost_share_of_full_dem.mean()
    assert f"at {cost['early_dem_x2'] / cost['affine']:.1f} times the cost of `affine`" in text
    relaxed = errors[errors.stage == "relaxed"]
    density = relaxed[relaxed.quantity == "density_g_cm3"]
    density = abs(density.value / density.dem_value - 1).groupby(density.surrogate).max()
    assert f"every surrogate is within {density.max():.2%} of the DEM's density" in text
    assert f"the affine map within {density['affine']:.2%} in density" in text
    rdf = relaxed[relaxed.quantity.str.startswith("rdf_")]
    assert f"within {(rdf.value / rdf.replica_sd).max():.1f} times the replicas' difference" in text
    theirs = [
        abs(hybrid.density_g_cm3 / reference_article.DEM_STRUCTURE[slurry].density_g_cm3 - 1)
        for slurry, hybrid in reference_article.HYBRID_STRUCTURE.items()
    ]
    assert f"reports {100 * sum(theirs) / len(theirs):.1f} % on average and {100 * max(theirs):.0f} %" in text


def bar_row(words: str, bar: str, found: str, *, met: bool) -> str:
    """A row of the table of what was to be reached."""
    return f"| {words} | {bar} | {found} | {'met' if met else 'missed'} |"


def neighbours_lines(folder: Path, text: str) -> list[str]:
    """What a run says of `neighbours` on its test slurries, in the words of docs/neighbours.md, which `text` is."""
    names = ("skill", "structure_errors", "front", "uncertainty", "cost", "relaxation")
    tables = {name: read_table(folder / "tables" / f"{name}.csv") for name in names}
    roles = read_equilibrium(folder / "tables" / "equilibrium.csv").set_index("slurry").role
    test = list(roles.index[roles == "test"])
    skill = tables["skill"].pivot(index="slurry", columns="surrogate", values="skill").loc[test]
    error = tables["skill"].pivot(index="slurry", columns="surrogate", values="mse_um2").loc[test]
    of_slurry = tables["front"].pivot(index="slurry", columns="surrogate", values="cost_share_of_full_dem").loc[test]
    share = of_slurry.mean()
    ratio = error.neighbours / error.affine
    own = skill.neighbours
    lines = [
        f"skill of {own.mean():.2f} on average, {own.min():.2f} to {own.max():.2f}",
        f"MSE {ratio.min():.2f} to {ratio.max():.2f} of the affine map's",
    ]
    written = re.findall(r"^\| `(\w+)` \| [\d.]+ \| -?[\d.]+ \| [\d.]+% \|$", text, flags=re.MULTILINE)
    assert sorted(written) == sorted(skill.columns)
    for label in skill.columns:
        lines.append(f"| `{label}` | {error[label].mean():.3f} | {skill[label].mean():.2f} | {share[label]:.1%} |")
    relaxed = tables["structure_errors"].query("stage == 'relaxed'")
    for label in ("neighbours", "affine"):
        of_label = relaxed[relaxed.surrogate == label].set_index("slurry")
        density = of_label[of_label.quantity == "density_g_cm3"].loc[test]
        rdf = of_label[of_label.quantity == "rdf_all"].loc[test]
        off, spreads = abs(density.value / density.dem_value - 1), rdf.value / rdf.replica_sd
        off_g_cm3 = abs(density.value - density.dem_value)
        in_band, of_two = (off_g_cm3 <= 2 * density.replica_sd).sum(), (off_g_cm3 <= 8**0.5 * density.replica_sd).sum()
        lines += [
            f"`{label}` on {of_two} of {len(test)}",
            f"density within {off.max():.2%} of the DEM's ({off.mean():.2%} on average)",
            f"within two sd of the replicas on {in_band} of {len(test)} slurries",
            f"RDF within {spreads.max():.2f} of the replicas' spread",
        ]
    overlap = tables["relaxation"].groupby(["slurry", "surrogate"]).overlap_mean_predicted.first()
    for slurry in ("V1", "V2"):
        lines.append(f"{overlap[slurry, 'neighbours']:.1%} on {slurry} in place of {overlap[slurry, 'affine']:.1%}")
    assert share["driven_dem"] < 0.7 * share["neighbours"] and share["early_dem_x2"] > 1.5 * share["neighbours"]
    assert (abs(share[["affine_f24", "driven_dem_f24"]] - share["neighbours"]) < 0.01).all()  # "for as much"
    assert own.mean() < skill["affine_f24"].mean() < skill["driven_dem_f24"].mean()
    assert (own > skill["early_dem_x2"]).all() and (own > 0).all()
    assert (of_slurry["neighbours"] < of_slurry["early_dem_x2"]).all()
    sure = tables["uncertainty"].query("surrogate == 'neighbours'")
    sure = sure[sure.slurry.isin(test)]
    for level in (0.5, 0.9):
        covered = sure[abs(sure.level - level) < 1e-9].coverage
        lines.append(f"{level:.0%} intervals cover {covered.min():.1%} to {covered.max():.1%}")
    ranks = sure.rank_correlation
    lines.append(f"rank correlation of {ranks.min():.2f} to {ranks.max():.2f}")
    cost = tables["cost"]
    trained = cost[cost.stage == "run_slurry"].set_index("slurry").cpu_s[list(roles.index[roles == "train"])]
    (training_s,) = cost[(cost.stage == "train_surrogate") & (cost.surrogate == "neighbours")].cpu_s
    lines.append(f"{len(trained)} slurries, whose DEM took {trained.sum() / 60:.0f} min of CPU time")
    lines.append(f"training {training_s / 60:.0f} min")
    predicted = cost[(cost.stage == "predict_slurry") & (cost.surrogate == "neighbours")].set_index("slurry").cpu_s
    lines.append(f"{predicted['2']:.0f} s of CPU time for 1,775 particles and {predicted['6']:.0f} s for 8,874")
    lines.append(f"on average {ranks.mean():.2f}")
    enough = enough_steps(tables["relaxation"])
    assert not any(1000 in steps for steps in enough.values())
    assert {label for label, steps in enough.items() if 2000 in steps} == {
        *("neighbours", "driven_dem", "early_dem_x2", "affine_f24")
    }
    assert [label for label, steps in enough.items() if 3500 in steps] == ["affine_f24"]
    long = tables["relaxation"].query("steps == 3500 and not within_band and surrogate != 'affine_f24'")
    assert (long.density_error > 0).all() and long.surrogate.nunique() == 5
    covered = sure[abs(sure.level - 0.9) < 1e-9].coverage
    rdf = relaxed[(relaxed.surrogate == "neighbours") & (relaxed.quantity == "rdf_all") & relaxed.slurry.isin(test)]
    density = relaxed[(relaxed.surrogate == "neighbours") & (relaxed.quantity == "density_g_cm3")]
    density = density[density.slurry.isin(test)]
    in_band = (abs(density.value - density.dem_value) <= 2 * density.replica_sd).sum()
    for words, bar, found, met in (
        ("mean skill at reduced scale", "0.45", f"{own.mean():.2f}", own.mean() >= 0.45),
        ("largest MSE over that of the affine map", "1", f"{ratio.max():.2f}", ratio.max() <= 1),
        (
            "coverage of the 90 % intervals",
            "85 % to 95 %",
            f"{covered.min():.1%} to {covered.max():.1%}",
            covered.between(0.85, 0.95).all(),
        ),
        ("least rank correlation of spread and error", "0.3", f"{ranks.min():.2f}", ranks.min() >= 0.3),
        ("slurries with density in two sd of the replicas", "7 of 7", f"{in_band} of 7", in_band == 7),
        (
            "largest RDF difference, replicas' spreads",
            "2",
            f"{(rdf.value / rdf.replica_sd).max():.2f}",
            (rdf.value / rdf.replica_sd).max() <= 2,
        ),
        (
            "skill less that of `early_dem_x2`, which costs more",
            "0",
            f"{own.mean() - skill['early_dem_x2'].mean():.2f}",
            own.mean() > skill["early_dem_x2"].mean(),
        ),
    ):
        lines.append(bar_row(words, bar, found, met=met))
    return lines


def test_neighbours(root, reference):
    text = one_line(root / "docs" / "neighbours.md")
    page = (root / "docs" / "neighbours.md").read_text(encoding="utf-8")
    for line in neighbours_lines(reference / "small", page):
        assert line in text, line


def test_neighbours_in_the_readme(root, reference):
    text = one_line(root / "README.md")
    page = (root / "docs" / "neighbours.md").read_text(encoding="utf-8")
    assert neighbours_lines(reference / "small", page)[0] in text
    skill = read_table(reference / "small" / "tables" / "skill.csv")
    means = skill[skill.slurry.isin(list("1234567"))].groupby("surrogate").skill.mean()
    front = read_table(reference / "small" / "tables" / "front.csv")
    share = front[front.slurry.isin(list("1234567"))].groupby("surrogate").cost_share_of_full_dem.mean()
    for label in ("driven_dem", "affine_f24", "driven_dem_f24"):
        assert f"`{label}` {means[label]:.2f} at {share[label]:.1%}" in text
    assert share.driven_dem < share.neighbours
    assert (abs(share[["affine_f24", "driven_dem_f24"]] - share.neighbours) < 0.01).all()  # "for as much"
    assert f"at {share.neighbours:.1%} of the cost of a full DEM" in text
    assert means.affine_f24 > means.neighbours
    particles = pd.read_csv(reference / "small" / "tables" / "equilibrium.csv").query("role == 'train'").particles
    assert f"{len(particles)} slurries of at most {particles.max():,} particles" in text


def test_neighbours_as_they_were_tried(root, reference):
    text = (root / "docs" / "neighbours.md").read_text(encoding="utf-8")
    for row in pd.read_csv(reference / "neighbours" / "tried.csv", dtype=str).itertuples():
        number = row.number if pd.isna(row.more) else f"{row.number}, {row.more}"
        epochs = row.epochs if row.epochs == row.of_epochs else f"{row.epochs} of {row.of_epochs}"
        cells = [number, row.training_slurries, row.layers, row.vectors, row.cutoff_um, row.shift_frames, row.waypoints]
        assert f"| {' | '.join([*cells, epochs, row.ratio_V1, row.ratio_V2, row.cpu_s])} |" in text
    for name in ("faster", "deeper"):
        for row in pd.read_csv(reference / "neighbours" / f"{name}.csv", dtype=str).itertuples(index=False):
            *before, epochs, of_epochs, ratio_v1, ratio_v2, rank_v1, rank_v2, cpu_s = row
            epochs = epochs if epochs == of_epochs else f"{epochs} of {of_epochs}"
            assert f"| {' | '.join([*before, epochs, ratio_v1, ratio_v2, rank_v1, rank_v2, cpu_s])} |" in text
    for name in ("twins", "later", "driven", "corrected", "ranked", "epochs", "features"):
        for row in pd.read_csv(reference / "neighbours" / f"{name}.csv", dtype=str).itertuples(index=False):
            assert f"| {' | '.join('-' if pd.isna(cell) else cell for cell in row)} |" in text
    displaced = pd.read_csv(reference / "neighbours" / "displaced.csv", dtype={"displacement_um": str})
    for row in displaced.itertuples():
        assert f"| {row.displacement_um} | {row.mse_um2:.4f} | {row.mse_um2 / 0.0581:.0%} |".replace("%", " %") in text


def start_lines(folder: Path) -> list[str]:
    """How early a prediction can start: a row for each last input frame, means over the test slurries."""
    tables = {name: read_table(folder / "tables" / f"{name}.csv") for name in ("skill", "front", "structure_errors")}
    test = list("1234567")
    error = tables["skill"].pivot(index="slurry", columns="surrogate", values="mse_um2").loc[test]
    skill = tables["skill"].pivot(index="slurry", columns="surrogate", values="skill").loc[test].mean()
    of_all = tables["front"].pivot(index="slurry", columns="surrogate").loc[test]
    share = of_all.cost_share_of_full_dem.mean()
    relaxed = tables["structure_errors"].query("stage == 'relaxed' and quantity in ('density_g_cm3', 'rdf_all')")
    relaxed = relaxed[relaxed.slurry.isin(test)].set_index(["surrogate", "slurry"])
    density = relaxed[relaxed.quantity == "density_g_cm3"]
    density = abs(density.value / density.dem_value - 1).groupby("surrogate").mean()
    rdf = relaxed[relaxed.quantity == "rdf_all"]
    rdf = (rdf.value / rdf.replica_sd).groupby("surrogate").mean()
    rows = []
    for frame in (2, 4, 6, 10, 14, 18, 24):
        cells = [str(frame)]
        for name in ("affine", "neighbours"):
            label = name if frame == 10 else f"{name}_f{frame:02}"
            if label in skill:
                cells += [f"{error[label].mean():.3f}", f"{skill[label]:.2f}", f"{share[label]:.1%}"]
                cells += [f"{density[label]:.2%}", f"{rdf[label]:.2f}"]
            else:
                cells += ["-"] * 5
        rows.append(f"| {' | '.join(cells)} |")
        driven = "driven_dem" if frame == 10 else f"driven_dem_f{frame:02}"
        rows.append(f"| {frame} | {error[driven].mean():.3f} | {skill[driven]:.2f} | {share[driven]:.1%} |")
    for label in ("early_dem_x2", "early_dem_x10"):
        rows.append(f"`{label}` has a skill of {skill[label]:.2f} at {share[label]:.1%}")
    ratio = error.neighbours / error.affine
    rows.append(f"{ratio.mean():.2f} of the affine map's MSE on average, {ratio.min():.2f} to {ratio.max():.2f}")
    assert skill.neighbours_f18 > skill.early_dem_x2 and 1 < share.neighbours_f18 / share.early_dem_x2 < 1.05
    assert skill.affine_f24 > skill.neighbours_f18 and share.affine_f24 < share.neighbours_f18
    for frame in ("_f02", "_f04", "_f06", "", "_f18"):
        assert skill[f"affine{frame}"] < skill[f"neighbours{frame}"] < skill[f"driven_dem{frame}"]
        assert share[f"driven_dem{frame}"] < share[f"neighbours{frame}"]
    of_affine = [skill[name] for name in ("affine_f02", "affine_f04", "affine_f06", "affine", "affine_f14")]
    of_affine += [skill["affine_f18"], skill["affine_f24"]]
    frames = (2, 4, 6, 10, 18)
    of_network = [skill[name] for name in ("neighbours_f02", "neighbours_f04", "neighbours_f06", "neighbours")]
    as_late = np.interp([*of_network, skill["neighbours_f18"]], of_affine, (2, 4, 6, 10, 14, 18, 24))
    later = (as_late - frames).round()
    assert (later.min(), later.max()) == (5, 7)  # "five to seven frames later"
    own = tables["skill"].query("surrogate == 'neighbours' and slurry in @test").skill
    rows.append(f"a skill of {own.mean():.2f} on average, {own.min():.2f} at worst")
    for words, bar, found in (
        ("mean skill, eight slurries of the demo, one member", 0.28, own.mean()),
        ("worst skill, the same", 0.20, own.min()),
    ):
        rows.append(bar_row(words, f"{bar:.2f}", f"{found:.2f}", met=found >= bar))
    return rows


def test_how_early_a_prediction_can_start(root, reference):
    text = one_line(root / "docs" / "neighbours.md")
    for line in start_lines(reference / "start"):
        assert line in text, line
