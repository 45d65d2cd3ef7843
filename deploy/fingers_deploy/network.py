"""The policy network in NumPy: normalizer, ELU layers, linear output, clip."""

import itertools
import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingers_deploy.wire import Graph

IR_VERSIONS = range(7, 9)
OPSETS = range(13, 18)
_CONSTANTS = {"Sub": 1, "Div": 1, "Clip": 2, "Gemm": 2, "Elu": 0}
_CHAIN = re.compile(r"Sub Div (Clip )?(Gemm Elu )*Gemm Clip")

Array = NDArray[np.float32]


@dataclass(frozen=True)
class NumpyPolicy:
    """a = clip(Wₙ·elu(… elu(W₁·clip((obs − mean)/std) + b₁) …) + bₙ).

    Attributes:
        mean: mean of each observation entry, [N].
        std: its standard deviation, above zero, [N].
        obs_clip: bound on the normalized observation; infinite without one.
        layers: weight [in, out] and bias [out] of each layer.
        action_clip: bound on the output.
    """

    mean: Array
    std: Array
    obs_clip: float
    layers: tuple[tuple[Array, Array], ...]
    action_clip: float

    def __call__(self, obs: Array) -> Array:
        """Returns the clipped output [A] for an observation [N], both float32."""
        # Absurd inputs may overflow; the caller looks at the result.
        with np.errstate(over="ignore", invalid="ignore"):
            hidden = (obs - self.mean) / self.std
            hidden = np.clip(hidden, -self.obs_clip, self.obs_clip)
            for weight, bias in self.layers[:-1]:
                hidden = _elu(hidden @ weight + bias)
            weight, bias = self.layers[-1]
            output = hidden @ weight + bias
        return np.clip(output, -self.action_clip, self.action_clip)


def read_network(graph: Graph) -> NumpyPolicy:
    """Takes the network out of an ONNX graph.

    Raises:
        ValueError: the graph is not the one chain that `NumpyPolicy` describes.
    """
    _check_versions(graph)
    ops = " ".join(node.op for node in graph.nodes)
    if not _CHAIN.fullmatch(ops):
        raise ValueError(f"operators {ops[:80]} instead of normalizer, layers and clip")
    steps = _constants(graph)
    clips = [_bound(c) for op, c in steps if op == "Clip"]
    network = NumpyPolicy(
        mean=_vector(steps[0][1][0]),
        std=_vector(steps[1][1][0]),
        obs_clip=clips[0] if len(clips) == 2 else np.inf,
        layers=tuple((c[0], c[1]) for op, c in steps if op == "Gemm"),
        action_clip=clips[-1],
    )
    _check_shapes(graph, network)
    return network


def _elu(x: Array) -> Array:
    """elu(x) = x where x > 0, else eˣ − 1."""
    return np.where(x > 0, x, np.expm1(np.minimum(x, np.float32(0))))


def _check_versions(graph: Graph) -> None:
    if graph.ir_version not in IR_VERSIONS:
        raise ValueError(f"IR version {graph.ir_version} instead of 7 or 8")
    if graph.opset not in OPSETS:
        raise ValueError(f"operator set {graph.opset} instead of 13 to 17")
    for name, tensor in graph.tensors.items():
        if not np.all(np.isfinite(tensor)):
            raise ValueError(f"non-finite values in {name}")


def _constants(graph: Graph) -> list[tuple[str, list[Array]]]:
    """Returns operator and constant inputs of each node of the chain."""
    steps, value = [], "obs"
    for node in graph.nodes:
        if node.inputs[:1] != (value,) or len(node.outputs) != 1:
            raise ValueError(f"{node.op} is not fed by the operator before it")
        names = node.inputs[1:]
        if len(names) != _CONSTANTS[node.op] or not set(names) <= set(graph.tensors):
            raise ValueError(
                f"{node.op} with inputs {names} that are not its constants"
            )
        steps.append((node.op, [graph.tensors[name] for name in names]))
        value = node.outputs[0]
    if value != "action":
        raise ValueError(f"the chain ends in {value} instead of action")
    return steps


def _vector(constant: Array) -> Array:
    if constant.ndim != 1:
        raise ValueError(f"normalizer of shape {constant.shape} instead of a vector")
    return constant


def _bound(constants: list[Array]) -> float:
    if [c.shape for c in constants] != [(), ()]:
        raise ValueError("clip without two scalar bounds")
    low, high = (float(c) for c in constants)
    if not 0 < high == -low:
        raise ValueError(f"clip to [{low}, {high}] instead of a symmetric range")
    return high


def _check_shapes(graph: Graph, network: NumpyPolicy) -> None:
    widths = [network.mean.shape[0]]
    for weight, bias in network.layers:
        if weight.ndim != 2 or weight.shape != (widths[-1], *bias.shape):
            raise ValueError(f"layer of shape {weight.shape} behind width {widths[-1]}")
        widths.append(bias.shape[0])
    ends = {"obs": (1, widths[0])}, {"action": (1, widths[-1])}
    if (graph.inputs, graph.outputs) != ends:
        raise ValueError(f"inputs {graph.inputs} and outputs {graph.outputs}")
    used = set(itertools.chain(*(node.inputs[1:] for node in graph.nodes)))
    if used != set(graph.tensors):
        raise ValueError("constants that no operator uses")
    if network.std.shape != network.mean.shape or np.any(network.std <= 0):
        raise ValueError("standard deviations that are not positive")
