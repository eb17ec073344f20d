"""Labels of surrogates: what they stand for, and which ones belong together."""

import pytest

from slurrycast import surrogates
from slurrycast.runtime.files import InputError


@pytest.mark.parametrize(
    ("text", "name", "settings", "last_frame", "plain"),
    [
        ("affine", "affine", {}, None, "affine"),
        ("affine_f02", "affine", {}, 2, "affine"),
        ("affine_f110", "affine", {}, 110, "affine"),
        ("vgg16", "vgg16", {}, None, "vgg16"),
        ("vgg16_relative", "vgg16", {"change": "relative"}, None, "vgg16_relative"),
        ("vgg16_standardised", "vgg16", {"change": "standardised"}, None, "vgg16_standardised"),
        ("vgg16_box", "vgg16_box", {}, None, "vgg16_box"),
        ("vgg16_box_xu", "vgg16_box", {"change": "xu"}, None, "vgg16_box_xu"),
        ("vgg16_box_absolute", "vgg16_box", {"change": "absolute"}, None, "vgg16_box_absolute"),
        ("vgg16_box_nobox_f02", "vgg16_box", {"change": "nobox"}, 2, "vgg16_box_nobox"),
        ("early_dem_x10", "early_dem", {"faster": "10"}, None, "early_dem_x10"),
        ("early_dem_x10_f04", "early_dem", {"faster": "10"}, 4, "early_dem_x10"),
    ],
)
def test_labels_are_taken_apart(text, name, settings, last_frame, plain):
    assert surrogates.parse(text) == surrogates.Label(text, name, settings, last_frame)
    assert surrogates.parse(text).without_frame == plain
    assert surrogates.family(text) == name


@pytest.mark.parametrize("text", ["", "Affine", "affine_", "affine_f2", "affine_x2", "early_dem", "vgg16_b"])
def test_other_labels_are_refused(text):
    with pytest.raises(InputError, match=f"surrogate: '{text}' is not known"):
        surrogates.parse(text)


def test_input_frames_of_a_label():
    assert surrogates.parse("affine").input_frames([7, 8, 9, 10]) == [7, 8, 9, 10]
    assert surrogates.parse("affine_f09").input_frames([7, 8, 9, 10]) == [6, 7, 8, 9]
    assert surrogates.parse("affine_f01").input_frames([7, 8, 9, 10]) == [0, 1]


@pytest.mark.parametrize(("label", "family"), [("net_f04", "net"), ("network", "network")])
def test_family_of_a_label_that_may_not_be_known(label, family):
    assert surrogates.family(label) == family


def test_main_labels_leave_out_variants_and_earlier_frames():
    labels = ["affine", "affine_f02", "vgg16_box", "vgg16_box_absolute", "early_dem_x2", "early_dem_x2_f02", "net"]
    assert surrogates.main_labels(labels) == ["affine", "vgg16_box", "early_dem_x2", "net"]
