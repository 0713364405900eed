"""The binary form of glTF 2.0: its JSON, and the numbers and pictures that its accessors and images point to."""

import base64
import binascii
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from jaxtyping import Int, Shaped
from pydantic import BaseModel, ValidationError

from torc.errors import InputError
from torc.files.strict_yaml import explain_faults
from torc.scenes.importing.reading.gltf.chunks import json_and_binary
from torc.scenes.importing.reading.gltf.schema import (
    Accessor,
    Fallback,
    Gltf,
    ImageEntry,
    Primitive,
    Sparse,
    compressed,
    compression,
    refusal,
)
from torc.scenes.importing.reading.limits import MAX_FILE_NUMBERS

_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
Entry = TypeVar("Entry")
Model = TypeVar("Model", bound=BaseModel)


class GlbError(ValueError):
    """The file is not what the standard says; the text tells where."""


@dataclass(frozen=True, eq=False)
class Corners:
    """Those of a part's corners that its triangles use: other parts may use the rest.

    Attributes:
        count: how many the part has.
        used: the places of those in use; None: all.
    """

    count: int
    used: Int[np.ndarray, "k"] | None = None


class Glb:
    """A GLB file's content.

    Attributes:
        gltf: its JSON.
    """

    def __init__(self, data: bytes, path: Path) -> None:
        """Raises InputError: no JSON, not understood without an extension, or it points to other files."""
        text, self._binary = json_and_binary(data, path)
        self.gltf = _parsed(text, path)
        refused = refusal(self.gltf)
        if refused:
            raise InputError(f"{path} {refused}")
        _check_uris(self.gltf, path)
        self._path, self._left = path, MAX_FILE_NUMBERS
        self._buffers: dict[int, bytes] = {}
        self._sparse: dict[int, np.ndarray] = {}

    def count(self, index: int) -> int:
        """How many elements an accessor has. Raises GlbError."""
        return self._accessor(index).count

    def values(
        self, index: int, kind: tuple[str, ...], corners: Corners | None = None
    ) -> Shaped[np.ndarray, "n k"]:
        """The numbers of an accessor, one row per element: float64 if they are floats or normalised, else int64.

        Args:
            index: of the accessor.
            kind: which of "SCALAR", "VEC2", ... it may be.
            corners: it has one element for each of these, and only those in use are unpacked; None: all are.

        Raises:
            GlbError: there is no such accessor, it is of another kind, leaves its data, or the file's are too many.
        """
        accessor, where = self._accessor(index), f"accessors[{index}]"
        if accessor.type not in kind or accessor.type not in _WIDTHS:
            raise GlbError(f"{where} is {accessor.type}, not {' or '.join(kind)}")
        if corners is not None and corners.count != accessor.count:
            raise GlbError(f"{where} has {accessor.count} elements for {corners.count} corners")
        values = self._stored(accessor, where)
        if accessor.sparse is not None:
            if index not in self._sparse:
                self._spend(values.size)
                self._sparse[index] = self._substituted(values.copy(), accessor.sparse, where)
            values = self._sparse[index]
        used = slice(None) if corners is None or corners.used is None else corners.used
        self._spend(values.size if isinstance(used, slice) else used.size * values.shape[1])
        return _numbers(values[used], accessor)

    def image_bytes(self, image: ImageEntry) -> bytes:
        """A picture's file. Raises GlbError."""
        if image.uri is not None:
            return _decoded(image.uri)
        if image.bufferView is None:
            raise GlbError("an image has no data")
        return bytes(self._view(image.bufferView)[0])

    def check_plain(self, primitive: Primitive) -> None:
        """Raises InputError for a part of which there is nothing but what an extension compressed."""
        name = compression(primitive.extensions)
        if name is None:
            return
        indices = [] if primitive.indices is None else [primitive.indices]
        for index in [*primitive.attributes.values(), *indices]:
            accessor = entry(self.gltf.accessors, index, "accessors")
            if not isinstance(accessor, dict) or accessor.get("bufferView") is None:
                raise InputError(f"{self._path} {compressed(name)}")

    def _accessor(self, index: int) -> Accessor:
        return parsed(Accessor, entry(self.gltf.accessors, index, "accessors"), f"accessors[{index}]")

    def _spend(self, numbers: int) -> None:
        """A small file may have many parts use the same numbers, or zeros of which it has none."""
        self._left -= numbers
        if self._left < 0:
            raise GlbError(
                f"its parts use more than {MAX_FILE_NUMBERS} numbers; simplify it, or export it without morph targets"
            )

    def _stored(self, accessor: Accessor, where: str) -> np.ndarray:
        """What an accessor has without substitutions, as it lies in the file: nothing is copied."""
        dtype, width = np.dtype(_TYPES[accessor.componentType]), _WIDTHS[accessor.type]
        if accessor.bufferView is None:
            return np.broadcast_to(np.zeros((), dtype), (accessor.count, width))
        return self._elements(accessor.bufferView, accessor.byteOffset, accessor.count, dtype, width, where)

    def _elements(
        self, view: int, offset: int, count: int, dtype: np.dtype, width: int, where: str
    ) -> np.ndarray:
        data, stride = self._view(view)
        size = dtype.itemsize * width
        stride = size if stride is None else stride
        if stride < size or offset + stride * (count - 1) + size > len(data):
            raise GlbError(f"{where} needs more than the {len(data)} bytes that bufferViews[{view}] has")
        return np.ndarray((count, width), dtype, data, offset, (stride, dtype.itemsize))

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

    def _view(self, index: int) -> tuple[memoryview, int | None]:
        """A buffer view's bytes and stride."""
        view = entry(self.gltf.bufferViews, index, "bufferViews")
        packed = compression(view.extensions)
        if packed is not None and not self._has_data(view.buffer):
            raise InputError(f"{self._path} {compressed(packed)}")
        data = memoryview(self._buffer(view.buffer))[view.byteOffset : view.byteOffset + view.byteLength]
        if len(data) < view.byteLength:
            raise GlbError(f"bufferViews[{index}] leaves its buffer")
        return data, view.byteStride

    def _has_data(self, index: int) -> bool:
        """False for a buffer that only holds the place of one that is unpacked (EXT_meshopt_compression)."""
        buffer = entry(self.gltf.buffers, index, "buffers")
        packed = compression(buffer.extensions)
        content = {} if packed is None else buffer.extensions[packed]
        return buffer.uri is not None or (
            index == 0 and not parsed(Fallback, content, f"{packed} of buffers[0]").fallback
        )

    def _buffer(self, index: int) -> bytes:
        if index not in self._buffers:
            buffer = entry(self.gltf.buffers, index, "buffers")
            if not self._has_data(index):
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


def parsed(schema: type[Model], content: Any, where: str) -> Model:
    """What is only looked at where it is used. Raises GlbError if it is not as it should be."""
    try:
        return schema.model_validate(content)
    except ValidationError as error:
        raise GlbError(f"{where} is not as it should be ({_first_fault(error)})") from None


def _first_fault(error: ValidationError) -> str:
    return explain_faults(error).splitlines()[0].strip()


def _parsed(text: bytes, path: Path) -> Gltf:
    try:
        return Gltf.model_validate(json.loads(text))
    except ValidationError as error:
        why = _first_fault(error)
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
        with np.errstate(invalid="ignore"):  # of a NaN of the kind that signals
            return values.astype(np.float64)
    if not accessor.normalized:
        return values.astype(np.int64)
    fractions = values / float(np.iinfo(values.dtype).max)
    return np.maximum(fractions, -1.0)
