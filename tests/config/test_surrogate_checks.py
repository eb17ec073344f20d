"""Surrogates in the configuration: trained models, and what follows for one label."""

from collections.abc import Callable
from pathlib import Path

import pytest

from configurations import HEADER
from slurrycast.config.composition import wet_composition
from slurrycast.config.configuration import check, checked_slurries
from slurrycast.config.formulations import wet_recipes
from slurrycast.config.label_settings import first_frame_seen, training_needed, without_training
from slurrycast.config.model_checks import model_warnings, recipes_trained_on, tuning_tests
from slurrycast.config.physics import physics
from slurrycast.config.slurry_table import Slurry
from slurrycast.runtime.files import checksum
from slurrycast.surrogates import vgg16
from slurrycast.surrogates.trained_on import recipe_of, write_trained_on
from stored_models import write_layers, write_model

pytestmark = pytest.mark.usefixtures("in_empty_project")


@pytest.fixture
def with_model(in_empty_project, config) -> dict:
    """The shipped configuration with a trained model, without evaluation and pictures of surrogates."""
    write_model("model.keras", "vgg16")
    config["surrogate"]["models"] = {"vgg16": "model.keras"}
    config["report"]["pictures"] = config["evaluation"]["surrogates"] = []
    return config


def test_training_slurries_are_not_needed_where_a_model_is_given(config):
    Path("new.tsv").write_text(HEADER + "N1\tnew\t2\t1\t7\n")
    write_model("model.keras", "vgg16")
    config["slurries"], config["surrogate"]["models"] = "new.tsv", {"vgg16": "model.keras"}
    assert check(config) == []
    config["surrogate"]["names"] = []
    assert check(config) == ["surrogate.names = []: must be a list of labels of surrogates, each once"]


@pytest.mark.parametrize(
    ("names", "needed"), [(["direct"], []), (["direct", "affine"], ["affine"]), (["vgg16"], ["vgg16"])]
)
def test_training_slurries_are_needed_by_what_learns_from_them(config, names, needed):
    Path("new.tsv").write_text(HEADER + "N1\tnew\t2\t1\t7\n")
    config |= {"slurries": "new.tsv", "report": {"pictures": []}}
    config["surrogate"]["names"], config["evaluation"]["surrogates"] = names, []
    ask = "new.tsv: no slurry of role train: must be at least one for {}, or surrogate.models"
    assert check(config) == [ask.format(name) for name in needed]


def test_a_model_that_the_run_itself_writes_is_refused(config):
    """Its rule would delete it before it copies it."""
    model = Path("results/demo/models/vgg16/model.keras")
    model.parent.mkdir(parents=True)
    write_model(model, "vgg16")
    config["surrogate"]["models"] = {"vgg16": f"./{model}"}
    assert check(config) == [
        'surrogate.models.vgg16 = "./results/demo/models/vgg16/model.keras": must lie outside results/demo/models, '
        "which this run writes: choose another run.name"
    ]
    config["run"]["name"] = "new_slurry"
    assert check(config) == []


@pytest.mark.parametrize(
    ("names", "networks"),
    [(["linear"], "none"), (["affine"], "none"), (["vgg16_box", "neighbours"], "vgg16_box, neighbours")],
)
def test_a_model_is_of_a_network_of_the_run(with_model, names, networks):
    with_model["surrogate"]["names"] = names
    (line,) = check(with_model)
    must_be = f"must be of a network in surrogate.names or evaluation.surrogates, which are: {networks}"
    assert line == f'surrogate.models.vgg16 = "model.keras": {must_be}'


