"""Where camera and board are, from pictures of the board at known poses of the flange.

Both transforms are found at once, by the pixels where all corners show (soft L1 on the error of reprojection), from a
closed form (Park & Martin 1994). The error in pixels says little: an arm that is off shifts everything. What
counts is the error at poses that were left out, in millimetres at the board.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
from jaxtyping import Float
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from torc.geometry.transforms import Pose, invert, make_pose
from torc.lab.calibration.board import Board, FoundCorners
from torc.lab.protocols import LabError

Mounting = Literal["fixed", "hand"]
"""Of the camera: fixed, with the board in the hand; or in the hand, with the board fixed."""
LEAST_VIEWS = 6
_LEAST_TURN_RAD, _LEAST_SPREAD_RAD = 0.175, 0.05
"""From the mean turn to the furthest; standard deviation about the axis that is turned about second most."""
_LOSS_PX = 1.0
_WRONG_SCALE = 0.01
_FOLDS = 5


@dataclass(frozen=True)
class BoardView:
    """One picture of the board, and where the flange was."""

    T_base_flange: Pose
    corners: FoundCorners


@dataclass(frozen=True)
class HandEye:
    """A calibration.

    Attributes:
        T_camera: camera (OpenCV axes) in the base (mounting fixed) or in the flange (hand).
        T_board: board in the flange (fixed) or in the base (hand).
        rms_px: of all corners.
        errors_m: per view, how far corners are off on average when that view was left out, at the board, across the
            line of sight.
        scale: of the board that fits best, against what was said: 1.02 means that squares are 2 % larger.
    """

    mounting: Mounting
    T_camera: Pose
    T_board: Pose
    rms_px: float
    errors_m: Float[np.ndarray, "v"]
    scale: float

    @property
    def error_m(self) -> float:
        """The median of `errors_m`."""
        return float(np.median(self.errors_m))


def solve_hand_eye(
    views: Sequence[BoardView], board: Board, K: Float[np.ndarray, "3 3"], mounting: Mounting
) -> HandEye:
    """Raises LabError for views that tell too little: too few, turned too little, or about one axis alone; and for a
    board whose squares are of another size than was said.
    """
    check_views(views)
    numbers = _fit(views, board, K, mounting, _closed_form(views, board, K, mounting))
    scale = _fit(views, board, K, mounting, np.append(numbers, 1.0))[12]
    if abs(scale - 1) > _WRONG_SCALE:
        raise LabError(
            f"The board's squares seem to be {1e3 * board.square_m * scale:.2f} mm wide, not "
            f"{1e3 * board.square_m:.2f} mm. Measure them: printers scale. Then say so."
        )
    T_camera, T_board = _poses(numbers)
    errors = np.zeros(len(views))
    for fold in range(min(_FOLDS, len(views))):
        left_out = np.arange(len(views)) % _FOLDS == fold
        others = [v for v, out in zip(views, left_out, strict=True) if not out]
        fitted = _fit(others, board, K, mounting, numbers)
        for k in map(int, np.flatnonzero(left_out)):
            errors[k] = error_at(views[k], _poses(fitted), board, K, mounting)
    residuals = _residuals(numbers, views, board, K, mounting)
    rms_px = float(np.sqrt(2 * np.mean(residuals**2)))
    return HandEye(mounting, T_camera, T_board, rms_px, errors, float(scale))


def check_views(views: Sequence[BoardView]) -> None:
    """Raises LabError for views that cannot tell both transforms."""
    if len(views) < LEAST_VIEWS:
        raise LabError(f"{len(views)} pictures of the board are too few: at least {LEAST_VIEWS}, better 20.")
    first = views[0].T_base_flange[:3, :3]
    turns = np.array([Rotation.from_matrix(first.T @ v.T_base_flange[:3, :3]).as_rotvec() for v in views])
    turns -= turns.mean(axis=0)
    spread = np.linalg.svd(turns, compute_uv=False) / np.sqrt(len(views))
    if np.linalg.norm(turns, axis=1).max() < _LEAST_TURN_RAD or spread[1] < _LEAST_SPREAD_RAD:
        raise LabError(
            "The flange was turned too little, or about one axis alone: turn it by 20 to 35 degrees about several."
        )


def error_at(
    view: BoardView, poses: tuple[Pose, Pose], board: Board, K: Float[np.ndarray, "3 3"], mounting: Mounting
) -> float:
    """Mean distance between where corners are by a calibration, and the lines of sight on which they were seen."""
    in_camera = _in_camera(view, *poses, mounting, board.corners[view.corners.ids])
    rays = np.column_stack([view.corners.pixels, np.ones(len(view.corners.pixels))]) @ np.linalg.inv(K).T
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    along = (in_camera * rays).sum(axis=1, keepdims=True)
    return float(np.linalg.norm(in_camera - along * rays, axis=1).mean())


def _in_camera(
    view: BoardView, T_camera: Pose, T_board: Pose, mounting: Mounting, points: np.ndarray
) -> np.ndarray:
    """Points of the board in the camera's frame."""
    flange = view.T_base_flange
    if mounting == "fixed":
        T = invert(T_camera) @ flange @ T_board
    else:
        T = invert(flange @ T_camera) @ T_board
    return np.asarray(points @ T[:3, :3].T + T[:3, 3])


