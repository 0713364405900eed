"""Surfaces as arrays, entries and textures: how object files store them."""

import io
import warnings
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import UInt8
from PIL import Image

from torc.errors import InputError
from torc.files.reading import ArraySpec, read_bytes
from torc.objects.models import VisualMesh
from torc.objects.schema import MAX_FACES, MAX_TEXTURE_PX, MAX_VERTICES, VisualEntry

MAX_PNG_BYTES = 32 * 2**20
_UNREADABLE = (
    Image.DecompressionBombError,
    Image.DecompressionBombWarning,
    OSError,  # PIL's "unidentified" and "truncated" too
    SyntaxError,
    ValueError,
    zlib.error,
)


def visual_arrays(visuals: Sequence[VisualMesh]) -> dict[str, np.ndarray]:
    """The surfaces' arrays by name, as they are stored."""
    arrays = {}
    for i, visual in enumerate(visuals):
        arrays[f"visual_{i}_vertices"] = np.ascontiguousarray(visual.vertices, dtype=np.float64)
        arrays[f"visual_{i}_faces"] = np.ascontiguousarray(visual.faces, dtype=np.int32)
        for key, values in (("uv", visual.uv), ("normals", visual.normals)):
            if values is not None:
                arrays[f"visual_{i}_{key}"] = np.ascontiguousarray(values, dtype=np.float64)
    return arrays


def visual_entries(visuals: Sequence[VisualMesh]) -> list[dict[str, Any]]:
    """The rest of the surfaces as plain data; see `VisualEntry`."""
    return [
        {
            "rgba": [float(v) for v in visual.rgba],
            "texture": None if visual.texture is None else f"texture_{i}.png",
            "uv": visual.uv is not None,
            "normals": visual.normals is not None,
        }
        for i, visual in enumerate(visuals)
    ]


def save_textures(visuals: Sequence[VisualMesh], directory: Path) -> None:
    """Writes the textures that the entries name."""
    for i, visual in enumerate(visuals):
        if visual.texture is not None:
            Image.fromarray(visual.texture).save(directory / f"texture_{i}.png")


def visual_specs(entries: Sequence[VisualEntry]) -> dict[str, ArraySpec]:
    """Which arrays the surfaces must have."""
    specs = {}
    for i, visual in enumerate(entries):
        specs[f"visual_{i}_vertices"] = ArraySpec("f", 3, MAX_VERTICES)
        specs[f"visual_{i}_faces"] = ArraySpec("i", 3, MAX_FACES)
        if visual.uv:
            specs[f"visual_{i}_uv"] = ArraySpec("f", 2, MAX_VERTICES)
        if visual.normals:
            specs[f"visual_{i}_normals"] = ArraySpec("f", 3, MAX_VERTICES)
    return specs


def read_visuals(
    entries: Sequence[VisualEntry], arrays: Mapping[str, np.ndarray], directory: Path
) -> tuple[VisualMesh, ...]:
    """The surfaces, with their textures out of `directory`. Raises InputError."""
    _check(entries, arrays, directory)
    return tuple(_visual(i, entry, arrays, directory) for i, entry in enumerate(entries))


def _check(entries: Sequence[VisualEntry], arrays: Mapping[str, np.ndarray], directory: Path) -> None:
    for i, visual in enumerate(entries):
        count = len(arrays[f"visual_{i}_vertices"])
        if arrays[f"visual_{i}_faces"].max() >= count:
            raise InputError(f"{directory}: visual_{i}_faces points beyond the {count} vertices.")
        for key, wanted in (("uv", visual.uv), ("normals", visual.normals)):
            if wanted and len(arrays[f"visual_{i}_{key}"]) != count:
                raise InputError(f"{directory}: visual_{i}_{key} must have one row per vertex.")


def _texture(path: Path) -> UInt8[np.ndarray, "h w 3"]:
    """A PNG's colours, transparency dropped. Raises InputError."""
    data = read_bytes(path, MAX_PNG_BYTES, "a texture")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            with Image.open(io.BytesIO(data), formats=("PNG",)) as image:
                if max(image.size) > MAX_TEXTURE_PX:
                    raise InputError(
                        f"{path} is {image.width}x{image.height} pixels; at most {MAX_TEXTURE_PX} a side are allowed. "
                        "Scale it down."
                    )
                return np.array(image.convert("RGB"))
    except _UNREADABLE as error:
        raise InputError(f"{path} is no readable picture (PNG): {error}. Save it anew as a PNG.") from None


def _visual(i: int, entry: VisualEntry, arrays: Mapping[str, np.ndarray], directory: Path) -> VisualMesh:
    return VisualMesh(
        arrays[f"visual_{i}_vertices"],
        arrays[f"visual_{i}_faces"],
        arrays.get(f"visual_{i}_uv"),
        None if entry.texture is None else _texture(directory / entry.texture),
        entry.rgba,
        arrays.get(f"visual_{i}_normals"),
    )
