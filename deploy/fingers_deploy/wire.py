"""Reading the protobuf wire format, as far as our own ONNX files use it.

Only fields that the exporter writes are known, everything else is refused: external
data, attributes, custom domains, sub-graphs and functions cannot even be expressed.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_VARINT, _BYTES = 0, 2
_FLOAT32 = 1
_METADATA = 14


@dataclass(frozen=True)
class Node:
    """One operator: its name, inputs and outputs."""

    op: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]


@dataclass(frozen=True)
class Graph:
    """An ONNX model as read from the wire.

    Attributes:
        ir_version: version of the ONNX file format.
        opset: version of the default operator set.
        nodes: the operators in order.
        tensors: the constants, float32.
        inputs: name and shape of each input.
        outputs: name and shape of each output.
        metadata: the metadata entries.
        bare: the serialized model without its metadata.
    """

    ir_version: int
    opset: int
    nodes: tuple[Node, ...]
    tensors: dict[str, NDArray[np.float32]]
    inputs: dict[str, tuple[int, ...]]
    outputs: dict[str, tuple[int, ...]]
    metadata: dict[str, str]
    bare: bytes


def read_model(data: bytes) -> Graph:
    """Reads a serialized ModelProto.

    Raises:
        ValueError: the bytes are not a model of the restricted form.
    """
    model = _message(
        data, "model", {1: int, 2: str, 3: str, 7: bytes, 8: bytes, 14: bytes}
    )
    graph = _message(
        _one(model, 7), "graph", {1: bytes, 2: str, 5: bytes, 11: bytes, 12: bytes}
    )
    opset = _message(_one(model, 8), "opset", {1: str, 2: int})
    if opset.get(1, [""]) != [""]:
        raise ValueError(f"operator set {opset[1]} instead of the default one")
    pairs = [_message(m, "metadata", {1: str, 2: str}) for m in model.get(14, [])]
    return Graph(
        ir_version=_one(model, 1),
        opset=_one(opset, 2),
        nodes=tuple(_node(n) for n in graph.get(1, [])),
        tensors=_unique([_tensor(t) for t in graph.get(5, [])]),
        inputs=_unique([_value_info(v) for v in graph.get(11, [])]),
        outputs=_unique([_value_info(v) for v in graph.get(12, [])]),
        metadata=_unique([(_one(p, 1), _one(p, 2)) for p in pairs]),
        bare=b"".join(raw for n, _, raw in _fields(data) if n != _METADATA),
    )


def _node(data: bytes) -> Node:
    fields = _message(data, "node", {1: str, 2: str, 3: str, 4: str})
    return Node(_one(fields, 4), tuple(fields.get(1, [])), tuple(fields.get(2, [])))


def _tensor(data: bytes) -> tuple[str, NDArray[np.float32]]:
    fields = _message(data, "tensor", {1: int, 2: int, 8: str, 9: bytes})
    if _one(fields, 2) != _FLOAT32:
        raise ValueError(f"tensor of type {fields[2]} instead of float32")
    array = np.frombuffer(_one(fields, 9), dtype="<f4")
    return _one(fields, 8), array.reshape(fields.get(1, []))


def _value_info(data: bytes) -> tuple[str, tuple[int, ...]]:
    info = _message(data, "value", {1: str, 2: bytes})
    kind = _message(_one(info, 2), "type", {1: bytes})
    tensor = _message(_one(kind, 1), "tensor type", {1: int, 2: bytes})
    if _one(tensor, 1) != _FLOAT32:
        raise ValueError(f"value of type {tensor[1]} instead of float32")
    shape = _message(_one(tensor, 2), "shape", {1: bytes})
    sizes = [_message(d, "dimension", {1: int}) for d in shape.get(1, [])]
    return _one(info, 1), tuple(_one(size, 1) for size in sizes)


def _message(data: bytes, name: str, known: dict[int, type]) -> dict[int, list]:
    """Collects the values of each field, all of which must be known."""
    found: dict[int, list] = {}
    for number, value, _ in _fields(data):
        kind = known.get(number)
        if kind is None or isinstance(value, int) != (kind is int):
            raise ValueError(f"{name} has field {number}, which no export writes")
        if kind is str and isinstance(value, bytes):
            value = value.decode("utf-8")
        found.setdefault(number, []).append(value)
    return found


def _fields(data: bytes) -> Iterator[tuple[int, int | bytes, bytes]]:
    """Yields number, value and raw bytes of each field of a message."""
    position = 0
    while position < len(data):
        start = position
        tag, position = _varint(data, position)
        value, position = _varint(data, position)
        if tag & 7 == _BYTES:
            position, length = position + value, value
            if position > len(data):
                raise ValueError("a field ends behind the end of the file")
            value = data[position - length : position]
        elif tag & 7 != _VARINT:
            raise ValueError(f"wire type {tag & 7}, which no export writes")
        yield tag >> 3, value, data[start:position]


def _varint(data: bytes, position: int) -> tuple[int, int]:
    value = 0
    for shift in range(0, 64, 7):
        if position >= len(data):
            raise ValueError("a number ends behind the end of the file")
        byte, position = data[position], position + 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, position
    raise ValueError("a number longer than 64 bits")


def _one(fields: dict[int, list], number: int):
    values = fields.get(number, [])
    if len(values) != 1:
        raise ValueError(f"field {number} {len(values)} times instead of once")
    return values[0]


def _unique(pairs: list[tuple]) -> dict:
    table = dict(pairs)
    if len(table) != len(pairs):
        raise ValueError("a name is used twice")
    return table
