"""Label images in which the table has a number of its own, as UOIS and OCID write them: 0, 1 the table, 2 and more."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float, Float32

from torc.errors import InputError
from torc.pipeline.frames.forms import StoredFrame

_CANDIDATES = (1, 2)
_LEAST_SHARE = 0.12
"""Of the picture that a table takes up."""
_FLAT_M, _FLAT_SHARE = 0.02, 0.85
_ABOVE_SHARE = 0.9
_FEWEST = 200


def without_table(
    stored: StoredFrame, depth_m: Float32[np.ndarray, "h w"]
) -> tuple[StoredFrame, tuple[str, ...]]:
    """The frame with the table taken for background, and what to say of that. A frame whose labels have no table comes
    back as it is. Raises InputError if the table is the target.
    """
    labels, given = stored.labels, stored.settings
    if labels is None or given.background not in (None, 0) or labels.min() < 0:
        return stored, ()
    table = next((k for k in _CANDIDATES if _is_table(labels, k, depth_m, given.K)), None)
    if table is None:
        return stored, ()
    if given.target == table:
        raise InputError(
            f"{stored.where}, key target: label {table} is the table: it is flat and the other objects stand on it. "
            "Give the label of an object."
        )
    also = np.isin(labels, range(1, table + 1))
    message = f"Label {table} is taken for the table, and so for background: it is flat, and the other objects stand on it."
    return replace(stored, labels=np.where(also, 0, labels)), (message,)


def _is_table(
    labels: np.ndarray, number: int, depth_m: Float32[np.ndarray, "h w"], K: Float[np.ndarray, "3 3"]
) -> bool:
    """Whether a label is large and flat, and the labels above it stand on it."""
    mask, others = (labels == number) & (depth_m > 0), (labels > number) & (depth_m > 0)
    if mask.sum() < max(_FEWEST, _LEAST_SHARE * labels.size) or others.sum() < _FEWEST // 4:
        return False
    points, standing = _points(mask, depth_m, K), _points(others, depth_m, K)
    normal, offset = _plane(points)
    flat = np.abs(points @ normal - offset) < _FLAT_M
    above = standing @ normal - offset > -_FLAT_M
    return bool(flat.mean() > _FLAT_SHARE and above.mean() > _ABOVE_SHARE)


def _points(mask: np.ndarray, depth_m: np.ndarray, K: np.ndarray) -> Float[np.ndarray, "n 3"]:
    rows, cols = np.nonzero(mask)
    step = max(1, len(rows) // 4000)
    rows, cols = rows[::step], cols[::step]
    z = depth_m[rows, cols].astype(float)
    return np.stack([(cols - K[0, 2]) / K[0, 0] * z, (rows - K[1, 2]) / K[1, 1] * z, z], axis=-1)


def _plane(points: Float[np.ndarray, "n 3"]) -> tuple[Float[np.ndarray, "3"], float]:
    """Unit normal towards the camera, and offset along it; points far from the plane are left out step by step."""
    kept = points
    for _ in range(4):
        middle = kept.mean(axis=0)
        normal = np.linalg.svd(kept - middle, full_matrices=False)[2][2]
        normal = -normal if normal @ middle > 0 else normal
        distance = np.abs((points - middle) @ normal)
        kept = points[distance <= max(float(np.median(distance)) * 2, _FLAT_M / 2)]
    return normal, float(normal @ middle)
