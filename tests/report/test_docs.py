"""The documentation: its tables, conclusions, links and lines, against the reference results and the files."""

import json
import math
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

import evaluation_tables
import published_tables
import tables
import tape_tables
from configurations import ROOT
from reference_results import MISSING, REFERENCE, by_slurry, drying_changes, load, read_result, relaxed, slurries
from slurrycast.report import reference_article
from slurrycast.surrogates.checkpoint import has_settled

FOLDERS = (".", "config", "docs", "docs/notes", "results", "results/reference")
PAGES = sorted(page for folder in FOLDERS for page in (ROOT / folder).glob("*.md"))
NAMES = [str(page.relative_to(ROOT)) for page in PAGES]
PROJECT_PATH = re.compile(r"`((?:config|docs|envs|profiles|results/reference|scripts|tests|workflow)/[\w./-]+)`")


def heading_anchors(page: Path) -> set[str]:
    """Anchors that the headings of a page have on GitHub."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


def test_tables_are_those_of_the_reference_results():
    done = subprocess.run([sys.executable, ROOT / "docs" / "tables.py", "--check"], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


def test_every_table_has_a_place():
    shown = re.findall(r"<!-- table: (\w+) -->", "".join(page.read_text(encoding="utf-8") for page in PAGES))
    assert set(shown) == set(tables.TABLES)


def test_a_table_is_written_anew(monkeypatch):
    monkeypatch.setitem(tables.TABLES, "pairs", lambda: pd.DataFrame({"a": ["1", None], "b": ["x", "y"]}))
    page = "before\n<!-- table: pairs -->\n| of old |\n<!-- end of table -->\nafter\n"
    filled = tables.fill(page)
    assert filled == page.replace("| of old |\n", "| a | b |\n| --- | --- |\n| 1 | x |\n| - | y |\n")
    assert tables.fill(filled) == filled


@pytest.mark.parametrize(
    ("page", "said"),
    [
        ("<!-- table: absent -->\n<!-- end of table -->\n", "no table absent"),
        ("<!-- table: noise -->\n", "a marker of a table has no partner"),
        ("<!-- end of table -->\n", "a marker of a table has no partner"),
    ],
)
def test_bad_markers(page, said):
    with pytest.raises(ValueError, match=said):
        tables.fill(page)


@pytest.mark.parametrize("page", PAGES, ids=NAMES)
def test_links_and_paths_lead_somewhere_and_lines_are_short(page):
    text = page.read_text(encoding="utf-8")
    assert [line for line in text.splitlines() if len(line) > 120 and not line.startswith("|")] == []
    for link in re.findall(r"\]\(([^)\s]+)\)", text):
        path, _, anchor = link.partition("#")
        if "://" in path:
            continue
        target = page.parent / path if path else page
        assert target.exists(), link
        assert not anchor or anchor in heading_anchors(target), link
    missing = [path for path in PROJECT_PATH.findall(text) if not (ROOT / path).exists()]
    assert missing in ([], ["scripts/slurrycast/surrogates/drift.py"])  # the example of docs/surrogates.md


@pytest.mark.parametrize("page", PAGES, ids=NAMES)
def test_commands_that_run_jobs_name_their_cores(page):
    """Snakemake refuses to run here without; only the cluster's profile has a number of jobs."""
    text = page.read_text(encoding="utf-8").replace("\\\n", " ")
    commands = re.findall(r"^\S*snakemake +(.*)", "".join(re.findall(r"^```\n(.*?)^```", text, re.M | re.S)), re.M)
    free = re.compile(r"--cores|--workflow-profile|--dry-run|-n\b|--unlock")
    assert [command for command in commands if not free.search(command)] == []