def _poses(numbers: np.ndarray) -> tuple[Pose, Pose]:
    first, second = (
        make_pose(Rotation.from_rotvec(v[:3]).as_matrix(), v[3:]) for v in (numbers[:6], numbers[6:12])
    )
    return first, second


def _residuals(
    numbers: np.ndarray, views: Sequence[BoardView], board: Board, K: np.ndarray, mounting: Mounting
) -> np.ndarray:
    poses, scale = _poses(numbers), numbers[12] if len(numbers) > 12 else 1.0
    out = []
    for view in views:
        p = _in_camera(view, *poses, mounting, scale * board.corners[view.corners.ids])
        z = np.maximum(p[:, 2], 0.01)
        seen = np.column_stack([K[0, 0] * p[:, 0] / z + K[0, 2], K[1, 1] * p[:, 1] / z + K[1, 2]])
        out.append((seen - view.corners.pixels).ravel())
    return np.concatenate(out)


def _fit(
    views: Sequence[BoardView], board: Board, K: np.ndarray, mounting: Mounting, begin: np.ndarray
) -> np.ndarray:
    """The twelve numbers of both transforms, and the board's scale as the thirteenth where `begin` has one."""
    fitted = least_squares(
        _residuals, begin, args=(views, board, K, mounting), loss="soft_l1", f_scale=_LOSS_PX, x_scale="jac"
    )
    return np.asarray(fitted.x)


def _closed_form(views: Sequence[BoardView], board: Board, K: np.ndarray, mounting: Mounting) -> np.ndarray:
    """From the board's pose in each picture."""
    seen = [board_in_camera(v, board, K) for v in views]
    flanges = [v.T_base_flange if mounting == "hand" else invert(v.T_base_flange) for v in views]
    T_camera = _park(flanges, seen)
    boards = [
        v.T_base_flange @ T_camera @ T if mounting == "hand" else invert(v.T_base_flange) @ T_camera @ T
        for v, T in zip(views, seen)
    ]
    R_board = Rotation.from_matrix([T[:3, :3] for T in boards]).mean().as_matrix()
    T_board = make_pose(R_board, np.median([T[:3, 3] for T in boards], axis=0))
    return np.concatenate([_numbers(T_camera), _numbers(T_board)])


def _park(flanges: Sequence[Pose], seen: Sequence[Pose]) -> Pose:
    """X with flange_i X seen_i the same for all i, by the rotations first."""
    moves = [
        (invert(flanges[j]) @ flanges[i], seen[j] @ invert(seen[i]))
        for i in range(len(seen))
        for j in range(i + 1, len(seen))
    ]
    of_flange, of_board = (Rotation.from_matrix([m[k][:3, :3] for m in moves]).as_rotvec() for k in (0, 1))
    R = Rotation.align_vectors(of_flange, of_board)[0].as_matrix()
    left = np.concatenate([A[:3, :3] - np.eye(3) for A, _ in moves])
    right = np.concatenate([R @ B[:3, 3] - A[:3, 3] for A, B in moves])
    return make_pose(R, np.linalg.lstsq(left, right, rcond=None)[0])


def board_in_camera(view: BoardView, board: Board, K: np.ndarray) -> Pose:
    """The board's pose in one picture. Raises LabError."""
    points = board.corners[view.corners.ids]
    good, turn, place = cv2.solvePnP(points, view.corners.pixels, K, None, flags=cv2.SOLVEPNP_IPPE)
    if not good:
        raise LabError("A picture's corners do not fit a board: is it bent?")
    return make_pose(Rotation.from_rotvec(np.ravel(turn)).as_matrix(), np.ravel(place))


def _numbers(T: Pose) -> np.ndarray:
    return np.concatenate([Rotation.from_matrix(T[:3, :3]).as_rotvec(), T[:3, 3]])
