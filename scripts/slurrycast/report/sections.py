"""The pages of a run: which sections they have, in their order, and what each section's template gets."""

from slurrycast.evaluation.noise import BAND_SDS
from slurrycast.evaluation.verdicts import RDF_BAND
from slurrycast.report import (
    comparison_statistics,
    evaluation_statistics,
    explore_statistics,
    statistics,
    tape_statistics,
    verdict_statistics,
)
from slurrycast.report.evaluation_results import Evaluation
from slurrycast.report.page import page_html
from slurrycast.report.results import Results


def report_html(results: Results) -> str:
    """The report: all tables and figures of a run, beside the numbers of the reference article."""
    rdfs = comparison_statistics.rdfs(results)
    gains, tape = statistics.gains_over_affine(results), tape_statistics.tapes(results)
    sections = {
        "summary": statistics.key_results(results),
        "gains": {"gains": gains} if gains else None,
        "comparison": {
            "densities": comparison_statistics.densities(results),
            "coordinates": comparison_statistics.coordinates(results),
            "pictures": comparison_statistics.pictures(results, results.compared),
        }
        if results.compared
        else None,
        "tape": tape,
        "new_slurries": comparison_statistics.new_slurries(results),
        "relaxation": comparison_statistics.relaxation_ends(results),
        "costs": comparison_statistics.costs(results),
        "dem_runs": {} if results.runs else None,
        "surrogates": statistics.surrogates(results),
        "training_range": statistics.training_range(results),
        "settings": statistics.settings(results),
        "workflow": {},
        "provenance": comparison_statistics.provenance(results),
    }
    shared = {
        **vars(results),
        **{role: results.slurries(role) for role in statistics.ROLE_NAMES},
        "compared": results.compared,
        "particles": sum(results.particles.values()),
        "rdfs": rdfs,
        "tape": tape,
        "lead": next(iter(comparison_statistics.pictures(results, [*results.test, *results.roles])), None),
        "dem": statistics.dem_runs(results),
        **statistics.notices(results),
    }
    return page_html("report", sections, shared)


def evaluation_html(evaluation: Evaluation) -> str:
    """The evaluation: surrogates beside cheap alternatives and the DEM's noise."""
    sections = {
        "verdicts": verdict_statistics.noise_verdicts(evaluation),
        "tape": tape_statistics.tape_verdicts(evaluation),
        "networks": verdict_statistics.network_verdicts(evaluation) if evaluation.networks else None,
        "skill": evaluation_statistics.skill(evaluation),
        "noise": evaluation_statistics.noise(evaluation),
        "structure": evaluation_statistics.structure(evaluation),
        "front": evaluation_statistics.front(evaluation),
        "equal_cost": evaluation_statistics.equal_cost(evaluation),
        "cost": evaluation_statistics.cost(evaluation),
        "ablation": evaluation_statistics.ablation(evaluation),
        "relaxation": evaluation_statistics.relaxation(evaluation),
        "uncertainty": evaluation_statistics.uncertainty(evaluation),
    }
    shared = {
        **vars(evaluation),
        "missing": sorted({*evaluation.networks} - {*evaluation.structure_errors.surrogate}),
        "lead": next((stem for stem in evaluation.figures if stem.startswith("slurry_")), None),
        "test": evaluation.test,
        "band_sds": BAND_SDS,
        "rdf_band": RDF_BAND,
    }
    return page_html("evaluation", sections, shared)


def explore_html(exploration: explore_statistics.Exploration) -> str:
    """The exploration: maps of the tapes' properties over the recipes."""
    shared = {**vars(exploration), "goals": explore_statistics, "different": exploration.different}
    return page_html("explore", explore_statistics.sections(exploration), shared)
