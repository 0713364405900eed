"""Propose calibration poses, with the board turned and shifted in front of the camera, and the motions between them.

Only rough values are known at first. The camera's pose comes from the workspace, or from a few small turns of the hand
that carries it; the board's pose comes from one picture. The small turns are about a point ahead of the hand, where the
board lies if the camera looks the way the gripper reaches. The camera's place on the hand is unknown during them, so
room is kept all around the hand.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial.transform import Rotation

from torc.geometry.transforms import Pose, invert, make_pose, transform_points
from torc.motion.holding import hull_spheres
from torc.motion.space import FreeSpace
from torc.robots.description import RobotDescription
from torc.robots.ik import solve_ik
from torc.robots.kinematics import tool0_poses
from torc.workspace.description import Workspace
from torc_lab.calibration.board import Board, BoardView, board_in_camera
from torc_lab.calibration.noisy_arm import Mounting, park
from torc_lab.checks import MotionLimits
from torc_lab.empty_table import LIMIT_RAD, empty_space, trusting
from torc_lab.protocols import LabError

_DRAWN, _BATCH = 3000, 300
_TURN_RAD = 0.6
"""Largest turn about each axis; 35 degrees about several axes determine both transforms."""
_EDGE = 0.08
"""Share of the picture's width and height that stays free around the board, because the known poses are rough."""
_NEARER, _FURTHER, _LEAST_M = 0.75, 1.3, 0.3
_STEEPEST = 0.6
"""Least cosine between the line of sight and the board's normal: markers seen too flat are not found."""
_FAR_RAD = 1.6
"""Largest distance of a joint from its start: the hand does not turn over, and cables do not wind up."""
_HELD_SPHERES = 30
_CAMERA_M = (0.05, 0.04, 0.04)
"""Half of the room kept for a camera on the hand, along its own axes; cameras for arms are smaller."""
_SHIFT_M = 0.15
"""A shift that makes two poses as different as a turn by _TURN_RAD."""
_LEAST_TURNED = 4
"""Views, including the first, that a rough pose of a camera on the hand needs."""
_TILT_RAD, _SPIN_RAD = 0.2, 0.35
"""Small turns about the two axes across the hand's, and about its own: the board stays in the picture."""
_RING, _RING_M, _ROOM_M, _ALONG_M = 8, 0.09, 0.045, (0.03, 0.1)
"""Number of the spheres that keep room for a camera, their distance from the hand's axis, their radius, and their
distances from the flange.
"""


@dataclass(frozen=True)
class Sight:
    """The roughly known poses of camera and board, and the camera's intrinsics.

    Attributes:
        K, size: intrinsics, and width and height of the picture, pixels.
        T_camera: the camera in the world (mounting fixed) or in the flange (hand).
        T_camera_board: the board in the camera's frame in the picture at `qpos`.
    """

    robot: RobotDescription
    workspace: Workspace
    limits: MotionLimits
    board: Board
    K: Float[np.ndarray, "3 3"]
    size: tuple[int, int]
    T_camera: Pose
    T_camera_board: Pose
    qpos: Float[np.ndarray, "dof"]
    mounting: Mounting = "fixed"

    @property
    def T_board(self) -> Pose:
        """The board in the flange (mounting fixed) or in the world (hand)."""
        flange = tool0_poses(self.robot.arm, self.qpos[None])[0]
        carrier = invert(flange) if self.mounting == "fixed" else flange
        return np.asarray(carrier @ self.T_camera @ self.T_camera_board)

    def flanges(self, views: Float[np.ndarray, "n 4 4"]) -> Float[np.ndarray, "n 4 4"]:
        """Return the flange's world pose for each pose at which the camera is to see the board."""
        if self.mounting == "fixed":
            return np.asarray(self.T_camera @ views @ invert(self.T_board))
        return np.asarray(self.T_board @ invert(views) @ invert(self.T_camera))

    @property
    def held(self) -> Float[np.ndarray, "a 4"]:
        """Spheres around the object that moves with the hand, the board or the camera, in the flange's frame."""
        if self.mounting == "fixed":
            width, height = self.board.size_m
            u, v = np.meshgrid(np.linspace(0, width, 6), np.linspace(0, height, 6))
            points, T = np.column_stack([u.ravel(), v.ravel(), np.zeros(u.size)]), self.T_board
        else:
            corners = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
            points, T = corners * _CAMERA_M, self.T_camera
        return hull_spheres(transform_points(T, points), _HELD_SPHERES)