def test_conclusions_at_reduced_scale():
    """What README.md and docs/evaluation.md conclude from their tables."""
    skill, errors = by_slurry("reduced", "skill", "skill"), relaxed("reduced")
    assert skill.vgg16.max() < skill.vgg16_box.min() < skill.vgg16_box.max() < 0
    assert skill[["linear", "linear_box"]].min(axis=None) > 0 and skill.linear_box.max() < skill.early_dem_x2.min()
    assert errors.density_error.max() < 0.01
    assert errors.rdf_ratio.max() < 1.25
    judged = read_result("reduced", "verdicts")
    differs = judged[judged.verdict == "differs"]
    assert list(zip(differs.surrogate, differs.measure, strict=True)) == [("early_dem_x2", "density_g_cm3")]
    assert by_slurry("reduced", "front", "cost_share_of_full_dem").direct.mean() < 1 / 12
    trained = evaluation_tables.training().set_index("surrogate")["training error (µm²)"].astype(float)
    assert trained["`linear`"] < trained["`vgg16`"]
    ablation = pd.read_csv(REFERENCE / "ablation" / "ablation.csv").set_index("surrogate")
    box, blind = ablation.loc["vgg16_box"], ablation.loc["vgg16_box_nobox"]
    assert box.best_val_loss_um2 < blind.best_val_loss_um2 < ablation.best_val_loss_um2["affine"]
    assert max(box.validation_skill, box.test_skill) < min(blind.validation_skill, blind.test_skill) < 0
    assert ablation.test_skill.idxmin() == "vgg16_box_absolute"
    timestep = pd.read_csv(REFERENCE / "timestep" / "timestep_summary.csv")
    assert set(timestep.accepted) == {"yes"}


def test_conclusions_on_longer_training():
    """What docs/evaluation.md concludes from the run whose networks were trained for longer."""
    errors = read_result("epochs", "coordinate_errors").query("axis == 'all'")
    mse_um2 = errors.pivot(index="slurry", columns="surrogate", values="mse_um2")
    assert len(mse_um2) >= 9 and (mse_um2.affine < mse_um2.vgg16).all()
    assert (mse_um2.vgg16 < mse_um2.vgg16_standardised).all()
    plain, standardised = (
        pd.read_csv(REFERENCE / "epochs" / "models" / label / "history.csv").set_index("epoch")
        for label in ("vgg16", "vgg16_standardised")
    )
    linear = json.loads((REFERENCE / "epochs" / "models" / "linear" / "model.json").read_text())
    assert standardised.loss.min() < linear["training_mse_um2"] < plain.loss.min()
    assert (len(plain), plain.val_loss.idxmin(), len(standardised)) == (121, 53, 121)
    test, affine = plain.test_slurries_loss, mse_um2.affine[slurries("epochs", "test")].mean()
    assert round(1 - test[100] / test[32], 2) == 0.05 and round(test[100] / affine - 1, 2) == 0.23
    assert plain.loss[121] == pytest.approx(linear["affine_training_mse_um2"], rel=0.01)
    assert round(1 - linear["training_mse_um2"] / linear["affine_training_mse_um2"], 2) == 0.11
    assert round(plain.val_loss.pct_change().abs().median(), 2) == 0.06
    assert list(standardised.index[standardised.loss < linear["training_mse_um2"]]) == [*range(113, 122)]
    with (REFERENCE / "epochs" / "config.yaml").open() as file:
        settings = yaml.safe_load(file)["surrogate"]["vgg16"]
    for history, end in ((plain, 153), (standardised, 160)):  # if the loss does not improve any more
        losses = list(history.val_loss)
        further = [losses + [losses[-1]] * (epochs - len(losses)) for epochs in (end - 1, end)]
        assert [has_settled(of, settings) for of in (losses, *further)] == [False, False, True]


def states(run: str) -> pd.DataFrame:
    """Of each slurry at the end of its DEM."""
    return read_result(run, "equilibrium").set_index("slurry")


def test_conclusions_at_the_published_size():
    """What README.md and docs/published.md conclude from their tables."""
    errors = read_result("published", "coordinate_errors").query("axis == 'all'")
    mse_um2 = errors.pivot(index="slurry", columns="surrogate", values="mse_um2").loc[slurries("published", "test")]
    assert len(mse_um2) == 7 and (mse_um2.vgg16 > mse_um2.affine).all() and (mse_um2.affine > mse_um2.linear).all()
    article = pd.Series({id: error.mse_um2 for id, error in reference_article.COORDINATE_ERRORS.items()})
    assert article.min() < mse_um2.affine.min() < mse_um2.affine.max() < article.max()
    assert (article[["2", "3"]] < mse_um2.linear[["2", "3"]]).all()
    assert (article[["4", "5", "6"]] / mse_um2.linear[["4", "5", "6"]]).between(1.9, 2.6).all()
    theirs = {id: structure.density_g_cm3 for id, structure in reference_article.DEM_STRUCTURE.items()}
    denser = states("published").density_g_cm3[list(theirs)] / pd.Series(theirs) - 1
    assert denser.between(0.003, 0.007).all()
    assert relaxed("published").density_error.max() < 0.005
    skill, cost = by_slurry("published", "skill", "skill"), by_slurry("published", "front", "cost_share_of_full_dem")
    assert skill.linear.max() < skill.driven_dem.min() and skill.driven_dem.max() < skill.affine_f24.min()
    assert cost.driven_dem.mean() < cost.vgg16.mean() < cost.affine_f24.mean()
    assert round(skill.neighbours.mean(), 2) == round(by_slurry("small", "skill", "skill").neighbours.mean(), 2) == 0.53
    assert (round(cost.neighbours.mean(), 2), round(cost.driven_dem.mean(), 2)) == (0.19, 0.14)
    of_largest = [round(table[name]["6"], 2) for name in ("neighbours", "driven_dem") for table in (cost, skill)]
    assert of_largest == [0.16, 0.52, 0.13, 0.51]


