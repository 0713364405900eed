"""Pictures of the board: its pose in each, and how exactly the picture shows it."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from torc.geometry.transforms import Pose, make_pose, transform_points
from torc_lab.calibration.board import Board, FoundCorners
from torc_lab.calibration.noisy_arm import PoseView, crossing
from torc_lab.protocols import LabError

_LEAST_PX = 0.01


@dataclass(frozen=True)
class BoardView:
    """One picture of the board, and where the flange was."""

    T_base_flange: Pose
    corners: FoundCorners


def board_in_camera(view: BoardView, board: Board, K: Float[np.ndarray, "3 3"]) -> Pose:
    """The board's pose in one picture: the smallest error of reprojection. Raises LabError."""
    points = board.corners[view.corners.ids]
    good, turn, place = cv2.solvePnP(points, view.corners.pixels, K, None, flags=cv2.SOLVEPNP_IPPE)
    if not good:
        raise LabError("A picture's corners do not fit a board: is it bent?")
    turn, place = cv2.solvePnPRefineLM(points, view.corners.pixels, K, None, turn, place)
    return make_pose(Rotation.from_rotvec(np.ravel(turn)).as_matrix(), np.ravel(place))


def pose_views(views: Sequence[BoardView], board: Board, K: Float[np.ndarray, "3 3"]) -> list[PoseView]:
    """The board's pose in every picture with its covariance. Raises LabError."""
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
    """Where corners would be by that pose, less where they were seen."""
    p = transform_points(T_camera_board, board.corners[view.corners.ids])
    z = np.maximum(p[:, 2], 0.01)
    shown = np.column_stack([K[0, 0] * p[:, 0] / z + K[0, 2], K[1, 1] * p[:, 1] / z + K[1, 2]])
    return np.asarray(shown - view.corners.pixels)


def _covariance(
    points: Float[np.ndarray, "n 3"], T: Pose, K: Float[np.ndarray, "3 3"]
) -> Float[np.ndarray, "6 6"]:
    """Of the board's pose, in its own frame, for corners that are off by one pixel in each direction."""
    p, R = transform_points(T, points), T[:3, :3]
    of_pixels = np.zeros((len(p), 2, 3))
    of_pixels[:, 0, 0], of_pixels[:, 0, 2] = K[0, 0] / p[:, 2], -K[0, 0] * p[:, 0] / p[:, 2] ** 2
    of_pixels[:, 1, 1], of_pixels[:, 1, 2] = K[1, 1] / p[:, 2], -K[1, 1] * p[:, 1] / p[:, 2] ** 2
    of_points = np.concatenate([-R @ crossing(points), np.broadcast_to(R, (len(p), 3, 3))], axis=2)
    J = (of_pixels @ of_points).reshape(-1, 6)
    return np.asarray(np.linalg.inv(J.T @ J))
