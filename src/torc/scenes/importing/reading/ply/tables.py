"""The tables of a PLY file, text or binary, with lists of any lengths (G. Turk, The PLY Polygon File Format, 1994)."""

import re
import struct
import warnings
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Int, Shaped, UInt8

_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8", "int64": "i8", "uint64": "u8",
}  # fmt: skip
_ORDERS = {"ascii": "<", "binary_little_endian": "<", "binary_big_endian": ">"}
_START = re.compile(rb"ply(\s+)")
_END, _END_OF_OLD_MACS = re.compile(rb"\nend_header[ \t\r]*\n"), re.compile(rb"\rend_header[ \t]*\r")
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
    """A column of lists: their lengths, whole numbers of the file's type, and what is in them, one after the other."""

    lengths: Shaped[np.ndarray, "n"]
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
    text, body = _parts(data)
    form, elements, comments = _header(text)
    order = _ORDERS[form]
    if form == "ascii":
        # As if it were binary with numbers of one type throughout.
        body, wide = _numbers(body), "f8"
    else:
        wide = None
    tables, at = {}, 0
    for element in elements:
        tables[element.name], at = _table(body, at, element, order, wide)
    return tables, comments


def _parts(data: bytes) -> tuple[str, bytes]:
    """The header, and what follows it."""
    head = data[:_MAX_HEADER_BYTES]
    start = _START.match(head)
    ending = _END if start and b"\n" in start[1] else _END_OF_OLD_MACS
    end = ending.search(head)
    if start is None or end is None:
        raise PlyError("its header has no end")
    return head[start.end() : end.start()].decode("utf-8", "replace"), data[end.end() :]


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
    for name, times in Counter(element.name for element in elements).items():
        if times > 1:
            raise PlyError(f"it has {times} tables of the name {name[:40]}; join them into one")
    for element in elements:
        names = [p.name for p in element.properties]
        if len(set(names)) < len(names) or len(names) > _MAX_PROPERTIES:
            raise PlyError(f"its {element.name[:40]} table has columns of one name, or too many")
    return form, elements, tuple(comments)


def _numbers(text: bytes) -> bytes:
    with warnings.catch_warnings():
        # Older versions of numpy warn where newer ones raise; what is short is told later.
        warnings.simplefilter("ignore")
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
        lists = {p.name: Lists(empty, empty) for p in properties if p.count_kind}
        return Table(declared, {p.name: empty for p in properties if not p.count_kind}, lists), at
    short = PlyError(f"it is cut off: {element.count} rows of its {element.name[:40]} table are announced")
    if element.count * sum(np.dtype(p.count_kind or p.kind).itemsize for p in properties) > len(body) - at:
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
            lists[p.name] = Lists(rows[f"count_{i}"], values.reshape(-1))
    return Table(declared, columns, lists), at + count * size


def _mixed(
    body: bytes, at: int, properties: Sequence[Property], count: int, declared: dict[str, str]
) -> tuple[Table, int]:
    """A table with lists of different lengths. Needs a few times the memory of its part of the file."""
    steps = [(p.count_kind, np.dtype(p.kind).itemsize) for p in properties]
    lengths = [np.empty(count if kind else 0, kind or "i8") for kind, _ in steps]
    starts, end = np.empty(count, np.int64), at
    for row in range(count):
        starts[row] = end
        for i, (count_kind, size) in enumerate(steps):
            n = 1
            if count_kind:
                n = _length(body, end, count_kind)
                end += lengths[i].itemsize
            end += n * size
            if end > len(body):
                raise IndexError
            if count_kind:
                lengths[i][row] = n
    content = np.frombuffer(body, np.uint8, end - at, at)
    starts -= at
    columns, lists = {}, {}
    for p, (_, size), sizes in zip(properties, steps, lengths):
        starts += sizes.itemsize if p.count_kind else 0
        ends = starts + size * (sizes.astype(np.int64) if p.count_kind else 1)
        values = _between(content, starts, ends).view(p.kind)
        starts = ends
        if p.count_kind:
            lists[p.name] = Lists(sizes, values)
        else:
            columns[p.name] = values
    return Table(declared, columns, lists), end


def _between(
    content: UInt8[np.ndarray, "b"], starts: Int[np.ndarray, "n"], ends: Int[np.ndarray, "n"]
) -> UInt8[np.ndarray, "m"]:
    """Runs of bytes, one after the other; they rise, and no two of them touch."""
    filled = starts < ends
    edges = np.zeros(len(content) + 1, np.int8)
    edges[starts[filled]] = 1
    edges[ends[filled]] = -1
    inside = np.cumsum(edges, dtype=np.int8, out=edges)[:-1].view(bool)
    return content[inside]


def _length(body: bytes, at: int, kind: str) -> int:
    n = struct.unpack_from(kind[0] + _CODES[kind[1:]], body, at)[0]
    if not (n >= 0 and n % 1 == 0):
        raise PlyError(f"a list has the length {n:g}")
    return int(n)


_CODES = {
    "i1": "b",
    "u1": "B",
    "i2": "h",
    "u2": "H",
    "i4": "i",
    "u4": "I",
    "i8": "q",
    "u8": "Q",
    "f4": "f",
    "f8": "d",
}