@pytest.mark.parametrize(
    ("names", "adopted", "needed"),
    [
        (["affine", "vgg16"], ["vgg16"], False),
        (["vgg16", "neighbours"], ["vgg16", "neighbours"], False),
        (["vgg16", "neighbours"], ["neighbours"], True),
        (["affine", "linear"], ["neighbours"], True),  # a network of the evaluation
        (["vgg16"], ["neighbours"], True),
        (["vgg16"], [], True),
    ],
)
def test_training_slurries_are_run_unless_all_networks_of_the_main_job_are_given(with_model, names, adopted, needed):
    further = [label for label in adopted if label not in names]
    for label in adopted:
        write_model(f"{label}.keras", label)
    with_model["evaluation"]["surrogates"] = further
    with_model["surrogate"] |= {
        "names": names,
        "models": {label: f"{label}.keras" for label in adopted},
        "packing_fraction": 0.66,
    }
    assert check(with_model) == []
    assert training_needed(with_model) == needed


@pytest.mark.parametrize("value", ["model.keras", None])
def test_the_former_key_of_a_model_says_what_to_write(config, value):
    config["surrogate"]["model"] = value
    assert check(config) == [
        "surrogate.model: unknown key: surrogate.models has taken its place, such as {vgg16: PATH}; {} for null"
    ]


def test_a_model_without_its_box_needs_the_packing_fraction(with_model):
    write_model("model.keras", "vgg16_box")
    with_model["surrogate"] |= {"names": ["affine", "vgg16_box"], "models": {"vgg16_box": "model.keras"}}
    (line,) = check(with_model)
    assert line.startswith("surrogate.packing_fraction = null: must be a number for vgg16_box with surrogate.models")
    with_model["surrogate"]["packing_fraction"] = 0.66
    assert check(with_model) == []


@pytest.mark.parametrize(
    ("packing_fraction", "expected"),
    [
        (None, ["direct", "persistence", "vgg16", "early_dem_x2"]),
        (0.66, ["direct", "persistence", "affine", "vgg16", "direct_box", "driven_dem", "early_dem_x2"]),
    ],
)
def test_what_needs_no_training_slurries(config, packing_fraction, expected):
    """driven_dem goes on with the DEM as early_dem does, but the box has to come from somewhere."""
    config["surrogate"]["packing_fraction"] = packing_fraction
    config["surrogate"]["models"] = {"vgg16": "model.keras"}
    labels = [*config["surrogate"]["names"], "direct_box", "vgg16_box", "driven_dem", "early_dem_x2"]
    assert [label for label in labels if without_training(config, label)] == expected


@pytest.fixture
def trained_elsewhere(config) -> Callable[..., None]:
    """Let a run use a model that was trained on its recipe but for changes of the description."""

    def write(**changes: object) -> None:
        write_model("model.keras", "vgg16")
        recipe = recipe_of(physics(wet_composition(config), Slurry("T1", "train", 1, 1, 1)))
        known = {"surrogate": "vgg16", "slurries": ["T1"], "range": {}, "recipes": [recipe]}
        known |= {"model_sha256": checksum("model.keras")}
        known |= {"input_frames": [7, 8, 9, 10], "target_frame": 120, "phases": ["BDPD", "NiO", "8YSZ"]} | changes
        write_trained_on("trained_on.json", known)
        config["surrogate"]["models"] = {"vgg16": "model.keras"}

    return write


MODEL = 'surrogate.models.vgg16 = "model.keras": '


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({}, None),
        ({"input_frames": [6, 7, 8, 9]}, "was trained with input frames [6, 7, 8, 9], needed is [7, 8, 9, 10]"),
        ({"target_frame": 60}, "was trained with target frame 60, needed is 120"),
        ({"phases": ["NiO", "BDPD"]}, "was trained without a phase 8YSZ: must know all phases"),
        ({"phases": ["NiO", "BDPD", "8YSZ", "Ag"]}, None),
        ({"model_sha256": "0"}, "trained_on.json: is of another model than model.keras beside it"),
        ({"surrogate": "vgg16_relative"}, 'was trained with surrogate "vgg16_relative", needed is "vgg16"'),
    ],
)
def test_a_model_of_other_frames_or_another_surrogate_is_refused(config, trained_elsewhere, changes, line):
    trained_elsewhere(**changes)
    assert check(config) == ([] if line is None else [MODEL + line])


