"""A marker taped to the table: `torc lab check` uses it to notice that the camera or the table has moved."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from torc import InputError
from torc.geometry.transforms import Pose, project, transform_points
from torc_lab.calibration.board import DICTIONARY, planar_pose
from torc_lab.cameras.poses import read_mapping
from torc_lab.lab_file import Lab
from torc_lab.protocols import LabError

MARKER_ID = 99
"""Higher than any marker's id on a board."""
MARKER_M = 0.1
MOVED_M = 0.003
"""A shift above the detection's own error, and as large as a calibration's error may be."""
_STILL_PX = 2.0


@dataclass(frozen=True)
class TableMarker:
    """The marker's corners at the calibration, world frame, metres: clockwise from its upper left."""

    corners: Float[np.ndarray, "4 3"]


def find_marker(gray: UInt8[np.ndarray, "h w"]) -> Float[np.ndarray, "4 2"] | None:
    """Return the marker's corners in a picture, column and row; None unless it is in sight exactly once."""
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
    """Return the marker's place, from its corners in pictures of one camera at rest.

    Returns None without pictures, or if no pose fits. Raises LabError if the marker moved between pictures.
    """
    if not seen:
        return None
    middle = np.median(np.stack(seen), axis=0)
    if max(np.linalg.norm(s - middle, axis=1).mean() for s in seen) > _STILL_PX:
        raise LabError(
            "The marker on the table, or the camera, moved while pictures were taken. Begin again."
        )
    square = 0.5 * MARKER_M * np.array([[-1.0, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]])
    T_camera_marker = planar_pose(square, middle, K)
    if T_camera_marker is None:
        return None
    return TableMarker(transform_points(T_world_camera @ T_camera_marker, square))


def marker_shift_m(
    marker: TableMarker,
    gray: UInt8[np.ndarray, "h w"],
    K: Float[np.ndarray, "3 3"],
    T_world_camera: Pose,
) -> float | None:
    """Return how far the marker seems to have moved, across the line of sight; None if it is not in sight."""
    found = find_marker(gray)
    if found is None:
        return None
    columns, rows, depth_m = project(marker.corners, K, T_world_camera)
    off_px = np.linalg.norm(np.column_stack([columns, rows]) - found, axis=1).mean()
    return float(off_px * depth_m.mean() / K[0, 0])


def is_calibrated(lab: Lab) -> bool:
    """Return whether the lab file names a calibration as its camera's pose."""
    return _calibration_of(lab) is not None


def marker_of_lab(lab: Lab) -> TableMarker | None:
    """Return the table's marker as the calibration saw it; None without one. Raises InputError."""
    path = _calibration_of(lab)
    return None if path is None else marker_of_file(path)


def marker_of_file(path: Path) -> TableMarker | None:
    """Return the marker in a calibration file; None if it has none. Raises InputError if it cannot be read."""
    given = read_mapping(path, "calibration", "Calibrate again.").get("marker_corners")
    if given is None:
        return None
    try:
        corners = np.array(given, dtype=float)
    except (TypeError, ValueError):
        corners = np.zeros(0)
    if corners.shape != (4, 3) or not np.isfinite(corners).all():
        raise InputError(f"{path}: marker_corners is not four corners of three numbers. Calibrate again.")
    return TableMarker(corners)


def marker_picture(pixels: int) -> UInt8[np.ndarray, "h w"]:
    """Return the marker as a picture, to be printed MARKER_M wide."""
    dictionary = cv2.aruco.getPredefinedDictionary(DICTIONARY)
    return np.asarray(cv2.aruco.generateImageMarker(dictionary, MARKER_ID, pixels))


def _calibration_of(lab: Lab) -> Path | None:
    path = Path(str(lab.conditions.settings.get("camera.pose", "")))
    return path if path.suffix in (".yaml", ".yml") and path.is_file() else None
