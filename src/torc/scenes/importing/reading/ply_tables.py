"""The tables of a PLY file, text or binary, with lists of any lengths (G. Turk, The PLY Polygon File Format, 1994)."""

import re
import struct
import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Int, Shaped

_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
_ORDERS = {"ascii": "<", "binary_little_endian": "<", "binary_big_endian": ">"}
_HEADER = re.compile(rb"\Aply\s*?\n(.*?)^end_header[ \t\r]*\n", re.DOTALL | re.MULTILINE)
_MAX_HEADER_BYTES, _MAX_PROPERTIES = 100_000, 200


class PlyError(ValueError):
    """The file is not what its format says; the text tells where."""


@dataclass(frozen=True)
class Property:
    """A column. `kind`: numpy's name of its type, as the file declares it; `count_kind`: of a list's length."""

    name: str
    kind: str
    count_kind: str | None = None


@dataclass(frozen=True)
class Lists:
    """A column of lists: their lengths, and what is in them, one after the other."""

    lengths: Int[np.ndarray, "n"]
    values: Shaped[np.ndarray, "m"]


@dataclass(frozen=True)
class Table:
    """One element of a PLY file, e.g. its vertices: the declared type and the content of each column."""

    kinds: dict[str, str]
    columns: dict[str, np.ndarray]
    lists: dict[str, Lists]


@dataclass(frozen=True)
class _Element:
    name: str
    count: int
    properties: list[Property]


def read_tables(data: bytes) -> tuple[dict[str, Table], tuple[str, ...]]:
    """The tables by name, and the header's comments. Raises PlyError."""
    match = _HEADER.match(data[:_MAX_HEADER_BYTES])
    if match is None:
        raise PlyError("its header has no end")
    form, elements, comments = _header(match[1].decode("utf-8", "replace"))
    body, order = data[match.end() :], _ORDERS[form]
    if form == "ascii":
        # As if it were binary with numbers of one type throughout.
        body, wide = _numbers(body), "f8"
    else:
        wide = None
    tables, at = {}, 0
    for element in elements:
        tables[element.name], at = _table(body, at, element, order, wide)
    return tables, comments


def _header(text: str) -> tuple[str, list[_Element], tuple[str, ...]]:
    form, elements, comments = "", list[_Element](), list[str]()
    for line in text.splitlines():
        words = line.split()
        match words:
            case ["comment", *_]:
                comments.append(line.split(None, 1)[1].strip() if len(words) > 1 else "")
            case ["format", name, "1.0"] if name in _ORDERS:
                form = name
            case ["element", name, count] if count.isascii() and count.isdigit() and len(count) < 19:
                elements.append(_Element(name, int(count), []))
            case ["property", "list", length, kind, name] if elements and {length, kind} <= _TYPES.keys():
                elements[-1].properties.append(Property(name, _TYPES[kind], _TYPES[length]))
            case ["property", kind, name] if elements and kind in _TYPES:
                elements[-1].properties.append(Property(name, _TYPES[kind]))
            case ["format" | "element" | "property", *_]:
                raise PlyError(f"its header says '{line.strip()[:80]}', which is not understood")
            case _:
                pass  # notes, some without the word that should mark them
    if not form:
        raise PlyError("its header names no format that is read")
    for element in elements:
        names = [p.name for p in element.properties]
        if len(set(names)) < len(names) or len(names) > _MAX_PROPERTIES:
            raise PlyError(f"its {element.name[:40]} table has columns of one name, or too many")
    return form, elements, tuple(comments)


def _numbers(text: bytes) -> bytes:
    with warnings.catch_warnings():
        warnings.simplefilter(
            "ignore"
        )  # older versions of numpy warn where newer ones raise: what is short is told
        try:
            return np.fromstring(text, dtype="<f8", sep=" ").tobytes()
        except ValueError:
            raise PlyError("it holds something that is no number") from None


