"""A calibration without a laboratory: an arm that errs, the board in its hand, and a camera that sees it printed."""

from dataclasses import dataclass, field

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from test_lab_file import TEXT
from torc.geometry.transforms import intrinsics, invert, make_pose
from torc.records import Observation, Trajectory
from torc.robots.ik import solve_ik
from torc.robots.kinematics import tool0_poses
from torc_lab.calibration.board import Board
from torc_lab.calibration.marker import MARKER_M, marker_picture
from torc_lab.calibration.proposals import Sight, calibration_space
from torc_lab.calibration.session import Session, collect_guided
from torc_lab.checks import motion_faults, stretch_for, stretched
from torc_lab.devices import limits, planned_for
from torc_lab.empty_table import empty_space
from torc_lab.lab_file import load_lab

K, SIZE = intrinsics(1280, 720, 0.8), (1280, 720)
BOARD = Board()
ARM_RAD, ARM_M = np.deg2rad(0.07), 0.0008
"""How far an arm is from where it says it is."""


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    path = tmp_path_factory.mktemp("lab") / "lab.yaml"
    path.write_text(TEXT, encoding="utf-8")
    return load_lab(path)


@pytest.fixture(scope="module")
def held(lab):
    """The board pinched at its longer edge, its normal along the closing axis; and where the arm holds it up."""
    width, height = BOARD.size_m
    R = np.array([[0.0, 0, -1], [1, 0, 0], [0, -1, 0]])
    T_tcp_board = make_pose(R, -R @ [width / 2, height, 0])
    T_flange_board = lab.robot.gripper.T_tool0_tcp(0.0) @ T_tcp_board
    quarter = Rotation.from_rotvec([0, 0, 1.5 * np.pi]).as_matrix()
    in_camera = make_pose(quarter, [0, 0, 0.42] - quarter @ [width / 2, height / 2, 0])
    flange = lab.workspace.camera.T_world_camera @ in_camera @ invert(T_flange_board)
    branches = solve_ik(lab.robot.arm, flange[None]).of(0)
    sight = sight_at(lab, in_camera, branches[0])
    free = branches[~calibration_space(sight).collides(branches)]
    return T_flange_board, sight_at(lab, in_camera, free[0])


def sight_at(lab, in_camera, qpos):
    around = planned_for(lab), lab.workspace, limits(lab), BOARD, K, SIZE
    return Sight(*around, lab.workspace.camera.T_world_camera, in_camera, qpos)


def jiggled(T, rng, turn, shift):
    spin = Rotation.from_rotvec(rng.normal(0, turn / np.sqrt(3), 3)).as_matrix()
    return T @ make_pose(spin, rng.normal(0, shift / np.sqrt(3), 3))


@dataclass
class ErringArm:
    """Is where it is told to be, but for its errors; refuses what the supervisor would refuse."""

    lab: object
    says: np.ndarray
    followed: list[Trajectory] = field(default_factory=list)

    @property
    def qpos(self):
        return self.says

    def follow(self, trajectory, guard=None):
        slow = stretched(trajectory, stretch_for(trajectory, limits(self.lab), self.lab.robot))
        faults = motion_faults(slow, self.says, 0.002, limits(self.lab), self.lab.robot)
        assert not faults, faults
        self.followed.append(trajectory)
        self.says = trajectory.qpos[-1]


@dataclass
class Photographer:
    """A camera that is not quite where the workspace says, and sees the board in the hand, and the marker, printed."""

    arm: ErringArm
    T_world_camera: np.ndarray
    T_flange_board: np.ndarray
    rng: np.random.Generator
    T_world_marker: np.ndarray | None = None
    slipped: bool = False

    def unplaced(self):
        flange = tool0_poses(self.arm.lab.robot.arm, self.arm.qpos[None])[0]
        gray = np.full(SIZE[::-1], 120, np.uint8)
        if self.T_world_marker is not None:
            white = np.pad(marker_picture(700), 100, constant_values=255)
            at = self.T_world_marker @ make_pose(
                np.diag([1.0, -1, -1]), [-4.5 * MARKER_M / 7, 4.5 * MARKER_M / 7, 0]
            )
            gray = self.printed(gray, white, invert(self.T_world_camera) @ at, 7000)
        really = jiggled(flange, self.rng, ARM_RAD, ARM_M)
        if not (self.slipped and self.arm.followed):
            board = invert(self.T_world_camera) @ really @ self.T_flange_board
            gray = self.printed(gray, BOARD.picture(4000), board, 4000)
        noisy = np.clip(gray + self.rng.normal(0, 3, gray.shape), 0, 255).astype(np.uint8)
        rgb = np.repeat(noisy[..., None], 3, axis=-1)
        return Observation(rgb, np.ones(gray.shape, np.float32), K, np.eye(4), np.zeros(0), 0.0)

    @staticmethod
    def printed(gray, flat, T, pixels_per_m):
        # A pixel's middle is at half a pixel of the print.
        half = 0.5 / pixels_per_m
        to_plane = np.array([[1 / pixels_per_m, 0, half], [0, 1 / pixels_per_m, half], [0, 0, 1]])
        H = K @ T[:3, [0, 1, 3]] @ to_plane
        shown = cv2.warpPerspective(flat, H, SIZE, borderValue=0, flags=cv2.INTER_AREA)
        covered = cv2.warpPerspective(np.full_like(flat, 255), H, SIZE, borderValue=0)
        return np.where(covered > 127, shown, gray)