def test_conclusions_on_the_training_at_the_published_size():
    """README.md and docs/published.md, of the published network."""
    trained = published_tables.published_training().set_index("surrogate")["training error (µm²)"].astype(float)
    assert trained["`linear`"] < trained["`affine`"] < trained["`vgg16`"]
    history = pd.read_csv(REFERENCE / "published" / "models" / "vgg16" / "history.csv").set_index("epoch")
    assert (len(history), history.val_loss.idxmin()) == (100, 46)
    assert round(1 - history.loss.loc[92:].mean() / history.loss.loc[54:62].mean(), 2) == 0.03


def test_conclusions_on_structures_at_the_published_size():
    """README.md and docs/published.md, after relaxation."""
    judged = read_result("published", "verdicts")
    changes = published_tables.published_differences().set_index("surrogate").contacts.str.rstrip("% *").astype(float)
    assert changes.between(-0.6, -0.3).all()
    loose = ["direct", "persistence"]
    dense = judged[judged.measure == "density_g_cm3"].set_index("surrogate").mean_in_sd
    assert (dense.drop(loose) > 2).all() and dense[loose].abs().max() < 1
    verdict = judged.pivot(index="surrogate", columns="measure", values="verdict") == "differs"
    assert len(verdict) == 9 and verdict.coordination_all.sum() == verdict.share_below_4_contacts.sum() == 7
    assert (verdict.density_g_cm3.drop(loose).sum(), len(dense.drop(loose))) == (5, 7)
    assert list(verdict.index[verdict["coordination_BDPD-BDPD"]]) == ["linear", "vgg16"]
    counts = verdict.sum(axis=1)
    assert (counts.min(), counts.max()) == (1, 6)
    scatter = [
        read_result(run, "noise").query(f"slurry == '{slurry}' and quantity == 'coordination_BDPD-BDPD'").iloc[0]
        for run, slurry in (("published", "2"), ("reduced", "6"))
    ]
    expected = scatter[1].sd * (scatter[1].particles / scatter[0].particles) ** 0.5
    assert 0.2 < scatter[0].sd / expected < 0.3
    errors = read_result("reduced", "structure_errors").query("stage == 'relaxed' and quantity == 'density_g_cm3'")
    smaller = errors.pivot(index="slurry", columns="surrogate", values="value").loc[slurries("reduced", "test")]
    denser = smaller.direct_box / smaller.direct - 1
    assert (denser > 0).all() and round(100 * denser.mean(), 2) == 0.25
    direct = published_tables.published_differences().set_index("surrogate").loc["`direct`"]
    assert direct["density"] == "+0.05%" and direct["contacts"] == "-0.49% *"


def test_conclusions_on_the_time_step_at_the_published_size():
    """README.md and docs/published.md."""
    rows = pd.read_csv(REFERENCE / "timestep" / "published.csv").set_index("timestep_us")
    small, large = rows.loc[1e-4], rows.loc[2e-3]
    of_npt = large[large.barostat == "npt"]
    for measure in ("density_g_cm3", "coordination_all", "share_below_4_contacts", "overlap_mean"):
        assert of_npt[measure].min() < small[measure] < of_npt[measure].max(), measure
    assert (round(small.rdf_difference, 4), *large.rdf_difference.agg(["min", "max"]).round(4)) == (
        0.006,
        0.0054,
        0.0057,
    )
    noise = read_result("published", "noise").query("slurry == '2' and quantity == 'rdf_all'").iloc[0]
    assert round(noise.sd, 4) == 0.0004
    assert small.simulated_us == 140 and of_npt.simulated_us.eq(140).all()
    assert [*of_npt.time_to_equilibrium_us, small.time_to_equilibrium_us] == [110, 119.5, 111, 100]
    further_h = (reference_article.STEPS - 1_400_000) * small.last_cpu_ms_per_step / 3.6e6
    assert (round(small.cpu_h, 1), round(small.cpu_h + further_h, 1)) == (1.1, 5.3)
    assert reference_article.FULL_DEM_MIN * reference_article.RANKS / 60 == 574


