"""The touch test after a calibration: the fingertips go to 5 cm above the marker on the table, and a person looks.

It tests everything at once: the camera's pose, the robot's base in the world frame, and the robot description.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from torc.geometry.transforms import invert
from torc.records import Trajectory
from torc.robots.ik import solve_ik
from torc_lab.calibration.marker import TableMarker
from torc_lab.devices import limits, planned_for
from torc_lab.empty_table import empty_space, motion_above
from torc_lab.lab_file import Lab

ABOVE_M = 0.05
_TURNS = 8


def touch_motion(lab: Lab, marker: TableMarker, qpos: np.ndarray) -> Trajectory | None:
    """Return a motion of the open gripper, pointing down, to above the marker's middle; None if no such motion exists.

    Args:
        lab: the laboratory; its table must be clear.
        marker: where the calibration saw it.
        qpos: the arm's joint positions now, radians.
    """
    robot = planned_for(lab)
    turns = np.outer(2 * np.pi * np.arange(_TURNS) / _TURNS, [0.0, 0.0, 1.0])
    tcps = np.tile(np.eye(4), (_TURNS, 1, 1))
    tcps[:, :3, :3] = Rotation.from_rotvec(turns).as_matrix() @ np.diag([1.0, -1, -1])
    tcps[:, :3, 3] = marker.corners.mean(axis=0) + np.array([0, 0, ABOVE_M])
    solutions = solve_ik(robot.arm, tcps @ invert(robot.gripper.T_tool0_tcp(robot.gripper.max_width_m)))
    found = np.concatenate([solutions.of(k) for k in range(_TURNS)])
    space = empty_space(robot, lab.workspace, limits(lab))
    found = found[~space.collides(found)] if len(found) else found
    if not len(found):
        return None
    return motion_above(space, robot.arm, qpos, found, np.random.default_rng(0))
