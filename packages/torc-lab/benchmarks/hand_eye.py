"""Errors of the hand-eye calibration on synthetic rigs, beside OpenCV's best method where OpenCV has them (4.x).

    python packages/torc-lab/benchmarks/hand_eye.py [--seeds 20]

Prints median (largest) error of a point .7 m ahead of the camera, in millimetres, by twenty poses of the board.
"""

from dataclasses import dataclass

import cv2
import numpy as np
import tyro
from scipy.spatial.transform import Rotation

from torc.geometry.transforms import Pose, intrinsics, invert, look_at, make_pose, transform_points
from torc_lab.calibration.board import Board, BoardView, FoundCorners, pose_views
from torc_lab.calibration.noisy_arm import Mounting, PoseView, fit_poses

_K = intrinsics(1280, 720, 0.8)
_BOARD = Board()
_FIRST = look_at(np.array([0.1, 0.0, 0.6]), np.array([0.7, 0.0, 0.1]))
_HELD = make_pose(Rotation.from_euler("xyz", [0.05, -0.1, 0.4]).as_matrix(), [-0.1, -0.07, 0.03])
_NOISE_PX = 0.2
_BAD_RAD, _BAD_M = 0.1, 0.05
_METHODS = ("TSAI", "PARK", "HORAUD", "ANDREFF", "DANIILIDIS")


@dataclass(frozen=True)
class Args:
    """Compare on good and worn arms, with and without two bad views."""

    seeds: int = 20
    """Rigs of each kind."""


@dataclass(frozen=True)
class _Arm:
    name: str
    turn_rad: float
    shift_m: float
    bad: int = 0


_ARMS = (
    _Arm("good", np.deg2rad(0.07), 0.0008),
    _Arm("worn", np.deg2rad(0.2), 0.002),
    _Arm("good, 2 bad views", np.deg2rad(0.07), 0.0008, 2),
    _Arm("worn, 2 bad views", np.deg2rad(0.2), 0.002, 2),
)
_MOUNTINGS: tuple[Mounting, ...] = ("fixed", "hand")


def _jiggled(T: Pose, rng: np.random.Generator, turn_rad: float, shift_m: float) -> Pose:
    turn = Rotation.from_rotvec(rng.normal(0, turn_rad / np.sqrt(3), 3)).as_matrix()
    return np.asarray(T @ make_pose(turn, rng.normal(0, shift_m / np.sqrt(3), 3)))


def _views(arm: _Arm, mounting: Mounting, rng: np.random.Generator, count: int = 20) -> list[PoseView]:
    found = []
    for k in range(count):
        turn = Rotation.from_euler("xyz", rng.uniform(-0.6, 0.6, 3)).as_matrix() @ np.diag([1.0, -1, -1])
        facing = make_pose(turn, [*rng.uniform(-0.12, 0.08, 2), rng.uniform(0.55, 0.8)])
        flange = _FIRST @ (facing @ invert(_HELD) if mounting == "fixed" else invert(_HELD @ facing))
        pixels = transform_points(facing, _BOARD.corners) @ _K.T
        pixels = pixels[:, :2] / pixels[:, 2:] + rng.normal(0, _NOISE_PX, (len(pixels), 2))
        reported = _jiggled(flange, rng, arm.turn_rad, arm.shift_m)
        if k in (3, 10)[: arm.bad]:
            reported = _jiggled(reported, rng, _BAD_RAD, _BAD_M)
        found.append(BoardView(reported, FoundCorners(np.arange(len(pixels)), pixels)))
    return pose_views(found, _BOARD, _K)


def _error_mm(T: Pose, mounting: Mounting) -> float:
    point = np.array([0.0, 0.0, 0.7, 1.0])
    true = _FIRST if mounting == "fixed" else _HELD
    return 1e3 * float(np.linalg.norm(T @ point - true @ point))


def _by_opencv(views: list[PoseView], mounting: Mounting, method: str) -> Pose:
    flanges = [v.T_base_flange if mounting == "hand" else invert(v.T_base_flange) for v in views]
    turns, places = [T[:3, :3] for T in flanges], [T[:3, 3] for T in flanges]
    seen = [v.T_camera_board for v in views]
    R, t = cv2.calibrateHandEye(
        turns,
        places,
        [T[:3, :3] for T in seen],
        [T[:3, 3] for T in seen],
        method=getattr(cv2, f"CALIB_HAND_EYE_{method}"),
    )
    return make_pose(R, np.ravel(t))


def _text(errors: list[float]) -> str:
    return f"{np.median(errors):.2f} ({max(errors):.2f})"


def _compare(arm: _Arm, mounting: Mounting, seeds: int) -> str:
    rigs = [_views(arm, mounting, np.random.default_rng(seed)) for seed in range(seeds)]
    ours = [_error_mm(fit_poses(v, mounting).T_camera, mounting) for v in rigs]
    line = f"{arm.name:18} {mounting:6} torc {_text(ours)}"
    if not hasattr(cv2, "calibrateHandEye"):
        return line
    theirs = {m: [_error_mm(_by_opencv(v, mounting, m), mounting) for v in rigs] for m in _METHODS}
    best = min(theirs, key=lambda m: float(np.median(theirs[m])))
    ratio = np.median(ours) / np.median(theirs[best])
    return f"{line}, OpenCV's best ({best}) {_text(theirs[best])}, ratio {ratio:.2f}"


def main(args: Args) -> None:
    """Print a line for each arm and mounting."""
    if not hasattr(cv2, "calibrateHandEye"):
        print(f"OpenCV {cv2.__version__} has no calibrateHandEye: torc alone.")
    for arm in _ARMS:
        for mounting in _MOUNTINGS:
            print(_compare(arm, mounting, args.seeds), flush=True)


if __name__ == "__main__":
    main(tyro.cli(Args))
