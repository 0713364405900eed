"""Label images in which the table has a number of its own, as UOIS and OCID write them: 0, 1 the table, 2 and more."""

from dataclasses import replace

import cv2
import numpy as np
from jaxtyping import Float, Float32

from torc.errors import InputError
from torc.pipeline.frames.level import largest_plane
from torc.pipeline.frames.stored import StoredFrame

_CANDIDATES = (1, 2)
_LEAST_SHARE = 0.12
"""Of the picture that a table takes up."""
_LEAST_ON_PLANE, _MOST_RISING = 0.3, 0.1
"""Of a table's pixels: those on its plane, and those above that. Others may show the floor."""
_FLAT_M = 0.02
_BESIDE = 0.15
"""How wide a band around the objects is looked at, as a share of the picture's height."""
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
    message = (
        f"Label {table} is taken for the table, and so for background: it is flat, and the others stand on it. If it "
        "is an object, give it a number above 2."
    )
    return replace(stored, labels=np.where(also, 0, labels)), (message,)


def _is_table(
    labels: np.ndarray, number: int, depth_m: Float32[np.ndarray, "h w"], K: Float[np.ndarray, "3 3"]
) -> bool:
    """Whether a label is large and flat, and the labels above it stand on it."""
    mask, others = (labels == number) & (depth_m > 0), (labels > number) & (depth_m > 0)
    if mask.sum() < max(_FEWEST, _LEAST_SHARE * labels.size) or others.sum() < _FEWEST // 4:
        return False
    reach = np.ones((int(_BESIDE * labels.shape[0]),) * 2, np.uint8)
    beside = mask & (cv2.dilate(others.astype(np.uint8), reach) > 0)  # elsewhere it may be the floor
    if beside.sum() < _FEWEST:
        return False
    points, standing = _points(beside, depth_m, K), _points(others, depth_m, K)
    up, camera_m, on_it = largest_plane(points)
    if on_it.mean() < _LEAST_ON_PLANE:
        return False
    rises = points @ up + camera_m > _FLAT_M
    above = standing @ up + camera_m > -_FLAT_M
    return bool(rises.mean() < _MOST_RISING and above.mean() > _ABOVE_SHARE)


def _points(mask: np.ndarray, depth_m: np.ndarray, K: np.ndarray) -> Float[np.ndarray, "n 3"]:
    rows, cols = np.nonzero(mask)
    step = max(1, len(rows) // 4000)
    rows, cols = rows[::step], cols[::step]
    z = depth_m[rows, cols].astype(float)
    return np.stack([(cols - K[0, 2]) / K[0, 0] * z, (rows - K[1, 2]) / K[1, 1] * z, z], axis=-1)