def test_a_model_of_another_recipe_is_refused_unless_asked_for(config, trained_elsewhere):
    trained_elsewhere()
    slurries = checked_slurries(config)
    assert list(model_warnings(config, slurries)) == []
    config["force_field"]["granular_hertz"]["friction"] = 0.02
    config["formulation"]["phases"]["NiO"]["density_g_cm3"] = 6.6
    differing = "was trained with phases.NiO.density_g_cm3 = 6.67, slurry 1 has 6.6 (and 1 more)"
    assert check(config) == [f"{MODEL}{differing}: must be the same, or set surrogate.other_recipe: warn"]
    config["surrogate"]["other_recipe"] = "warn"
    assert check(config) == []
    (line,) = model_warnings(config, slurries)
    assert line.startswith(f"model.keras: {differing}; another recipe too: slurries ")


def test_a_model_that_says_nothing_is_used_with_a_warning(config, trained_elsewhere):
    trained_elsewhere()
    for content in (None, "{}"):
        Path("trained_on.json").unlink() if content is None else Path("trained_on.json").write_text(content)
        assert check(config) == []
        assert list(model_warnings(config, checked_slurries(config))) == [
            "model.keras: no trained_on.json beside it: whether vgg16 was trained on this recipe, scale and input "
            "frames cannot be checked"
        ]
    for content, says in (("{", "not readable JSON"), ('{"slurries": []}', "does not say what a model was trained on")):
        Path("trained_on.json").write_text(content)
        (line,) = check(config)
        assert line.startswith(f"{MODEL}trained_on.json: {says}")


@pytest.mark.parametrize(
    ("label", "shapes", "problem"),
    [
        ("vgg16", {"frames": (3, 6)}, "takes inputs of shape 3 x 6, vgg16 needs 4 x 6"),
        ("vgg16", {"frames": (4, 9)}, "takes inputs of shape 4 x 9, vgg16 needs 4 x 6"),
        ("vgg16_box", {"frames": (4, 6)}, "takes inputs of shape 4 x 6, vgg16_box needs 4 x 9"),
        ("vgg16_box_nobox", {"frames": (4, 6)}, None),
        ("vgg16_box_xu", {"frames": (4, 6)}, "takes inputs of shape 4 x 6, vgg16_box_xu needs 4 x 9"),
        ("neighbours", {}, None),
        ("neighbours", {"past": (3, 2)}, "takes inputs of shape 3 x 2, neighbours needs 3 x 3"),
        ("vgg16", None, "model.keras is no Keras model"),
    ],
)
def test_a_model_has_to_take_what_its_surrogate_sees(config, label, shapes, problem):
    if shapes is None:
        Path("model.keras").write_text("weights")
    else:
        write_model("model.keras", label, **shapes)
    config["evaluation"]["surrogates"], config["report"]["pictures"] = [], []
    config["surrogate"] |= {"names": ["affine", label], "models": {label: "model.keras"}, "packing_fraction": 0.66}
    what = f'surrogate.models.{label} = "model.keras": '
    lines = check(config)
    assert len(lines) == (problem is not None) and all(line.startswith(what + problem) for line in lines)


@pytest.mark.parametrize("ensemble", [[], [("Ensemble", {"shape": {}})], [("Ensemble", {"shape": None})]])
def test_a_network_of_another_kind_or_an_earlier_version_is_refused(with_model, ensemble):
    """Though its inputs fit."""
    write_layers("model.keras", [("InputLayer", {"name": "past", "batch_shape": [None, 3, 3]}), *ensemble])
    with_model["surrogate"] |= {"names": ["neighbours"], "models": {"neighbours": "model.keras"}}
    with_model["surrogate"]["packing_fraction"] = 0.66
    says = "is no model of neighbours, or one of an earlier version: train it again"
    assert check(with_model) == [f'surrogate.models.neighbours = "model.keras": {says}']


