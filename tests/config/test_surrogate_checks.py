"""Surrogates in the configuration: trained models, and what follows for one label."""

from pathlib import Path

import pytest

from configurations import HEADER
from slurrycast.config.configuration import check
from slurrycast.config.label_settings import first_frame_seen, training_needed, without_training

pytestmark = pytest.mark.usefixtures("in_empty_project")


@pytest.fixture
def with_model(in_empty_project, config) -> dict:
    """The shipped configuration with a trained model, without evaluation and pictures of surrogates."""
    Path("model.keras").touch()
    config["surrogate"]["models"] = {"vgg16": "model.keras"}
    config["report"]["pictures"] = config["evaluation"]["surrogates"] = []
    return config


def test_training_slurries_are_not_needed_where_a_model_is_given(config):
    Path("new.tsv").write_text(HEADER + "N1\tnew\t2\t1\t7\n")
    Path("model.keras").touch()
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
    model.touch()
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
    with_model["evaluation"]["surrogates"] = further
    with_model["surrogate"] |= {
        "names": names,
        "models": dict.fromkeys(adopted, "model.keras"),
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


def test_first_frame_seen_goes_back_where_a_surrogate_moves_its_windows(config):
    config["learning"]["input_frames"] = [7, 8, 9, 10]
    config["surrogate"]["neighbours"]["earlier_frames"] = 2
    expected = {"neighbours": 8, "neighbours_f18": 16, "vgg16": 10, "linear": 10}
    assert {label: first_frame_seen(config, label) for label in expected} == expected