def proposed(sight: Sight, count: int, rng: np.random.Generator) -> Float[np.ndarray, "n dof"]:
    """Return up to `count` configurations, most different first, that show the whole board.

    All are within the limits and touch nothing. There may be fewer.
    """
    space = calibration_space(sight)
    views = _drawn(sight, rng)
    views = views[in_sight(sight, views)]
    found, kept = np.zeros((0, sight.robot.arm.dof)), np.zeros((0, 4, 4))
    for batch in np.split(views, range(_BATCH, len(views), _BATCH)):
        reached, qpos = _reached(sight.robot, sight.limits, sight.qpos, sight.flanges(batch))
        free = ~space.collides(qpos) if len(qpos) else np.zeros(0, bool)
        kept, found = np.concatenate([kept, batch[reached][free]]), np.concatenate([found, qpos[free]])
        if len(found) >= 6 * count:
            break
    return found[_most_different(kept, sight.T_camera_board, count)]


def in_sight(sight: Sight, views: Float[np.ndarray, "n 4 4"]) -> Bool[np.ndarray, "n"]:
    """Return per board pose in the camera's frame whether the board is well inside the picture, and not too slanted."""
    corners = np.einsum("nij,cj->nci", views[:, :3, :3], sight.board.outline) + views[:, None, :3, 3]
    z = np.maximum(corners[..., 2], 1e-3)
    pixels = np.einsum("ij,ncj->nci", sight.K, corners / z[..., None])[..., :2]
    size = np.array(sight.size, dtype=float)
    inside = ((pixels > _EDGE * size) & (pixels < (1 - _EDGE) * size)).all(axis=(1, 2))
    middle = corners.mean(axis=1)
    middle /= np.linalg.norm(middle, axis=1, keepdims=True)
    facing = (views[:, :3, 2] * middle).sum(axis=1)
    return np.asarray(inside & (facing > _STEEPEST) & (corners[..., 2] > 0.5 * _LEAST_M).all(axis=1))


def calibration_space(sight: Sight) -> FreeSpace:
    """Return the space of table, bin, obstacles and robot, with margins; the board or camera is on the hand."""
    space = empty_space(sight.robot, sight.workspace, sight.limits, sight.held)
    return space if sight.mounting == "fixed" else trusting(space, sight.qpos)


def _drawn(sight: Sight, rng: np.random.Generator) -> Float[np.ndarray, "n 4 4"]:
    """Draw board poses in the camera's frame: the board facing the camera, turned at random and shifted.

    A camera on the hand may not reach a pose that faces the board on the table; turns then start anywhere between the
    first pose and the facing one.
    """
    first = sight.T_camera_board
    middle = sight.board.outline.mean(axis=0)
    seen_m = max(float((first[:3, :3] @ middle + first[:3, 3])[2]), _LEAST_M)
    width, height = sight.size
    depth = np.maximum(seen_m * rng.uniform(_NEARER, _FURTHER, _DRAWN), _LEAST_M)
    pixels = np.column_stack(
        [rng.uniform(0.2, 0.8, _DRAWN) * width, rng.uniform(0.2, 0.8, _DRAWN) * height, np.ones(_DRAWN)]
    )
    places = depth[:, None] * (pixels @ np.linalg.inv(sight.K).T)
    turns = Rotation.from_rotvec(rng.uniform(-_TURN_RAD, _TURN_RAD, (_DRAWN, 3)))
    shares = np.ones(_DRAWN) if sight.mounting == "fixed" else rng.uniform(0, 1, _DRAWN)
    turns = (turns * _faced(first[:3, :3], shares)).as_matrix()
    out = np.tile(np.eye(4), (_DRAWN, 1, 1))
    out[:, :3, :3], out[:, :3, 3] = turns, places - turns @ middle
    return out


def _faced(R: Float[np.ndarray, "3 3"], shares: Float[np.ndarray, "n"]) -> Rotation:
    """Return rotations between R (share 0) and the nearest one with the normal along the optical axis (share 1)."""
    axis = np.cross(R[:, 2], [0.0, 0.0, 1.0])
    length = float(np.linalg.norm(axis))
    turn = axis * np.arctan2(length, R[2, 2]) / max(length, 1e-9)
    return Rotation.from_rotvec(shares[:, None] * turn) * Rotation.from_matrix(R)