def test_conclusions_on_rest_and_cost_at_the_published_size():
    """docs/published.md."""
    rest = states("published")
    assert len(rest) == 16 and rest.time_to_equilibrium_us.max() < 100
    (exponent, _), covariance = np.polyfit(np.log(rest.particles), np.log(rest.time_to_equilibrium_us), 1, cov=True)
    assert (round(exponent, 2), round(covariance[0, 0] ** 0.5, 2)) == (-0.04, 0.05)
    assert [round(100 * rest.density_drift[id], 2) for id in ("T2", "T8")] == [0.06, 0.03]
    assert rest.density_drift.abs().drop(["T2", "T8"]).max() < 1e-4
    stages = published_tables.published_stages().set_index("stage")
    assert stages.exponent.dropna().astype(float).idxmax() == "`run_slurry`"
    cost = read_result("published", "cost")
    assert round(cost.cpu_s.sum() / 3600, 1) == 7.3
    assert round(cost[cost.stage == "train_surrogate"].cpu_s.sum() / 3600, 1) == 4.3
    full = cost[(cost.stage == "run_slurry") & (cost.steps == cost.steps.max())]
    assert full.wall_s.sum() / full.cpu_s.sum() == pytest.approx(1.02, abs=0.005)


def test_conclusions_on_neighbours():
    """What README.md and docs/neighbours.md conclude from their tables."""
    skill, cost = by_slurry("small", "skill", "skill"), by_slurry("small", "front", "cost_share_of_full_dem")
    assert (skill.neighbours > 0).all()
    means, shares = skill.mean(), cost.mean()
    assert abs(means.driven_dem - means.neighbours) < 0.02 and means.neighbours < means.affine_f24
    assert 0.5 < shares.driven_dem / shares.neighbours < 0.6
    assert shares.affine_f24 < shares.neighbours
    judged = read_result("small", "verdicts")
    differs = judged[judged.verdict == "differs"]
    assert list(zip(differs.surrogate, differs.measure, strict=True)) == [
        ("neighbours", "density_g_cm3"),
        ("affine_f24", "density_g_cm3"),
    ]
    early, paid = (
        by_slurry("start", table, column).mean()
        for table, column in (("skill", "skill"), ("front", "cost_share_of_full_dem"))
    )
    for frame in ("_f02", "_f06", "", "_f18"):
        assert early[f"affine{frame}"] < early[f"neighbours{frame}"] < early[f"driven_dem{frame}"]
        assert paid[f"driven_dem{frame}"] < paid[f"neighbours{frame}"]
    judged = read_result("start", "verdicts")
    assert not (judged.verdict == "differs").any()
    density = judged[judged.measure == "density_g_cm3"].set_index("surrogate").verdict
    assert list(density.index[density != "equivalent"]) == ["neighbours_f18", "driven_dem_f18"]
    assert (relaxed("start").rdf_ratio.groupby("surrogate").mean() < 1.1).all()


