"""The touch test after a calibration: the fingertips go to 5 cm above the marker on the table, and a person looks.

It tries all at once: where the camera is, where the robot's base is in the world frame, and the robot description.
"""

import numpy as np

from torc.geometry.transforms import Pose, invert, make_pose
from torc.records import Trajectory
from torc.robots.ik import solve_ik
from torc_lab.calibration.marker import TableMarker
from torc_lab.devices import limits, planned_for
from torc_lab.empty_table import empty_space, motion_above
from torc_lab.lab_file import Lab

ABOVE_M = 0.05
_TURNS = 8
_SEED = 0


def touch_motion(lab: Lab, marker: TableMarker, qpos: np.ndarray) -> Trajectory | None:
    """A motion of the open gripper to above the middle of the marker, pointing down; None if no motion is found.

    Args:
        lab: the laboratory; its table must be clear.
        marker: where the calibration saw it.
        qpos: where the arm is, radians.
    """
    robot, rng = planned_for(lab), np.random.default_rng(_SEED)
    T_tcp_tool0 = invert(robot.gripper.T_tool0_tcp(robot.gripper.max_width_m))
    flanges = np.stack([T @ T_tcp_tool0 for T in _poses_above(marker)])
    solutions = solve_ik(robot.arm, flanges)
    found = np.concatenate([solutions.of(k) for k in range(len(flanges))])
    space = empty_space(robot, lab.workspace, limits(lab))
    found = found[~space.collides(found)] if len(found) else found
    if not len(found):
        return None
    return motion_above(space, robot.arm, qpos, found, rng)


def _poses_above(marker: TableMarker) -> list[Pose]:
    """TCP poses above the marker, pointing down, turned about the vertical."""
    x, y, z = marker.corners.mean(axis=0)
    poses = []
    for angle in np.arange(_TURNS) * 2 * np.pi / _TURNS:
        c, s = np.cos(angle), np.sin(angle)
        poses.append(make_pose(np.array([[c, s, 0.0], [s, -c, 0.0], [0.0, 0.0, -1.0]]), [x, y, z + ABOVE_M]))
    return poses