@dataclass
class HandPhotographer(Photographer):
    """A camera on the hand (T_world_camera is not used) that sees the board on the table, until so many motions."""

    T_flange_camera: np.ndarray | None = None
    T_world_board: np.ndarray | None = None
    motions: int = 1000

    def unplaced(self):
        flange = tool0_poses(self.arm.lab.robot.arm, self.arm.qpos[None])[0]
        really = jiggled(flange, self.rng, ARM_RAD, ARM_M)
        gray = np.full(SIZE[::-1], 120, np.uint8)
        if len(self.arm.followed) <= self.motions:
            in_camera = invert(really @ self.T_flange_camera) @ self.T_world_board
            gray = self.printed(gray, BOARD.picture(4000), in_camera, 4000)
        noisy = np.clip(gray + self.rng.normal(0, 3, gray.shape), 0, 255).astype(np.uint8)
        return Observation(
            np.repeat(noisy[..., None], 3, axis=-1),
            np.ones(gray.shape, np.float32),
            K,
            np.eye(4),
            np.zeros(0),
            0.0,
        )


def camera_on_hand(lab, rng, tilt_deg=0.0, **changed):
    """A camera beside the gripper that looks the way it reaches, half a metre from a board on the table."""
    robot, workspace, (width, height) = lab.robot, lab.workspace, BOARD.size_m
    R = robot.gripper.T_tool0_tcp(0.0)[:3, :3]
    turned = Rotation.from_euler("xyz", [4, -3, 50], degrees=True).as_matrix()
    T_flange_camera = make_pose(R @ turned, R @ [0.07, 0.02, 0.04])
    middle = np.array([*workspace.table.center[:2], workspace.support_z_m])
    down = np.diag([1.0, -1, -1])
    T_world_board = make_pose(down, middle - down @ [width / 2, height / 2, 0.0])
    # About the board's normal, slanted, about the camera's axis.
    angles = [[a, tilt_deg, b] for a in range(0, 360, 45) for b in range(0, 360, 45)]
    views = np.tile(make_pose(down, middle), (len(angles), 1, 1))
    views[:, :3, :3] = down @ Rotation.from_euler("ZXZ", angles, degrees=True).as_matrix()
    flanges = views @ make_pose(np.eye(3), [0, 0, -0.5]) @ invert(T_flange_camera)
    solutions = solve_ik(planned_for(lab).arm, flanges)
    branches = np.vstack([solutions.of(k) for k in range(len(flanges))])
    free = branches[~empty_space(planned_for(lab), workspace, limits(lab)).collides(branches)]
    start = free[np.abs(free - robot.arm.rest_qpos).max(axis=1).argmin()]
    nowhere, hand = np.eye(4), {"T_flange_camera": T_flange_camera, "T_world_board": T_world_board}
    return HandPhotographer(ErringArm(lab, start), nowhere, nowhere, rng, **hand, **changed)


def calibrated(lab, held, seed, count=20, marker=None, ask=lambda question: True, **changed):
    rng = np.random.default_rng(seed)
    T_flange_board, sight = held
    true = jiggled(lab.workspace.camera.T_world_camera, rng, np.deg2rad(2), 0.02)
    camera = Photographer(ErringArm(lab, sight.qpos), true, T_flange_board, rng, marker, **changed)
    return guided(lab, camera, count, ask), camera


def guided(lab, camera, count, ask=lambda question: True, mounting="fixed"):
    """The pictures of a calibration that torc leads."""
    where = lambda: camera.arm.qpos  # noqa: E731
    session = Session(camera, where, lab.robot.arm, BOARD, count, ask, lambda text: None, mounting)
    collect_guided(session, lab, camera.arm)
    return session
