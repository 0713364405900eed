"""Compute the poses of camera and board from pictures of the board at known flange poses.

The board's pose in each picture comes from all of its corners. Both transforms then come from all views at once; each
view is weighted by how well its picture shows the board and by how noisy the arm seems (noisy_arm.py). The error in
pixels says little: an arm that is off shifts all corners together. The error that counts is the one at held-out poses,
in millimetres at the board.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import date
from typing import Any

import numpy as np
import yaml
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from torc.geometry.transforms import Pose, invert, transform_points
from torc_lab.calibration.board import Board, BoardView, pose_views, reprojection_errors_px
from torc_lab.calibration.marker import TableMarker
from torc_lab.calibration.noisy_arm import ArmNoise, Mounting, PoseFit, PoseView, fit_poses, refit
from torc_lab.cameras.poses import ON_HAND
from torc_lab.protocols import LabError

LEAST_VIEWS = 6
_LEAST_TURN_RAD, _LEAST_SPREAD_RAD = 0.175, 0.05
"""Largest turn away from the mean; standard deviation about the axis with the second most turning."""
_WRONG_SCALE, _SURE = 0.01, 4.0
"""The printer is to blame if the squares are off by 1 %, and by four standard errors: a worn arm shifts them too."""
_FOLDS = 5
_WORN_RAD, _WORN_M = float(np.deg2rad(0.15)), 0.0015


@dataclass(frozen=True)
class HandEye:
    """A calibration.

    Attributes:
        T_camera: camera (OpenCV axes) in the base (mounting fixed) or in the flange (hand).
        T_board: board in the flange (fixed) or in the base (hand).
        errors_m: per view, the corners' mean error when that view was held out, at the board, across the line of sight.
        noise: how far the flange seems to be from the pose that the arm reports.
        rms_px: of all corners; None without pictures.
        scale: best-fitting size of the board over its stated size: 1.02 means that squares are 2 % larger.
    """

    mounting: Mounting
    T_camera: Pose
    T_board: Pose
    errors_m: Float[np.ndarray, "v"]
    noise: ArmNoise
    scale: float
    rms_px: float | None = None

    @property
    def error_m(self) -> float:
        """The median of `errors_m`."""
        return float(np.median(self.errors_m))

    def as_yaml(self, count: int, marker: TableMarker | None = None) -> str:
        """Return the calibration file's text; for a fixed camera, a lab file's camera.pose names that file.

        Args:
            count: number of pictures.
            marker: the marker on the table, if it was seen.
        """
        fixed = self.mounting == "fixed"
        content: dict[str, Any] = {
            "T_world_camera" if fixed else ON_HAND: self.T_camera.round(7).tolist(),
            "T_tool0_board" if fixed else "T_world_board": self.T_board.round(7).tolist(),
            "date": date.today().isoformat(),
            "pictures": count,
            "error_mm": round(1e3 * self.error_m, 2),
            "arm_noise_mm": round(1e3 * self.noise.shift_m, 2),
            "arm_noise_deg": round(float(np.rad2deg(self.noise.turn_rad)), 3),
        }
        if self.rms_px is not None:
            content["rms_px"] = round(self.rms_px, 2)
        if marker is not None:
            content["marker_corners"] = marker.corners.round(6).tolist()
        return yaml.safe_dump(content, sort_keys=False, default_flow_style=None)

    def report(self, file: str) -> str:
        """Return the summary for the user after the calibration was written to `file`."""
        noise, (x, y, z) = self.noise, self.T_camera[:3, 3]
        worn = noise.shift_m > _WORN_M or noise.turn_rad > _WORN_RAD
        much = "\nThat is much: the arm is worn, its model is not exact, or the board or camera is loose."
        by_mounting = {
            "fixed": f"The camera is at x {x:.3f}, y {y:.3f}, z {z:.3f} m of the world frame: does it stand there?\n"
            f"{file} is written: name it in the lab file as camera.pose.",
            "hand": f"{file} is written: {ON_HAND}, the camera in the flange's frame. It is no camera.pose: that is "
            "for a fixed camera.",
        }
        return (
            f"At poses that were left out, corners are {1e3 * self.error_m:.1f} mm off (median; worst "
            f"{1e3 * self.errors_m.max():.1f} mm).\n"
            f"The arm seems to be off by {1e3 * noise.shift_m:.1f} mm and {np.rad2deg(noise.turn_rad):.2f} degrees at "
            f"each pose; views were weighed by that.{much if worn else ''}\n{by_mounting[self.mounting]}"
        )


def solve_hand_eye(
    views: Sequence[BoardView], board: Board, K: Float[np.ndarray, "3 3"], mounting: Mounting
) -> HandEye:
    """Calibrate from pictures of the board.

    Raises LabError if the views are too few, turned too little or turned about one axis only, or if the board's squares
    do not have the stated size.
    """
    check_views([v.T_base_flange for v in views])
    placed = pose_views(views, board, K)
    fit = fit_poses(placed, mounting)
    if abs(fit.scale - 1) > max(_WRONG_SCALE, _SURE * fit.scale_error):
        raise LabError(
            f"The board's squares seem to be {1e3 * board.square_m * fit.scale:.2f} mm wide, not "
            f"{1e3 * board.square_m:.2f} mm. Measure them: printers scale. Then say so."
        )
    poses = fit.T_camera, fit.T_board
    off = [
        reprojection_errors_px(v, board_by(v.T_base_flange, poses, mounting), board, K).ravel() for v in views
    ]
    rms_px = float(np.sqrt(2 * np.mean(np.concatenate(off) ** 2)))
    return _judged(placed, mounting, fit, lambda k, T: error_at(views[k], T, board, K, mounting), rms_px)


def solve_samples(samples: Sequence[PoseView], mounting: Mounting) -> HandEye:
    """Calibrate from poses of a board or marker that another program measured; errors are those of its origin.

    Raises LabError if the samples are too few, turned too little or turned about one axis only.
    """
    check_views([s.T_base_flange for s in samples])

    def error_m(k: int, poses: tuple[Pose, Pose]) -> float:
        off = board_by(samples[k].T_base_flange, poses, mounting) - samples[k].T_camera_board
        return float(np.linalg.norm(off[:3, 3]))

    return _judged(samples, mounting, fit_poses(samples, mounting), error_m)


def check_views(flanges: Sequence[Pose]) -> None:
    """Raise LabError if these flange poses cannot determine both transforms."""
    if len(flanges) < LEAST_VIEWS:
        raise LabError(
            f"{len(flanges)} pictures of the board are too few: at least {LEAST_VIEWS}, better 20."
        )
    first = flanges[0][:3, :3]
    turns = np.array([Rotation.from_matrix(first.T @ T[:3, :3]).as_rotvec() for T in flanges])
    turns -= turns.mean(axis=0)
    spread = np.linalg.svd(turns, compute_uv=False) / np.sqrt(len(flanges))
    if np.linalg.norm(turns, axis=1).max() < _LEAST_TURN_RAD or spread[1] < _LEAST_SPREAD_RAD:
        raise LabError(
            "The flange was turned too little, or about one axis alone: turn it by 20 to 35 degrees about several."
        )


def error_at(
    view: BoardView, poses: tuple[Pose, Pose], board: Board, K: Float[np.ndarray, "3 3"], mounting: Mounting
) -> float:
    """Return the mean distance, metres, of the calibrated corners from the lines of sight on which they were seen."""
    T_camera_board = board_by(view.T_base_flange, poses, mounting)
    in_camera = transform_points(T_camera_board, board.corners[view.corners.ids])
    rays = np.column_stack([view.corners.pixels, np.ones(len(view.corners.pixels))]) @ np.linalg.inv(K).T
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    along = (in_camera * rays).sum(axis=1, keepdims=True)
    return float(np.linalg.norm(in_camera - along * rays, axis=1).mean())


def board_by(T_base_flange: Pose, poses: tuple[Pose, Pose], mounting: Mounting) -> Pose:
    """Return T_camera_board for a flange pose, from a calibration's transforms of camera and board."""
    T_camera, T_board = poses
    if mounting == "fixed":
        return np.asarray(invert(T_camera) @ T_base_flange @ T_board)
    return np.asarray(invert(T_base_flange @ T_camera) @ T_board)


def _judged(
    views: Sequence[PoseView],
    mounting: Mounting,
    fit: PoseFit,
    error_m: Callable[[int, tuple[Pose, Pose]], float],
    rms_px: float | None = None,
) -> HandEye:
    """Return the calibration; each view's error comes from transforms that were solved without it."""
    errors = np.zeros(len(views))
    for fold in range(_FOLDS):
        poses = refit([v for k, v in enumerate(views) if k % _FOLDS != fold], mounting, fit)
        for k in range(fold, len(views), _FOLDS):
            errors[k] = error_m(k, poses)
    return HandEye(mounting, fit.T_camera, fit.T_board, errors, fit.noise, fit.scale, rms_px)
