"""Where a camera on the hand is, roughly, before anything is known of it: by a few small turns of the hand.

The hand turns about a point ahead of it, where the board lies if the camera looks the way the gripper reaches. The
camera's place on the hand is not known then, so that room is kept all around the hand.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from torc.geometry.transforms import Pose, invert, make_pose
from torc.robots.description import RobotDescription
from torc.robots.kinematics import tool0_poses
from torc_lab.calibration.board import Board
from torc_lab.calibration.board_views import BoardView, board_in_camera
from torc_lab.calibration.closed_form import park
from torc_lab.calibration.proposals import reached_flanges
from torc_lab.checks import MotionLimits
from torc_lab.protocols import LabError

LEAST_TURNED = 4
"""Views, the first one too, that a rough pose takes."""
_TILT_RAD, _SPIN_RAD = 0.2, 0.35
"""About the two axes across the hand's, and about its own: the board stays in the picture."""
_RING_M, _ROOM_M, _ALONG_M = 0.09, 0.045, (0.03, 0.1)
"""Distance from the hand's axis, radius, and distances from the flange, of the spheres that keep room for a camera."""
_RING = 8


def small_turns(
    robot: RobotDescription, limits: MotionLimits, qpos: Float[np.ndarray, "dof"], ahead_m: float
) -> Float[np.ndarray, "n dof"]:
    """Configurations at which the hand is turned a little about a point so far ahead of the flange: about both axes
    across the hand's and its own, both ways; those that the arm reaches within the limits.
    """
    R = robot.gripper.T_tool0_tcp(0.0)[:3, :3]
    pivot = make_pose(R, ahead_m * R[:, 2])
    tilts = np.diag([_TILT_RAD, _TILT_RAD, _SPIN_RAD])
    turns = np.tile(np.eye(4), (6, 1, 1))
    turns[:, :3, :3] = Rotation.from_rotvec(np.vstack([tilts, -tilts])).as_matrix()
    flange = tool0_poses(robot.arm, qpos[None])[0]
    return reached_flanges(robot, limits, qpos, flange @ pivot @ turns @ invert(pivot))[1]


def room_around_hand(robot: RobotDescription) -> Float[np.ndarray, "a 4"]:
    """Spheres in the flange's frame wherever a camera may be fixed to the hand."""
    R = robot.gripper.T_tool0_tcp(0.0)[:3, :3]
    angles = 2 * np.pi * np.arange(_RING) / _RING
    ring = [[_RING_M * np.cos(a), _RING_M * np.sin(a), z] for z in _ALONG_M for a in angles]
    return np.column_stack([np.array(ring) @ R.T, np.full(len(ring), _ROOM_M)])


def rough_camera(views: Sequence[BoardView], board: Board, K: Float[np.ndarray, "3 3"]) -> Pose:
    """T_tool0_camera to a centimetre or two. Raises LabError if too few views show the board."""
    if len(views) < LEAST_TURNED:
        raise LabError(
            "The board was in sight after too few of the small turns, so that nobody knows where the camera is on the "
            "hand. Begin with the board in the middle of the picture; or bring the arm to every pose yourself: --jog."
        )
    return park([(v.T_base_flange, board_in_camera(v, board, K)) for v in views], on_hand=True)[0]
