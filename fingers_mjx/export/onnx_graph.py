"""The policy as an ONNX graph: normalizer, ELU layers, linear output, clip.

Written with `onnx.helper` operator by operator, so that the file holds nothing but this
chain and runs on every ONNX Runtime since 1.15 and in `fingers_deploy.network`.
"""

from dataclasses import dataclass

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from fingers_deploy.bundle import MANIFEST_KEY, seal
from fingers_deploy.manifest import Interface, Manifest, dump_manifest

OPSET = 17
IR_VERSION = 8


@dataclass(frozen=True)
class PolicyWeights:
    """a = clip(Wₙ·elu(… elu(W₁·clip((obs − mean)/std) + b₁) …) + bₙ).

    Attributes:
        layers: weight [in, out] and bias [out] of each layer, first to last.
        mean: mean of each observation entry, [N].
        std: its standard deviation, above zero, [N].
        action_clip: bound on the output.
        obs_clip: bound on the normalized observation; None where training had none.
    """

    layers: tuple[tuple[np.ndarray, np.ndarray], ...]
    mean: np.ndarray
    std: np.ndarray
    action_clip: float
    obs_clip: float | None = None


def build_graph(weights: PolicyWeights) -> onnx.ModelProto:
    """Builds the model: input `obs` [1, N], output `action` [1, A], float32.

    Args:
        weights: the network; everything is stored as float32.

    Returns:
        A model of opset 17 and IR version 8, without external data. What `weights`
        holds is not checked here but where the file is read.
    """
    chain = _Chain()
    chain.add("Sub", mean=weights.mean)
    chain.add("Div", std=weights.std)
    if weights.obs_clip is not None:
        chain.add("Clip", obs_low=-weights.obs_clip, obs_high=weights.obs_clip)
    for i, (weight, bias) in enumerate(weights.layers):
        if i:
            chain.add("Elu")
        chain.add("Gemm", **{f"weight_{i}": weight, f"bias_{i}": bias})
    chain.add("Clip", action_low=-weights.action_clip, action_high=weights.action_clip)
    return chain.model(len(weights.mean), len(weights.layers[-1][1]))


def embed_manifest(model: onnx.ModelProto, manifest: Manifest) -> bytes:
    """Serializes the model with the manifest in its metadata and a checksum at its end.

    Beside the manifest stand the keys that mjlab's tools read, at full precision.
    """
    complete = onnx.ModelProto()
    complete.CopyFrom(model)
    metadata = {
        MANIFEST_KEY: dump_manifest(manifest),
        **mjlab_metadata(manifest.interface),
    }
    helper.set_model_props(complete, metadata)
    return seal(complete.SerializeToString())


def mjlab_metadata(interface: Interface) -> dict[str, str]:
    """Returns the metadata keys of mjlab's exporter, comma-separated."""
    terms = interface.observation.terms
    columns = {
        "joint_names": interface.joint_names,
        "default_joint_pos": interface.reference_angles_rad,
        "action_scale": [interface.action.scale_rad] * len(interface.joint_names),
        "command_names": [t.name for t in terms if t.name == "command"],
        "observation_names": [t.name for t in terms],
        "observation_terms_scale": [t.scale for t in terms],
        "observation_terms_history_length": [t.history for t in terms],
    }
    return {key: ",".join(map(str, values)) for key, values in columns.items()}


class _Chain:
    """Operators one after the other, each fed by the one before."""

    def __init__(self):
        self._value = "obs"
        self._nodes: list[onnx.NodeProto] = []
        self._constants: list[onnx.TensorProto] = []

    def add(self, op: str, **constants: np.ndarray | float) -> None:
        output = f"{op.lower()}_{len(self._nodes)}"
        inputs = [self._value, *constants]
        self._nodes.append(helper.make_node(op, inputs, [output]))
        self._constants += [
            numpy_helper.from_array(np.asarray(value, np.float32), name)
            for name, value in constants.items()
        ]
        self._value = output

    def model(self, obs_size: int, action_size: int) -> onnx.ModelProto:
        self._nodes[-1].output[0] = "action"
        ends = [
            helper.make_tensor_value_info(name, TensorProto.FLOAT, [1, size])
            for name, size in (("obs", obs_size), ("action", action_size))
        ]
        graph = helper.make_graph(
            self._nodes, "policy", ends[:1], ends[1:], self._constants
        )
        opset = helper.make_opsetid("", OPSET)
        return helper.make_model(
            graph,
            producer_name="fingers_mjx",
            opset_imports=[opset],
            ir_version=IR_VERSION,
        )