def test_conclusions_on_the_drying():
    """What docs/tape.md concludes from its table; shares in points."""
    changes = drying_changes()
    void = 100 * changes.void
    bound = void["mean"].abs() + 2 * void["sem"]
    in_time = ["steps_per_stage", "timestep_factor", "rest_steps"]
    assert bound[bound.index.isin(in_time, level="setting")].max() < 0.5
    stages = void.xs("stages", level="setting")
    assert (stages["mean"].abs() < 2 * stages["sem"]).all() and 0.6 < bound.xs("stages", level="setting").max() < 0.7
    small, large = void.xs("none", level="setting").to_numpy()
    assert abs(small[0] - large[0]) + 2 * math.hypot(small[1], large[1]) < 1
    runs = pd.read_csv(REFERENCE / "drying" / "settings.csv")
    shipped = runs[runs.setting == "none"].groupby("particles")
    assert (100 * shipped.void.std()).round(1).tolist() == [0.4, 0.2]
    small_sd = shipped.green_density_g_cm3.std()[600]
    found = runs[runs.setting == "friction"].groupby("value").mean(numeric_only=True)
    assert [round(100 * found.void[0.015]), round(small[0]), round(100 * found.void[12.5])] == [34, 40, 43]
    assert found.green_density_g_cm3.round(2).tolist() == [3.29, 2.85]
    assert (100 * found.ceramic_share).round().tolist() == [49, 42]
    # of one small tape, in decades of the friction above the shipped one
    decades = small_sd / abs(found.green_density_g_cm3[12.5] - shipped.green_density_g_cm3.mean()[600]) * math.log10(25)
    assert 10**decades == pytest.approx(1.5, abs=0.05)
    attraction = void.xs("attraction_factor", level="setting").droplevel("particles")
    assert abs(attraction["mean"][0.5]) < 2 * attraction["sem"][0.5] and round(attraction["mean"][10]) == -2
    assert (attraction["mean"] < -2 * attraction["sem"]).tolist() == [False, True, True]
    contacts = changes.coordination["mean"].drop(["none", "friction"], level="setting")
    assert contacts.between(-0.005, 0.12).all()
    drying = load("config")["drying"]
    wet_g_cm3 = load("config")["formulation"]["phases"][drying["phase"]]["density_g_cm3"]
    solvent_pg = drying["solvent_mass_fraction"] * wet_g_cm3
    solvent_um3 = 1 - (wet_g_cm3 - solvent_pg) / drying["organics_density_g_cm3"]
    assert f"{solvent_pg / solvent_um3:.2f} g/cm³ as shipped" in (ROOT / "docs" / "tape.md").read_text(encoding="utf-8")
    for _, setting, value in changes.index:
        assert setting == "none" or (drying | drying["force_field"])[setting] != value


def test_conclusions_on_tapes():
    """What README.md and docs/tape.md conclude from their tables."""
    judged = read_result("tape", "tape_verdicts")
    assert not (judged.verdict == "differs").any()
    assert set(judged.verdict[judged.measure == "shrinkage"]) == {"not resolved"}
    errors = read_result("tape", "tape_errors")
    errors = errors.rename(columns={"surrogate": "source"})  # as in tables that are older than their replica_sd
    tested = errors[errors.slurry.isin(slurries("reduced", "test")) & (errors.quantity == "shrinkage")]
    tested = tested[tested.source != "dem"]
    points = 100 * (tested.value - tested.dem_value).groupby(tested.source).mean()
    assert (points.min().round(1), points.max().round(1)) == (-0.3, -0.2)
    cost = tape_tables.tape_cost().drop(columns="particles")
    cost = cost[cost["full DEM"] != MISSING].astype(float)  # without the one from its recipe alone
    assert len(cost) == 5 and (cost.drying > cost["`direct`"]).all()
    share = cost.drop(columns="full DEM").sum(axis=1) / cost["full DEM"]
    assert (share.min().round(2), share.max().round(2)) == (0.29, 0.32)


def test_conclusions_on_many_recipes():
    """What README.md and docs/explore.md conclude from the exploration."""
    tables = {
        name: read_result("explore", f"explore_{name}") for name in ("indices", "models", "confirmation", "costs")
    }
    most = tables["indices"].pivot(index="property", columns="input", values="total").T
    for name in ("green_density", "shrinkage", "share_ceramic_union"):
        assert list(most[name].nlargest(2).index) == ["mass_fraction_BDPD", "solvent_mass_fraction"]
    for name in ("pore_size_mean", "tortuosity_z_0.1um", "contacts_NiO-8YSZ"):
        assert set(most[name].nlargest(2).index) == {"size_factor_NiO", "size_factor_8YSZ"}
    ratios = tables["models"].set_index("property").loo_over_replica_sd
    above = ratios[ratios > 2]
    assert set(above.index) == {"shrinkage", "tortuosity_z_0.1um"} and above.max() < 2.2
    assert tables["models"].coverage_90_calibrated.between(0.80, 0.97).all()
    confirmation = tables["confirmation"]
    outside = confirmation[confirmation.within_band == "no"]
    counted = confirmation[confirmation.band < 1]  # of percolation, it is wider than all values
    assert set(confirmation.property) - set(counted.property) == {"percolation_NiO_z"}
    assert (len(counted), counted.slurry.nunique()) == (21, 3)
    assert list(outside.property) == ["contacts_NiO-8YSZ"]
    assert round((tables["costs"].cpu_s * tables["costs"].jobs).sum() / 60) == 12
    costs = tables["costs"].set_index(["stage", "surrogate"]).cpu_s
    one = [costs[stage, "direct"] for stage in ("dry_slurry", "relax_slurry", "measure_microstructure")]
    assert [round(seconds, 1) for seconds in one] == [5.5, 1.9, 1.3] and round(costs["run_slurry", "-"]) == 19
    plans = pd.read_csv(REFERENCE / "planning" / "plans.csv").groupby("points").median()
    assert (plans.jobs[1000], round(plans.cpu_s[1000])) == (6068, 26)
    noise = read_result("explore", "explore_noise").set_index("property")
    assert noise.replica_sd["percolation_NiO_z"] > 0.8 * noise.sd["percolation_NiO_z"]


