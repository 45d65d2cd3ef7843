import itertools

import numpy as np
import onnx
import onnxruntime
import pytest
from onnx import numpy_helper

from fingers_mjx.export.onnx_graph import PolicyWeights, build_graph

SEED = 17


def _weights(obs_clip=None):
    rng = np.random.default_rng(SEED)
    layers = tuple(
        (rng.standard_normal(pair) / np.sqrt(pair[0]), rng.standard_normal(pair[1]))
        for pair in itertools.pairwise((12, 9, 7, 20))
    )
    return PolicyWeights(
        layers, rng.standard_normal(12), rng.uniform(0.1, 3, 12), 3.0, obs_clip
    )


@pytest.mark.parametrize("obs_clip", [None, 2.0])
def test_contract_of_the_file(obs_clip):
    model = build_graph(_weights(obs_clip))
    onnx.checker.check_model(model, full_check=True)
    assert (model.ir_version, model.opset_import[0].version) == (8, 17)
    assert len(model.opset_import) == 1 and model.opset_import[0].domain == ""
    kinds = {tensor.data_type for tensor in model.graph.initializer}
    assert kinds == {onnx.TensorProto.FLOAT}
    assert all(t.data_location == 0 for t in model.graph.initializer)
    session = onnxruntime.InferenceSession(model.SerializeToString())
    (obs,), (action,) = session.get_inputs(), session.get_outputs()
    assert (obs.name, obs.shape, obs.type) == ("obs", [1, 12], "tensor(float)")
    assert (action.name, action.shape) == ("action", [1, 20])


def test_weights_are_stored_as_given():
    weights = _weights()
    stored = {
        t.name: numpy_helper.to_array(t) for t in build_graph(weights).graph.initializer
    }
    for i, (weight, bias) in enumerate(weights.layers):
        np.testing.assert_array_equal(stored[f"weight_{i}"], np.float32(weight))
        np.testing.assert_array_equal(stored[f"bias_{i}"], np.float32(bias))
    np.testing.assert_array_equal(stored["mean"], np.float32(weights.mean))
    np.testing.assert_array_equal(stored["std"], np.float32(weights.std))


def test_same_weights_same_bytes():
    first, second = (build_graph(_weights()).SerializeToString() for _ in range(2))
    assert first == second


def test_zero_layers_give_the_bias_and_the_clip_bounds_it():
    bias = np.linspace(-5, 5, 20)
    weights = PolicyWeights(((np.zeros((3, 20)), bias),), np.zeros(3), np.ones(3), 3.0)
    session = onnxruntime.InferenceSession(build_graph(weights).SerializeToString())
    obs = np.ones((1, 3), np.float32)
    found = session.run(None, {"obs": obs})[0][0]
    np.testing.assert_array_equal(found, np.clip(bias, -3, 3).astype(np.float32))
