"""One value out of a frame's file: of the right kind, shape and plausible amount, or an InputError.

`where` names file and key in its text.
"""

from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float32, Int64, UInt8

from torc.errors import InputError
from torc.records import VoxelGrid

MAX_SIDE_PX, MIN_SIDE_PX = 8192, 16
MAX_PIXELS = 20_000_000
_MAX_TEXT = 500


def check_regular(path: Path) -> None:
    """Refuses what is there and no regular file: reading a pipe would wait for ever."""
    if path.exists() and not path.is_file():
        raise InputError(f"{path} is no regular file. Store the frame in one, and give that.")


def check_size(where: str, shape: tuple[int, ...]) -> None:
    """Refuses images that are tiny or huge."""
    h, w = shape[:2]
    if min(h, w) < MIN_SIDE_PX or max(h, w) > MAX_SIDE_PX or h * w > MAX_PIXELS:
        raise InputError(
            f"{where} is {w}x{h} pixels; sides must be {MIN_SIDE_PX}..{MAX_SIDE_PX} and at most "
            f"{MAX_PIXELS // 10**6} megapixels in all. Scale the images and K."
        )


def as_color(where: str, rgb: np.ndarray) -> UInt8[np.ndarray, "h w 3"]:
    """A colour image."""
    if rgb.ndim != 3 or rgb.shape[2] != 3 or rgb.dtype != np.uint8:
        raise InputError(f"{where}: {rgb.dtype} {rgb.shape}; need uint8 of shape (h, w, 3), red first.")
    check_size(where, rgb.shape)
    return rgb


def as_labels(where: str, labels: np.ndarray) -> Int64[np.ndarray, "h w"]:
    """An instance number per pixel."""
    if labels.ndim != 2 or labels.dtype.kind not in "iu":
        raise InputError(
            f"{where}: {labels.dtype} {labels.shape}; need integers of shape (h, w), one instance number per pixel. "
            "A colour-coded picture has to be turned into numbers first."
        )
    return labels.astype(np.int64)


def scaled_depth(where: str, depth: np.ndarray, scale: Any, scale_key: str) -> Float32[np.ndarray, "h w"]:
    """Depth in metres out of whole numbers and metres per unit."""
    if depth.ndim != 2 or depth.dtype.kind not in "iu" or depth.dtype.itemsize < 2:
        raise InputError(
            f"{where}: {depth.dtype} {depth.shape}; need integers of 16 bits or more, shape (h, w)."
        )
    factor = as_number(f"{where}, {scale_key}", scale)
    if not 1e-6 <= factor <= 0.1:
        raise InputError(f"{where}: {scale_key} is {factor} metres per unit; 0.001 means millimetres.")
    return (depth * factor).astype(np.float32)


def as_matrix(where: str, value: Any, shape: tuple[int, ...]) -> np.ndarray:
    """Finite numbers of that shape."""
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError):
        array = np.zeros(0)
    if array.shape != shape or not np.isfinite(array).all():
        raise InputError(f"{where}: need {'x'.join(map(str, shape))} finite numbers, not {str(value)[:120]}.")
    return array


def as_grid(where: str, value: Any) -> VoxelGrid:
    """A voxel grid out of what frame.json's `grid` holds."""
    if not isinstance(value, dict) or set(value) != {"origin", "voxel_size_m", "shape"}:
        raise InputError(f"{where}: need origin (3), voxel_size_m and shape (3).")
    origin = as_matrix(f"{where}.origin", value["origin"], (3,))
    size = as_number(f"{where}.voxel_size_m", value["voxel_size_m"])
    shape = as_matrix(f"{where}.shape", value["shape"], (3,))
    whole = bool((shape == np.round(shape)).all() and (shape >= 1).all() and (shape <= 1000).all())
    if not whole or not 0.001 <= size <= 0.1 or shape.prod() > 20e6:
        raise InputError(
            f"{where}: {shape.tolist()} voxels of {size} m; need whole numbers, 1..1000 a side, 20 million "
            "in all, of 0.001..0.1 m."
        )
    return VoxelGrid(origin, size, (int(shape[0]), int(shape[1]), int(shape[2])))


def as_number(where: str, value: Any) -> float:
    """A finite number."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not np.isfinite(value):
        raise InputError(f"{where}: {value!r} is not a finite number.")
    return float(value)


def as_whole(where: str, value: Any) -> int:
    """A whole number."""
    if isinstance(value, bool) or not isinstance(value, int):
        raise InputError(f"{where}: {value!r} is not a whole number.")
    return value


def as_text(where: str, value: Any) -> str:
    """A text of limited length."""
    if not isinstance(value, str) or len(value) > _MAX_TEXT:
        raise InputError(f"{where}: need a text of at most {_MAX_TEXT} characters.")
    return value


def as_names(where: str, value: Any) -> dict[int, str]:
    """Name per label."""
    try:
        return {int(k): str(name)[:_MAX_TEXT] for k, name in value.items()}
    except (AttributeError, TypeError, ValueError) as error:
        raise InputError(f'{where}: need an object of label: name, e.g. {{"3": "red mug"}}.') from error