def test_conclusions_on_other_recipes():
    """What README.md and docs/transfer.md conclude."""
    recipes = read_result("transfer", "recipes").set_index("quantity")
    skill = recipes.loc["skill"].pivot(index="recipe", columns="surrogate", values="mean")
    trained = ["default", "more_nio", "more_8ysz"]
    least = skill.neighbours[trained].min()
    assert skill.neighbours[["more_bdpd", "less_bdpd"]].min() > least > skill.neighbours["coarse_nio"] > 0.8 * least
    assert (skill.vgg16 < 0).all() and (skill.driven_dem > skill.neighbours).all()
    of_model = read_result("transfer", "skill").set_index(["surrogate", "slurry"]).skill
    choices = pd.read_csv(REFERENCE / "transfer" / "choices.csv")
    for (surrogate, _), tried in choices.groupby(["surrogate", "start"]):
        assert tried.skill.max() < of_model[surrogate, "V2"]
    for quantity in ("density_g_cm3", "tape_green_density"):
        assert (recipes.loc[quantity].replica_sds < 2).all()
    contacts = recipes.loc["coordination_all"]
    assert round(contacts["mean"].abs().max(), 2) == 0.11 and round(contacts.replica_sds.max()) == 5
    coarse = recipes[recipes.recipe == "coarse_nio"].loc["coordination_all", "mean"]
    assert coarse.between(-0.115, -0.08).all() and len(coarse) == 5
    tuning = read_result("transfer", "tuning").set_index(["surrogate", "start", "slurries"]).skill.neighbours
    tuned, scratch = tuning.fine_tuned, tuning.from_scratch
    assert round(tuned.max() - tuned[0], 2) == 0.03
    assert (scratch < tuned[scratch.index]).all()
    scratch = choices[choices.start == "from_scratch"]
    longest = scratch.loc[scratch.groupby("surrogate").epochs.idxmax()].set_index("surrogate")
    assert (longest.skill == scratch.groupby("surrogate").skill.max()).all()
    counts = read_result("transfer", "equilibrium").set_index("slurry").particles
    assert (counts.min(), counts.max()) == (458, 1258)


def test_conclusions_on_a_slurry_of_the_published_size():
    """What README.md and docs/tape.md conclude from its cost."""
    wall_s = pd.read_csv(REFERENCE / "recipe" / "cost.csv").set_index("stage").wall_s
    assert wall_s["snakemake"] < 40
    assert (wall_s["snakemake"] + wall_s["snakemake tapes"]) / 60 == pytest.approx(7.5, abs=0.1)


def test_the_affine_error_of_one_slurry_can_be_computed_anew():
    """From its last input frame and the packing fraction of the training slurries alone, by the code as it is."""
    from slurrycast.analysis.errors import coordinate_errors
    from slurrycast.data.final_box import scale_to_packing_fraction
    from slurrycast.data.frames import read_frames
    from slurrycast.dem.recipe import sphere_volume_um3
    from slurrycast.surrogates.affine import Affine
    from slurrycast.surrogates.prediction import PredictionInput

    folder = REFERENCE / "reduced"
    packing_fraction = json.loads((folder / "packing_fraction.json").read_text())["mean"]
    with read_frames(folder / "frames" / "2.h5") as store:
        last, target = (store.frame(int(k)) for k in store.frame_numbers)
        volume_um3 = float(sphere_volume_um3(2 * store.particles.radius_um).sum())
        edges_um = last.edges_um * scale_to_packing_fraction(packing_fraction, volume_um3, last.edges_um)
        prediction = Affine().predict(PredictionInput("2", store.particles, (last,), edges_um), None, {})
    error = coordinate_errors(target.position_um, prediction.position_um)["all"].mse_um2
    skill = read_result("reduced", "skill").set_index(["surrogate", "slurry"])
    assert error == pytest.approx(skill.mse_um2["affine", "2"], rel=1e-6)
