"""Layers of a network, read from its file."""

import numpy as np
import pytest

from slurrycast.report.network_table import read_network
from slurrycast.runtime.files import InputError


def test_network_is_read_from_the_model_file(model):
    network = read_network(model)
    shapes = [layer.output_shape for layer in network.layers]
    assert shapes == [(3, 2), (3, 5), (2, 5), (10,), (3,), None]
    assert [layer.parameters for layer in network.layers] == [0, 35, 0, 0, 33, None]
    assert network.parameters == 68


def test_layers_of_a_network_that_standardises_by_itself(tmp_path):
    from slurrycast.surrogates import samples, vgg16

    standardisation = samples.Standardisation(np.zeros(6), np.ones(6), 3.0)
    vgg16.build(4, 6, standardisation).save(tmp_path / "model.keras")
    network = read_network(tmp_path / "model.keras")
    assert [layer.output_shape for layer in network.layers[1:3]] == [(4, 6), (4, 64)]
    assert (network.layers[-1].output_shape, sum(layer.parameters for layer in network.layers)) == ((3,), 23_803_139)


def test_a_file_that_is_no_model_is_refused(tmp_path):
    path = tmp_path / "model.keras"
    path.write_text("not a zip")
    with pytest.raises(InputError, match=r"model\.keras"):
        read_network(path)
