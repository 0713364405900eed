"""The ChArUco board: print it, find it in pictures, and estimate its pose and that pose's covariance."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import cv2
import numpy as np
from jaxtyping import Float, Int64, UInt8
from scipy.spatial.transform import Rotation

from torc import InputError
from torc.geometry.transforms import Pose, invert, make_pose, project
from torc_lab.calibration.noisy_arm import PoseView, crossing
from torc_lab.protocols import LabError

_LEAST_CORNERS = 8
_LEAST_PX = 0.01
DICTIONARY = cv2.aruco.DICT_5X5_100


@dataclass(frozen=True)
class Board:
    """A chessboard of columns x rows squares, with markers in the white ones.

    Corners are numbered row by row. The board's frame lies in its plane; z points away from the viewer.
    """

    columns: int = 7
    rows: int = 5
    square_m: float = 0.03
    marker_m: float = 0.022

    def __post_init__(self) -> None:
        counts = 3 <= self.columns <= 14 and 3 <= self.rows <= 14
        if not (counts and 0.005 <= self.square_m <= 0.2 and 0.4 < self.marker_m / self.square_m < 0.9):
            raise InputError(
                f"No board: {self}. It has 3 to 14 columns and rows, squares of 5 to 200 mm, and markers of .4 to .9 "
                "of a square. Sizes are in metres."
            )

    @cached_property
    def corners(self) -> Float[np.ndarray, "n 3"]:
        """The inner corners in the board's frame, by id, metres."""
        return np.asarray(self._cv.getChessboardCorners(), dtype=float)

    @property
    def size_m(self) -> tuple[float, float]:
        """Width and height of all squares, without a margin."""
        return self.columns * self.square_m, self.rows * self.square_m

    @property
    def outline(self) -> Float[np.ndarray, "4 3"]:
        """The outer corners of all squares, in the board's frame, metres."""
        width, height = self.size_m
        return np.array([[0.0, 0, 0], [width, 0, 0], [width, height, 0], [0, height, 0]])

    def picture(self, pixels_per_m: float) -> UInt8[np.ndarray, "h w"]:
        """Return the board as a picture to print, without a margin."""
        width, height = (round(s * pixels_per_m) for s in self.size_m)
        return np.asarray(self._cv.generateImage((width, height)))

    def find(self, gray: UInt8[np.ndarray, "h w"]) -> "FoundCorners | None":
        """Return the corners in a picture; None if there are too few. Raises LabError if the board is mirrored."""
        found = self._detected(gray)
        if found is None and self._detected(np.ascontiguousarray(gray[:, ::-1])) is not None:
            raise LabError(
                "The board is mirrored: it was printed the wrong way round, or the picture is mirrored. "
                "Print it again, or set the camera right."
            )
        return found

    @cached_property
    def _cv(self) -> Any:
        dictionary = cv2.aruco.getPredefinedDictionary(DICTIONARY)
        return cv2.aruco.CharucoBoard((self.columns, self.rows), self.square_m, self.marker_m, dictionary)

    def _detected(self, gray: UInt8[np.ndarray, "h w"]) -> "FoundCorners | None":
        pixels, ids, _, _ = cv2.aruco.CharucoDetector(self._cv).detectBoard(gray)
        if ids is None or len(ids) < _LEAST_CORNERS:
            return None
        return FoundCorners(ids.ravel().astype(np.int64), np.asarray(pixels, float).reshape(-1, 2))


@dataclass(frozen=True)
class FoundCorners:
    """Corners of a board in one picture: their ids, and column and row, pixels."""

    ids: Int64[np.ndarray, "n"]
    pixels: Float[np.ndarray, "n 2"]


@dataclass(frozen=True)
class BoardView:
    """One picture of the board, and the flange's pose at that moment."""

    T_base_flange: Pose
    corners: FoundCorners


def planar_pose(
    points: Float[np.ndarray, "n 3"], pixels: Float[np.ndarray, "n 2"], K: Float[np.ndarray, "3 3"]
) -> Pose | None:
    """Return the pose in the camera of a flat object, by the least reprojection error; None if no pose fits.

    Args:
        points: of the object, in its own frame, metres.
        pixels: the same points in the picture, column and row.
        K: intrinsics, pixels.
    """
    good, turn, place = cv2.solvePnP(points, pixels, K, None, flags=cv2.SOLVEPNP_IPPE)
    if not good:
        return None
    turn, place = cv2.solvePnPRefineLM(points, pixels, K, None, turn, place)
    return make_pose(Rotation.from_rotvec(np.ravel(turn)).as_matrix(), np.ravel(place))


def board_in_camera(view: BoardView, board: Board, K: Float[np.ndarray, "3 3"]) -> Pose:
    """Return T_camera_board for one picture. Raises LabError if no pose fits the corners."""
    pose = planar_pose(board.corners[view.corners.ids], view.corners.pixels, K)
    if pose is None:
        raise LabError("A picture's corners do not fit a board: is it bent?")
    return pose


def pose_views(views: Sequence[BoardView], board: Board, K: Float[np.ndarray, "3 3"]) -> list[PoseView]:
    """Return the board's pose in every picture, with its covariance. Raises LabError."""
    poses = [board_in_camera(v, board, K) for v in views]
    off = [reprojection_errors_px(v, T, board, K) for v, T in zip(views, poses, strict=True)]
    noise_px = max(float(np.median([np.sqrt((e**2).sum() / (e.size - 6)) for e in off])), _LEAST_PX)
    return [
        PoseView(v.T_base_flange, T, noise_px**2 * _covariance(board.corners[v.corners.ids], T, K))
        for v, T in zip(views, poses, strict=True)
    ]


def reprojection_errors_px(
    view: BoardView, T_camera_board: Pose, board: Board, K: Float[np.ndarray, "3 3"]
) -> Float[np.ndarray, "n 2"]:
    """Return the corners' predicted positions less those seen, column and row, pixels."""
    columns, rows, _ = project(board.corners[view.corners.ids], K, invert(T_camera_board))
    return np.asarray(np.column_stack([columns, rows]) - view.corners.pixels)


def _covariance(
    points: Float[np.ndarray, "n 3"], T: Pose, K: Float[np.ndarray, "3 3"]
) -> Float[np.ndarray, "6 6"]:
    """Return the covariance of the board's pose in its own frame, for corner errors of one pixel in each direction."""
    R = T[:3, :3]
    slopes = cv2.projectPoints(points, cv2.Rodrigues(R)[0], T[:3, 3], K, None)[1]
    of_pixels = slopes[:, 3:6].reshape(-1, 2, 3)  # by the board's place in the camera's frame
    of_points = np.concatenate([-R @ crossing(points), np.broadcast_to(R, (len(points), 3, 3))], axis=2)
    J = (of_pixels @ of_points).reshape(-1, 6)
    return np.asarray(np.linalg.inv(J.T @ J))
