"""Parse intrinsics and camera poses in the forms that people write."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from torc.geometry.transforms import make_pose, rotation_from_wxyz

_MATRIX_NAMES = ("K", "k", "cam_K", "camera_matrix", "intrinsic_matrix", "intrinsics")
_LENS = ("coeffs", "distortion_coefficients", "dist", "distortion", "D", "d")
_BESIDE = (*_LENS, "width", "height", "model", "distortion_model", "R", "P", "binning_x", "binning_y")
"""Further entries that camera drivers store with intrinsics."""
_LEAST_DISTORTION = 1e-9


def parse_intrinsics(given: Any) -> np.ndarray:
    """Parse K (3, 3) from a matrix, or from fx, fy, cx, cy (or ppx, ppy) in pixels. A transposed matrix is corrected.

    Raises ValueError for anything else, and for distortion, which a matrix cannot hold.
    """
    if isinstance(given, Mapping):
        return _of_entries(given)
    flat = np.ravel(np.array(given, dtype=object))
    if flat.size == 4:
        raise ValueError(
            "four numbers do not say which is which; give fx, fy, cx and cy by name, or a 3x3 matrix"
        )
    if flat.size in (9, 12):
        given = flat.reshape(3, -1).tolist()
    K = _finite([row[:3] for row in given] if flat.size == 12 else given, 3, 3)
    if np.allclose(K[:, 2], [0, 0, 1]) and not np.allclose(K[2], [0, 0, 1]):
        return K.T.copy()
    return K


def _of_entries(given: Mapping[str, Any]) -> np.ndarray:
    centre = {"cx": "ppx", "cy": "ppy"}
    names = {"fx", "fy", *centre, *centre.values()}
    matrix = [k for k in _MATRIX_NAMES if k in given]
    if unknown := sorted(set(given) - names - {*matrix, *_BESIDE}):
        raise ValueError(f"'{unknown[0]}' is not known; give fx, fy, cx (or ppx), cy (or ppy) in pixels")
    if any(
        np.abs(np.array(given[k], dtype=float)).max(initial=0) > _LEAST_DISTORTION
        for k in _LENS
        if k in given
    ):
        raise ValueError("the lens distorts; undistort the pictures, and leave the coefficients out")
    if matrix:
        return parse_intrinsics(given[matrix[0]])
    if both := [f"{a} and {b}" for a, b in centre.items() if a in given and b in given]:
        raise ValueError(f"{both[0]} are the same; keep one")
    values = [given.get("fx"), given.get("fy"), *(given.get(a, given.get(b)) for a, b in centre.items())]
    fx, fy, cx, cy = _finite(values, 4)
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])


def size_beside(given: Any) -> tuple[int, int] | None:
    """Return width and height if they are stored with the intrinsics."""
    if not isinstance(given, Mapping) or not {"width", "height"} <= set(given):
        return None
    width, height = _finite([given["width"], given["height"]], 2)
    return int(width), int(height)


def parse_pose(given: Any) -> np.ndarray:
    """Parse a camera pose: a matrix (4, 4) or (3, 4), or position and unit quaternion (wxyz, or xyzw under that name).

    Raises ValueError for anything else.
    """
    if not isinstance(given, Mapping):
        flat = np.ravel(np.array(given, dtype=object))
        if flat.size == 12 and np.shape(given) == (3, 4):
            return np.vstack([_finite(given, 3, 4), [0, 0, 0, 1.0]])
        return _finite(flat.reshape(4, 4).tolist() if flat.size == 16 else given, 4, 4)
    orders = [k for k in ("wxyz", "xyzw") if k in given]
    if "position" not in given or len(orders) != 1 or len(given) != 2:
        raise ValueError("need position (3) and wxyz (4; or xyzw), or a 4x4 matrix")
    wxyz = np.roll(_finite(given[orders[0]], 4), 1 if orders[0] == "xyzw" else 0)
    if abs(np.linalg.norm(wxyz) - 1) > 1e-2:
        raise ValueError(f"{given[orders[0]]} is no unit quaternion ({orders[0][0]} first)")
    return make_pose(rotation_from_wxyz(wxyz), _finite(given["position"], 3))


def _finite(value: Any, *shape: int) -> np.ndarray:
    """Return finite numbers of that shape. Raises ValueError."""
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError):
        array = np.zeros(0)
    if array.shape != shape or not np.isfinite(array).all():
        raise ValueError(f"need {'x'.join(map(str, shape))} finite numbers, not {str(value)[:120]}")
    return array
