"""Where a planned pick leads the hand, for the person who lets it go: for the page's 3-D view, and in words."""

from collections.abc import Mapping

import numpy as np

from torc.records import PickPlan, Trajectory
from torc.robots.description import RobotDescription
from torc.robots.kinematics import tool0_poses
from torc_lab.checks import MotionLimits, stretch_for

_POINTS = 40
"""Per motion: enough for a curve on a screen."""
MOTIONS = ("free", "approach", "lift", "transfer", "home")
Ways = Mapping[str, tuple[tuple[float, float, float], ...]]


def tcp_ways(robot: RobotDescription, plan: PickPlan) -> Ways:
    """The places of the TCP along each motion, world frame, whole millimetres, in metres."""
    return {name: _places(robot, getattr(plan, name)) for name in MOTIONS}


def ways_text(
    ways: Ways, plan: PickPlan, robot: RobotDescription, limits: MotionLimits, support_z_m: float
) -> str:
    """Each motion in words: how far the TCP goes, in what time at the laboratory's speed, and how low it comes."""
    told = []
    for name, places in ways.items():
        motion, at = getattr(plan, name), np.array(places)
        far = float(np.linalg.norm(np.diff(at, axis=0), axis=1).sum())
        seconds = motion.duration_s * stretch_for(motion, limits, robot)
        low = 100 * (float(at[:, 2].min()) - support_z_m)
        told.append(f"{name} {far:.2f} m in {seconds:.0f} s, lowest at {low:+.0f} cm")
    return f"The fingertips' way, heights from the table: {'; '.join(told)}."


def _places(robot: RobotDescription, motion: Trajectory) -> tuple[tuple[float, float, float], ...]:
    kept = np.unique(np.linspace(0, len(motion.times_s) - 1, _POINTS).round().astype(int))
    tcp = tool0_poses(robot.arm, motion.qpos[kept]) @ robot.gripper.T_tool0_tcp(0.0)
    return tuple((x, y, z) for x, y, z in np.round(tcp[:, :3, 3], 3).tolist())