def _table(body: bytes, at: int, element: _Element, order: str, wide: str | None) -> tuple[Table, int]:
    """One element's content and where it ends."""
    declared = {p.name: p.kind for p in element.properties}
    properties = [
        Property(p.name, order + (wide or p.kind), p.count_kind and order + (wide or p.count_kind))
        for p in element.properties
    ]
    if not properties or element.count == 0:
        empty = np.zeros(0)
        lists = {p.name: Lists(np.zeros(0, np.int64), empty) for p in properties if p.count_kind}
        return Table(declared, {p.name: empty for p in properties if not p.count_kind}, lists), at
    short = PlyError(f"it is cut off: {element.count} rows of its {element.name[:40]} table are announced")
    if element.count > len(body) - at:
        raise short
    try:
        return _alike(body, at, properties, element.count, declared) or _mixed(
            body, at, properties, element.count, declared
        )
    except (struct.error, IndexError):
        raise short from None


def _alike(
    body: bytes, at: int, properties: Sequence[Property], count: int, declared: dict[str, str]
) -> tuple[Table, int] | None:
    """A table whose lists are all as long as those of its first row; None if they are not."""
    fields: list[tuple] = []
    end = at
    for i, p in enumerate(properties):
        if p.count_kind:
            n = _length(body, end, p.count_kind)
            fields.append((f"count_{i}", p.count_kind))
            end += np.dtype(p.count_kind).itemsize
            fields.append((f"value_{i}", p.kind, (n,)))
            end += n * np.dtype(p.kind).itemsize
        else:
            fields.append((f"value_{i}", p.kind))
            end += np.dtype(p.kind).itemsize
        if end > len(body):
            raise IndexError
    size = end - at
    if at + count * size > len(body):
        return None
    rows = np.frombuffer(body, np.dtype(fields), count, at)
    columns, lists = {}, {}
    for i, p in enumerate(properties):
        values = rows[f"value_{i}"]
        if not p.count_kind:
            columns[p.name] = values
        elif (rows[f"count_{i}"] != values.shape[1]).any():
            return None
        else:
            lists[p.name] = Lists(np.full(count, values.shape[1]), values.reshape(-1))
    return Table(declared, columns, lists), at + count * size


def _mixed(
    body: bytes, at: int, properties: Sequence[Property], count: int, declared: dict[str, str]
) -> tuple[Table, int]:
    """A table with lists of different lengths."""
    starts = np.empty((len(properties), count), np.int64)
    lengths = np.ones((len(properties), count), np.int64)
    sizes = [np.dtype(p.kind).itemsize for p in properties]
    for row in range(count):
        for i, p in enumerate(properties):
            n = 1
            if p.count_kind:
                n = _length(body, at, p.count_kind)
                at += np.dtype(p.count_kind).itemsize
                lengths[i, row] = n
            starts[i, row] = at
            at += n * sizes[i]
        if at > len(body):
            raise IndexError
    content = np.frombuffer(body, np.uint8)
    columns, lists = {}, {}
    for i, p in enumerate(properties):
        values = _gathered(content, starts[i], lengths[i], np.dtype(p.kind))
        if p.count_kind:
            lists[p.name] = Lists(lengths[i], values)
        else:
            columns[p.name] = values
    return Table(declared, columns, lists), at


def _gathered(content: np.ndarray, starts: np.ndarray, lengths: np.ndarray, dtype: np.dtype) -> np.ndarray:
    """Runs of values out of bytes, one after the other."""
    total = int(lengths.sum())
    first = np.repeat(np.cumsum(lengths) - lengths, lengths)
    where = np.repeat(starts, lengths) + (np.arange(total) - first) * dtype.itemsize
    return content[where[:, None] + np.arange(dtype.itemsize)].reshape(-1).view(dtype)


def _length(body: bytes, at: int, kind: str) -> int:
    n = float(struct.unpack_from(kind[0] + _CODES[kind[1:]], body, at)[0])
    if not (n.is_integer() and n >= 0):
        raise PlyError(f"a list has the length {n:g}")
    return int(n)


_CODES = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "f4": "f", "f8": "d"}
