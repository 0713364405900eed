"""Tiny ONNX models, written byte by byte: the package `onnx` is not needed.

A model is a protobuf message (onnx.proto3, IR version 8, opset 13). `matcher` writes one with the inputs and outputs of
S2M2 that matches nothing: its disparity is the mean of the left picture's channels times `gain`, its confidence that of
the right picture's by 255. So a test decides what is "found" by painting it.
"""

import struct

FLOAT, UINT8 = 1, 2


def _varint(n: int) -> bytes:
    out = b""
    while n > 127:
        out, n = out + bytes([n & 127 | 128]), n >> 7
    return out + bytes([n])


def _number(field: int, n: int) -> bytes:
    return _varint(field << 3) + _varint(n)


def _bytes(field: int, data: bytes | str) -> bytes:
    data = data.encode() if isinstance(data, str) else data
    return _varint(field << 3 | 2) + _varint(len(data)) + data


def _node(kind: str, inputs: list[str], output: str, attributes: bytes = b"") -> bytes:
    return b"".join(_bytes(1, i) for i in inputs) + _bytes(2, output) + _bytes(4, kind) + attributes


def _integer(name: str, n: int) -> bytes:
    """AttributeProto: name 1, i 3, type 20 (INT = 2)."""
    return _bytes(5, _bytes(1, name) + _number(3, n) + _number(20, 2))


def _integers(name: str, values: list[int]) -> bytes:
    """AttributeProto: name 1, ints 8, type 20 (INTS = 7)."""
    return _bytes(5, _bytes(1, name) + b"".join(_number(8, n) for n in values) + _number(20, 7))


def _constant(name: str, value: float) -> bytes:
    """TensorProto: data_type 2, name 8, raw_data 9; a scalar."""
    return _number(2, FLOAT) + _bytes(8, name) + _bytes(9, struct.pack("<f", value))


def _value(name: str, kind: int, shape: list[int | str]) -> bytes:
    """ValueInfoProto; a dimension is a number (1) or a name (2)."""
    dims = [_bytes(1, _number(1, n) if isinstance(n, int) else _bytes(2, n)) for n in shape]
    tensor = _number(1, kind) + _bytes(2, b"".join(dims))
    return _bytes(1, name) + _bytes(2, _bytes(1, tensor))


def matcher(
    size: tuple[int | str, int | str] = ("H", "W"),
    kind: int = FLOAT,
    gain: float = 1.0,
    outputs: tuple[str, ...] = ("output_disp", "output_occ", "output_conf"),
) -> bytes:
    """The bytes of a model for pictures of that height and width; a name is any."""
    nodes = []
    for side, name, factor in (("left", outputs[0], "gain"), ("right", outputs[-1], "per_cent")):
        nodes.append(_node("Cast", [f"input_{side}"], f"{side}_f", _integer("to", FLOAT)))
        nodes.append(
            _node("ReduceMean", [f"{side}_f"], f"{side}_m", _integers("axes", [1]) + _integer("keepdims", 1))
        )
        nodes.append(_node("Mul", [f"{side}_m", factor], name))
    if len(outputs) > 2:
        nodes.append(_node("Identity", [outputs[-1]], outputs[1]))
    inputs = [_value(f"input_{side}", kind, [1, 3, *size]) for side in ("left", "right")]
    graph = b"".join(_bytes(1, n) for n in nodes) + _bytes(2, "tiny")
    graph += _bytes(5, _constant("gain", gain)) + _bytes(5, _constant("per_cent", 1 / 255))
    graph += b"".join(_bytes(11, i) for i in inputs)
    graph += b"".join(_bytes(12, _value(o, FLOAT, [1, 1, *size])) for o in outputs)
    return _number(1, 8) + _bytes(7, graph) + _bytes(8, _bytes(1, "") + _number(2, 13))
