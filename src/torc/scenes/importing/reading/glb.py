"""The binary form of glTF 2.0: its JSON, and the numbers and pictures that its accessors and images point to."""

import base64
import binascii
import json
from pathlib import Path
from typing import TypeVar

import numpy as np
from jaxtyping import Shaped
from pydantic import ValidationError

from torc.errors import InputError
from torc.scenes.importing.reading.gltf_schema import Accessor, Gltf, ImageEntry, Sparse, refusal
from torc.scenes.strict_yaml import explain_faults

_VERSION = 2
_CHUNK_HEADER_BYTES, _FIRST_CHUNK = 8, 12
_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
Entry = TypeVar("Entry")


class GlbError(ValueError):
    """The file is not what the standard says; the text tells where."""


class Glb:
    """A GLB file's content.

    Attributes:
        gltf: its JSON.
    """

    def __init__(self, data: bytes, path: Path) -> None:
        """Raises InputError: no JSON, not understood without an extension, or it points to other files."""
        version = int.from_bytes(data[4:8], "little")
        if version != _VERSION:
            raise InputError(
                f"{path} is glTF {version}; {_VERSION}.0 is read. Export it again with a newer program."
            )
        size = int.from_bytes(data[12:16], "little")
        start = _FIRST_CHUNK + _CHUNK_HEADER_BYTES
        self.gltf = _parsed(data[start : start + size], path)
        refused = refusal(self.gltf)
        if refused:
            raise InputError(f"{path} {refused}")
        _check_uris(self.gltf, path)
        self._binary = data[start + size + _CHUNK_HEADER_BYTES :]
        self._buffers: dict[int, bytes] = {}

    def values(self, index: int, kind: tuple[str, ...]) -> Shaped[np.ndarray, "n k"]:
        """The numbers of an accessor, one row per element: float64 if they are floats or normalised, else int64.

        Args:
            index: of the accessor.
            kind: which of "SCALAR", "VEC2", ... it may be.

        Raises:
            GlbError: there is no such accessor, it is of another kind, or leaves its data.
        """
        accessor = entry(self.gltf.accessors, index, "accessors")
        where = f"accessors[{index}]"
        if accessor.type not in kind or accessor.type not in _WIDTHS:
            raise GlbError(f"{where} is {accessor.type}, not {' or '.join(kind)}")
        dtype, width = np.dtype(_TYPES[accessor.componentType]), _WIDTHS[accessor.type]
        if accessor.bufferView is None:
            values = np.zeros((accessor.count, width), dtype)
        else:
            values = self._elements(
                accessor.bufferView, accessor.byteOffset, accessor.count, dtype, width, where
            )
        if accessor.sparse is not None:
            values = self._substituted(values, accessor.sparse, where)
        return _numbers(values, accessor)

    def image_bytes(self, image: ImageEntry) -> bytes:
        """A picture's file. Raises GlbError."""
        if image.uri is not None:
            return _decoded(image.uri)
        if image.bufferView is None:
            raise GlbError("an image has no data")
        return self._view(image.bufferView)[0]

    def _elements(
        self, view: int, offset: int, count: int, dtype: np.dtype, width: int, where: str
    ) -> np.ndarray:
        data, stride = self._view(view)
        size = dtype.itemsize * width
        stride = size if stride is None else stride
        if stride < size or offset + stride * (count - 1) + size > len(data):
            raise GlbError(f"{where} needs more than the {len(data)} bytes that bufferViews[{view}] has")
        return np.ndarray((count, width), dtype, data, offset, (stride, dtype.itemsize)).copy()

    def _substituted(self, values: np.ndarray, sparse: Sparse, where: str) -> np.ndarray:
        """The values with some of them replaced: sparse accessors."""
        kind = np.dtype(_TYPES[sparse.indices.componentType])
        rows = self._elements(
            sparse.indices.bufferView, sparse.indices.byteOffset, sparse.count, kind, 1, where
        )
        if rows.max() >= len(values):
            raise GlbError(f"{where} replaces elements beyond its {len(values)}")
        values[rows[:, 0]] = self._elements(
            sparse.values.bufferView,
            sparse.values.byteOffset,
            sparse.count,
            values.dtype,
            values.shape[1],
            where,
        )
        return values

    def _view(self, index: int) -> tuple[bytes, int | None]:
        """A buffer view's bytes and stride."""
        view = entry(self.gltf.bufferViews, index, "bufferViews")
        data = self._buffer(view.buffer)[view.byteOffset : view.byteOffset + view.byteLength]
        if len(data) < view.byteLength:
            raise GlbError(f"bufferViews[{index}] leaves its buffer")
        return data, view.byteStride

    def _buffer(self, index: int) -> bytes:
        if index not in self._buffers:
            buffer = entry(self.gltf.buffers, index, "buffers")
            if buffer.uri is None and index > 0:
                raise GlbError(f"buffers[{index}] has no data")
            data = self._binary if buffer.uri is None else _decoded(buffer.uri)
            if len(data) < buffer.byteLength:
                raise GlbError(
                    f"buffers[{index}] has {len(data)} bytes of {buffer.byteLength}: it is cut off"
                )
            self._buffers[index] = data
        return self._buffers[index]


def entry(entries: list[Entry], index: int, name: str) -> Entry:
    """One of a list in the JSON. Raises GlbError if there is none."""
    if index >= len(entries):
        raise GlbError(f"{name}[{index}] is named, but is not there")
    return entries[index]


def _parsed(text: bytes, path: Path) -> Gltf:
    try:
        return Gltf.model_validate(json.loads(text))
    except ValidationError as error:
        why = explain_faults(error).splitlines()[0].strip()
    except (ValueError, RecursionError) as error:  # undecodable text is a ValueError too
        why = str(error)[:200]
    raise InputError(f"{path} is not a readable GLB file: {why}.")


def _check_uris(gltf: Gltf, path: Path) -> None:
    """A GLB carries all its data; it may not point anywhere."""
    for uri in [*(buffer.uri for buffer in gltf.buffers), *(image.uri for image in gltf.images)]:
        if uri is not None and not uri.startswith("data:"):
            raise InputError(
                f"{path} points to '{uri[:80]}'; a GLB must carry its data. Export it again with everything in "
                "one file."
            )


def _decoded(uri: str) -> bytes:
    head, comma, body = uri.partition(",")
    if not comma or not head.endswith(";base64"):
        raise GlbError(f"'{uri[:40]}' is no data in base64")
    try:
        return base64.b64decode(body, validate=True)
    except (binascii.Error, ValueError) as error:
        raise GlbError(f"'{uri[:40]}' is no data in base64: {error}") from None


def _numbers(values: np.ndarray, accessor: Accessor) -> np.ndarray:
    """Floats as they are, normalised integers as the fractions they stand for (glTF 2.0, section 3.11)."""
    if values.dtype.kind == "f":
        return values.astype(np.float64)
    if not accessor.normalized:
        return values.astype(np.int64)
    fractions = values / float(np.iinfo(values.dtype).max)
    return np.maximum(fractions, -1.0)