def _reached(
    robot: RobotDescription,
    limits: MotionLimits,
    qpos: Float[np.ndarray, "dof"],
    flanges: Float[np.ndarray, "n 4 4"],
) -> tuple[Bool[np.ndarray, "n"], Float[np.ndarray, "m dof"]]:
    """Return which flange poses the arm reaches within the limits, and the joint solutions nearest to `qpos`."""
    arm = robot.arm
    tcps = flanges @ robot.gripper.T_tool0_tcp(0.0)
    places = np.stack([flanges[:, :3, 3], tcps[:, :3, 3]], axis=1)
    inside = ((places > limits.box_lower) & (places < limits.box_upper)).all(axis=(1, 2))
    near = replace(
        arm,
        lower=np.maximum(limits.lower + LIMIT_RAD, qpos - _FAR_RAD),
        upper=np.minimum(limits.upper - LIMIT_RAD, qpos + _FAR_RAD),
        rest_qpos=qpos,
    )
    reached, found = np.zeros(len(flanges), bool), []
    solutions = solve_ik(near, flanges[inside]) if inside.any() else None
    for k, n in enumerate(np.flatnonzero(inside)):
        if solutions is not None and len(branches := solutions.of(k)):
            reached[n] = True
            found.append(branches[np.abs(branches - qpos).max(axis=1).argmin()])
    return reached, np.array(found).reshape(-1, arm.dof)


def _most_different(views: Float[np.ndarray, "n 4 4"], first: Pose, count: int) -> list[int]:
    """Return indices, each as far as possible from those before it and from the first picture, by turn and shift."""
    turns = Rotation.from_matrix(first[:3, :3].T @ views[:, :3, :3]).as_rotvec() / _TURN_RAD
    shifts = (views[:, :3, 3] - first[:3, 3]) / _SHIFT_M
    features = np.hstack([turns, shifts])
    nearest = np.linalg.norm(features, axis=1)
    chosen: list[int] = []
    for _ in range(min(count, len(views))):
        chosen.append(int(nearest.argmax()))
        nearest = np.minimum(nearest, np.linalg.norm(features - features[chosen[-1]], axis=1))
    return chosen


def tour(qpos: Float[np.ndarray, "n dof"], start: Float[np.ndarray, "dof"]) -> list[int]:
    """Return an order of visit that always goes to the nearest remaining configuration, beginning near `start`."""
    away, order = np.abs(qpos - start).max(axis=1), list[int]()
    for _ in qpos:
        order.append(int(away.argmin()))
        away = np.abs(qpos - qpos[order[-1]]).max(axis=1)
        away[order] = np.inf
    return order


def small_turns(
    robot: RobotDescription, limits: MotionLimits, qpos: Float[np.ndarray, "dof"], ahead_m: float
) -> Float[np.ndarray, "n dof"]:
    """Return configurations that turn the hand a little about a point `ahead_m` ahead of the flange.

    The turns are about both axes across the hand's and about its own, both ways. Those outside the arm's reach or
    limits are left out.
    """
    R = robot.gripper.T_tool0_tcp(0.0)[:3, :3]
    pivot = make_pose(R, ahead_m * R[:, 2])
    tilts = np.diag([_TILT_RAD, _TILT_RAD, _SPIN_RAD])
    turns = np.tile(np.eye(4), (6, 1, 1))
    turns[:, :3, :3] = Rotation.from_rotvec(np.vstack([tilts, -tilts])).as_matrix()
    flange = tool0_poses(robot.arm, qpos[None])[0]
    return _reached(robot, limits, qpos, flange @ pivot @ turns @ invert(pivot))[1]


def room_around_hand(robot: RobotDescription) -> Float[np.ndarray, "a 4"]:
    """Return spheres in the flange's frame wherever a camera may be fixed to the hand."""
    R = robot.gripper.T_tool0_tcp(0.0)[:3, :3]
    angles = 2 * np.pi * np.arange(_RING) / _RING
    ring = [[_RING_M * np.cos(a), _RING_M * np.sin(a), z] for z in _ALONG_M for a in angles]
    return np.column_stack([np.array(ring) @ R.T, np.full(len(ring), _ROOM_M)])


def rough_camera(views: Sequence[BoardView], board: Board, K: Float[np.ndarray, "3 3"]) -> Pose:
    """Return T_tool0_camera to a centimetre or two. Raises LabError if too few views show the board."""
    if len(views) < _LEAST_TURNED:
        raise LabError(
            "The board was in sight after too few of the small turns, so that nobody knows where the camera is on the "
            "hand. Begin with the board in the middle of the picture; or bring the arm to every pose yourself: --jog."
        )
    return park([(v.T_base_flange, board_in_camera(v, board, K)) for v in views], on_hand=True)[0]