def test_recipes_that_a_model_was_trained_on(config, trained_elsewhere):
    """Those of the slurries to predict, whatever this run trains on."""
    coarse = {"force_field": {"granular_hertz": {"friction": 0.02}}}
    config["formulations"] = {"coarse": config["formulations"].get("coarse", {}) | coarse}
    slurries = [Slurry("T", "train", 1, 1, 1), Slurry("A", "test", 1, 1, 2), Slurry("B", "test", 1, 1, 3, "coarse")]
    recipes = [recipe_of(physics(wet_recipes(config), slurry)) for slurry in slurries[1:]]
    for known, names in ((recipes, ["", "coarse"]), (recipes[1:], ["coarse"]), ([{}], [])):
        trained_elsewhere(recipes=known)
        assert recipes_trained_on(config, slurries, "model.keras") == names
    Path("trained_on.json").unlink()
    assert recipes_trained_on(config, slurries, "model.keras") is None


def test_a_model_to_start_from_has_to_fit(config, monkeypatch):
    """What does not is said before any job, by its layers and by what it says of itself."""
    config["surrogate"]["vgg16"]["start_from"] = "other/model.keras"
    what = 'surrogate.vgg16.start_from = "other/model.keras": '
    assert check(config) == [f"{what}no such file: must be null or a trained model.keras"]
    Path("other").mkdir()
    Path("other/model.keras").write_text("none")
    (line,) = check(config)
    assert line.startswith(f"{what}other/model.keras is no Keras model")
    monkeypatch.setattr(vgg16, "BLOCKS", ())
    monkeypatch.setattr(vgg16, "DENSE_UNITS", 4)
    for batch_shape, problem in (
        ([None, 3, 6], "takes inputs of shape (3, 6), needed is (4, 6)"),
        ([None, 4, 6], None),
    ):
        layers = [("InputLayer", {"name": "frames", "batch_shape": batch_shape})]
        layers += [("Dense", {"units": units}) for units in (4, 4, 3)]
        write_layers("other/model.keras", layers)
        assert check(config) == ([f"{what}{problem}, for vgg16"] if problem else [])
    known = {
        "surrogate": "vgg16",
        "model_sha256": checksum("other/model.keras"),
        "slurries": ["T1"],
        "target_frame": 120,
        "range": {},
        "recipes": [{}],
        "input_frames": [6, 7, 8, 9],
        "phases": ["BDPD", "NiO", "8YSZ"],
    }
    write_trained_on("other/trained_on.json", known)
    assert check(config) == [f"{what}was trained with input frames [6, 7, 8, 9], needed is [7, 8, 9, 10]"]
    recipe = "a list of at least one recipe, each a mapping"
    quantity = "a mapping of quantities to numbers training_min, training_max, low, high"
    for key, value, allowed in (
        ("recipes", [], recipe),
        ("recipes", 3, recipe),
        ("recipes", ["a"], recipe),
        ("phases", None, "a list of names"),
        ("phases", [1], "a list of names"),
        ("input_frames", ["7"], "a list of whole numbers"),
        ("target_frame", True, "a whole number"),
        ("range", [], quantity),
        ("range", {"particles": {}}, quantity),
        ("range", {"particles": dict.fromkeys(("training_min", "training_max", "low", "high"), "a")}, quantity),
    ):
        write_trained_on("other/trained_on.json", known | {key: value})
        assert check(config) == [f"{what}other/trained_on.json: {key}: must be {allowed}"]
    own = Path("results/demo/models/vgg16/model.keras")
    own.parent.mkdir(parents=True)
    own.touch()
    config["surrogate"]["vgg16"]["start_from"] = str(own)
    (line,) = check(config)
    assert line.endswith("must lie outside results/demo/models, which this run writes: choose another run.name")


