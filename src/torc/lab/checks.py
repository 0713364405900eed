"""What a trajectory must be before it goes to a real arm, sample by sample."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from torc.records import Trajectory
from torc.robots.description import RobotDescription
from torc.robots.kinematics import tool0_poses

_FASTER = 1.02
"""Speeds between samples may be this much above those of the samples: a cubic is not straight."""
_PER_SAMPLE_RAD = 0.2
"""No joint moves further from sample to sample: what lies between would be unchecked."""


@dataclass(frozen=True)
class MotionLimits:
    """Within what an arm may move.

    Attributes:
        lower, upper: joint limits, radians, the margin taken off.
        max_speed: per joint, rad/s, after scaling.
        box_lower, box_upper: where the TCP of the closed gripper, and the flange, may be, world frame, metres.
    """

    lower: Float[np.ndarray, "dof"]
    upper: Float[np.ndarray, "dof"]
    max_speed: Float[np.ndarray, "dof"]
    box_lower: Float[np.ndarray, "3"]
    box_upper: Float[np.ndarray, "3"]


def limits_of(
    robot: RobotDescription,
    box_lower: Float[np.ndarray, "3"],
    box_upper: Float[np.ndarray, "3"],
    speed_scale: float,
    margin_rad: float,
) -> MotionLimits:
    """A robot's own limits, less a margin, at a share of its speed."""
    arm = robot.arm
    return MotionLimits(
        arm.lower + margin_rad,
        arm.upper - margin_rad,
        speed_scale * arm.max_speed,
        np.asarray(box_lower, dtype=float),
        np.asarray(box_upper, dtype=float),
    )


def stretched(trajectory: Trajectory, factor: float) -> Trajectory:
    """The same way in `factor` times the time. Raises ValueError for a factor below 1."""
    if not factor >= 1:
        raise ValueError(f"A trajectory is stretched, never sped up: {factor}.")
    return Trajectory(trajectory.times_s * factor, trajectory.qpos, trajectory.qvel / factor)


def thinned(trajectory: Trajectory, most: int) -> Trajectory:
    """The trajectory with so many samples at most, evenly chosen, the ends among them."""
    count = len(trajectory.times_s)
    if count <= most:
        return trajectory
    kept = np.unique(np.linspace(0, count - 1, most).round().astype(int))
    return Trajectory(trajectory.times_s[kept], trajectory.qpos[kept], trajectory.qvel[kept])


def stretch_for(trajectory: Trajectory, limits: MotionLimits) -> float:
    """The factor, 1 or more, with which a trajectory keeps to the speed limits."""
    between = np.abs(np.diff(trajectory.qpos, axis=0)) / np.diff(trajectory.times_s)[:, None]
    fastest = np.maximum(np.abs(trajectory.qvel).max(axis=0), between.max(axis=0) / _FASTER)
    return float(max(1.0, (fastest / limits.max_speed).max()))


def form_faults(trajectory: Trajectory, dof: int) -> list[str]:
    """What makes it no trajectory at all; empty if it is one."""
    times, path, rates = trajectory.times_s, trajectory.qpos, trajectory.qvel
    if times.ndim != 1 or path.shape != (len(times), dof) or rates.shape != path.shape or len(times) < 2:
        return [f"it has no rows of {dof} joints and velocities, one per time"]
    if not (np.isfinite(times).all() and np.isfinite(path).all() and np.isfinite(rates).all()):
        return ["it holds numbers that are none (NaN or infinite)"]
    if times[0] < 0 or (np.diff(times) <= 0).any():
        return ["its times do not rise from 0"]
    return []


def motion_faults(
    trajectory: Trajectory,
    qpos: Float[np.ndarray, "dof"],
    start_tolerance_rad: float,
    limits: MotionLimits,
    robot: RobotDescription,
) -> list[str]:
    """All that is wrong with a trajectory for an arm that is at `qpos`; empty if it may go."""
    if faults := form_faults(trajectory, robot.arm.dof):
        return faults
    times, path, rates = trajectory.times_s, trajectory.qpos, trajectory.qvel
    gap = np.abs(path[0] - qpos)
    if gap.max() > start_tolerance_rad:
        faults.append(
            f"it starts {gap.max():.4f} rad away from where joint {int(gap.argmax()) + 1} is; "
            f"{start_tolerance_rad:g} are allowed"
        )
    outside = np.argwhere((path < limits.lower) | (path > limits.upper))
    if len(outside):
        row, joint = outside[0]
        faults.append(
            f"joint {joint + 1} is at {path[row, joint]:.3f} rad after {times[row]:.2f} s, outside of "
            f"{limits.lower[joint]:.3f} to {limits.upper[joint]:.3f}"
        )
    moved = np.abs(np.diff(path, axis=0))
    if moved.max() > _PER_SAMPLE_RAD:
        faults.append(f"its samples lie {moved.max():.2f} rad apart: what is between cannot be checked")
    faults += _speed_faults(np.abs(rates), moved / np.diff(times)[:, None], limits)
    faults += _box_faults(path, times, limits, robot)
    return faults


def _speed_faults(rates: np.ndarray, between: np.ndarray, limits: MotionLimits) -> list[str]:
    fastest = np.maximum(rates.max(axis=0), between.max(axis=0) / _FASTER)
    over = fastest / limits.max_speed
    joint = int(over.argmax())
    if over[joint] <= 1 + 1e-6:
        return []
    return [
        f"joint {joint + 1} moves at {fastest[joint]:.3f} rad/s; {limits.max_speed[joint]:.3f} are allowed"
    ]


def _box_faults(
    path: np.ndarray, times: np.ndarray, limits: MotionLimits, robot: RobotDescription
) -> list[str]:
    flange = tool0_poses(robot.arm, path)
    tcp = flange @ robot.gripper.T_tool0_tcp(0.0)
    for what, poses in (("the TCP", tcp), ("the flange", flange)):
        places = poses[:, :3, 3]
        outside = np.flatnonzero(((places < limits.box_lower) | (places > limits.box_upper)).any(axis=1))
        if len(outside):
            row = int(outside[0])
            at = ", ".join(f"{v:.2f}" for v in places[row])
            return [f"{what} is at ({at}) m after {times[row]:.2f} s, outside of the workspace"]
    return []
