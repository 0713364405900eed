"""A marker taped to the table: by it `torc lab check` notices that the camera, or the table, has moved since the
calibration.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from jaxtyping import Float, UInt8
from scipy.spatial.transform import Rotation

from torc import InputError
from torc.geometry.transforms import Pose, make_pose, project, transform_points
from torc.io.reading import read_plain_text
from torc.io.strict_yaml import parse_plain_yaml
from torc_lab.calibration.board import DICTIONARY
from torc_lab.protocols import LabError

MARKER_ID = 99
"""No board has so many markers."""
MARKER_M = 0.1
MOVED_M = 0.003
"""A shift that is more than the detection's own error, and as large as a calibration may be off."""
_MAX_BYTES = 100_000


@dataclass(frozen=True)
class TableMarker:
    """Where the marker's corners were at the calibration, world frame, metres: clockwise from its upper left."""

    corners: Float[np.ndarray, "4 3"]


def find_marker(gray: UInt8[np.ndarray, "h w"]) -> Float[np.ndarray, "4 2"] | None:
    """The corners of the marker in a picture, column and row; None if it is not in sight."""
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(DICTIONARY), parameters)
    corners, ids, _ = detector.detectMarkers(gray)
    found = [] if ids is None else [c for c, k in zip(corners, ids.ravel()) if k == MARKER_ID]
    # Two of them tell nothing: which one was it?
    return np.asarray(found[0], dtype=float).reshape(4, 2) if len(found) == 1 else None


def placed_marker(
    seen: Sequence[Float[np.ndarray, "4 2"]], K: Float[np.ndarray, "3 3"], T_world_camera: Pose
) -> TableMarker | None:
    """Where the marker is, by its corners in some pictures of the same camera; None without any. Raises LabError if it
    moved between them.
    """
    if not seen:
        return None
    middle = np.median(np.stack(seen), axis=0)
    off_px = max(float(np.linalg.norm(s - middle, axis=1).mean()) for s in seen)
    if off_px > 2.0:
        raise LabError(
            "The marker on the table, or the camera, moved while pictures were taken. Begin again."
        )
    square = 0.5 * MARKER_M * np.array([[-1.0, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]])
    good, turn, place = cv2.solvePnP(square, middle, K, None, flags=cv2.SOLVEPNP_IPPE_SQUARE)
    if not good:
        return None
    T_camera_marker = make_pose(Rotation.from_rotvec(np.ravel(turn)).as_matrix(), np.ravel(place))
    return TableMarker(transform_points(T_world_camera @ T_camera_marker, square))


def marker_shift_m(
    marker: TableMarker,
    gray: UInt8[np.ndarray, "h w"],
    K: Float[np.ndarray, "3 3"],
    T_world_camera: Pose,
) -> float | None:
    """How far the marker seems to have moved, across the line of sight; None if it is not in sight."""
    found = find_marker(gray)
    if found is None:
        return None
    columns, rows, depth_m = project(marker.corners, K, T_world_camera)
    off_px = np.linalg.norm(np.column_stack([columns, rows]) - found, axis=1).mean()
    return float(off_px * depth_m.mean() / K[0, 0])


def marker_of_file(path: Path) -> TableMarker | None:
    """The marker that a calibration noted; None if it saw none. Raises InputError for one that cannot be read."""
    text = read_plain_text(path, _MAX_BYTES, "the calibration")
    content = parse_plain_yaml(text, str(path), "calibration", _MAX_BYTES, "Calibrate again.")
    told: Any = content.get("marker_corners") if isinstance(content, dict) else None
    if told is None:
        return None
    try:
        corners = np.array(told, dtype=float)
    except (TypeError, ValueError):
        corners = np.zeros(0)
    if corners.shape != (4, 3) or not np.isfinite(corners).all():
        raise InputError(f"{path}: marker_corners is not four corners of three numbers. Calibrate again.")
    return TableMarker(corners)


def marker_picture(pixels: int) -> UInt8[np.ndarray, "h w"]:
    """The marker, to be printed MARKER_M wide."""
    dictionary = cv2.aruco.getPredefinedDictionary(DICTIONARY)
    return np.asarray(cv2.aruco.generateImageMarker(dictionary, MARKER_ID, pixels))