def test_first_frame_seen_goes_back_where_a_surrogate_moves_its_windows(config):
    config["learning"]["input_frames"] = [7, 8, 9, 10]
    config["surrogate"]["neighbours"]["earlier_frames"] = 2
    expected = {"neighbours": 8, "neighbours_f18": 16, "vgg16": 10, "linear": 10}
    assert {label: first_frame_seen(config, label) for label in expected} == expected


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({}, None),
        ({"slurries": ["T1"]}, 'transfer.slurries = ["T1"]: T1: must be a slurry of role test'),
        ({"slurries": ["8"]}, 'transfer.slurries = ["8"]: 8: must be a slurry of role test'),
        ({"counts": [0, 3]}, "transfer.counts = [0, 3]: must be at most 2, those slurries"),
        (
            {"slurries": [str(k) for k in range(1, 8)]},
            'transfer.slurries = ["1", "2", "3", "4", "5", "6", "7"]: must leave a test slurry of their formulation, '
            "to predict",
        ),
        (
            {"networks": {"affine": None}},
            'transfer.networks: "affine": must be a network of surrogate.names or evaluation.surrogates',
        ),
        (
            {"networks": {"vgg19": None}},
            'transfer.networks: "vgg19": must be a network of surrogate.names or evaluation.surrogates',
        ),
    ],
)
def test_networks_are_tuned_on_test_slurries_of_one_recipe(config, changes, line):
    settings = {start: {"epochs": 3, "learning_rate": 1e-3} for start in ("fine_tuned", "from_scratch")}
    study = {"slurries": ["1", "2"], "counts": [0, 1, 2], "networks": {"vgg16": None}} | changes
    config["transfer"] = study | {"networks": dict.fromkeys(study["networks"], settings)}
    assert check(config) == ([] if line is None else [line])


def test_a_misspelt_network_that_is_tuned_is_named(config):
    settings = {start: {"epochs": 3, "learning_rate": 1e-3} for start in ("fine_tuned", "from_scratch")}
    config["surrogate"]["names"] = ["direct", "affine", "vgg17"]
    config["transfer"] = {"slurries": ["1"], "counts": [0, 1], "networks": {"vgg17": settings}}
    assert any("'vgg17' is not known" in line for line in check(config))


def test_a_network_from_elsewhere_is_tuned_only_if_its_training_can_go_on(with_model):
    settings = {start: {"epochs": 3, "learning_rate": 1e-3} for start in ("fine_tuned", "from_scratch")}
    with_model["transfer"] = {"slurries": ["1", "2"], "counts": [0, 2], "networks": {"vgg16": settings}}
    assert check(with_model) == [
        'transfer.networks: surrogate.models.vgg16 = "model.keras" cannot be trained on: has other layers than the '
        "published network, for vgg16"
    ]
    with_model["transfer"]["counts"] = [0]
    assert check(with_model) == []


TWO_RECIPES = [("T", "train", ""), ("A", "test", ""), ("B", "test", "other"), ("C", "test", "other")]


def test_slurries_to_tune_on_are_of_one_recipe(config):
    rows = [f"{id}\t{role}\t1\t1\t{seed}\t{recipe}" for seed, (id, role, recipe) in enumerate(TWO_RECIPES, 1)]
    Path("mixed.tsv").write_text(HEADER.replace("seed\n", "seed\tformulation\n") + "\n".join(rows))
    config |= {"slurries": "mixed.tsv", "formulations": {"other": {"expected_density_g_cm3": 2.2}}}
    config["transfer"] = {"slurries": ["A", "B"], "counts": [1], "networks": {}}
    assert check(config) == ['transfer.slurries = ["A", "B"]: must be of one formulation']
    config["transfer"]["slurries"] = ["B"]
    assert check(config) == []
    assert tuning_tests(config, checked_slurries(config)) == ["C"]
