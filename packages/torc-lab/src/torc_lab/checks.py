"""Check and adapt trajectories for a real arm, sample by sample."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from torc.records import Trajectory
from torc.robots.description import RobotDescription
from torc.robots.kinematics import sphere_centers, tool0_poses

REDUCED_SPEED_M_S = 0.25
"""Greatest TCP speed while people may be near (ISO 10218-1, reduced speed control)."""
_FASTER = 1.02
"""Speeds between samples may be this much above those of the samples: a cubic is not straight."""
_HARDER = 1.1
"""The factor for accelerations, which come from differences of speeds."""
_AT_REST_RAD_S = 1e-6
"""A motion begins and ends at no more than this: controllers reject one that ends moving."""
_UPPER_ARM_M = 0.2
"""The elbow is the first joint further than this from the one before."""
_PER_SAMPLE_RAD = 0.2
"""No joint may move further from one sample to the next, as the path between is not checked."""


@dataclass(frozen=True)
class MotionLimits:
    """Limits on how an arm may move.

    Attributes:
        lower, upper: joint limits less the margin, radians.
        max_speed: per joint, rad/s, after scaling.
        max_acceleration: per joint, rad/s2.
        tcp_speed_m_s: greatest TCP speed; ISO 10218-1 calls 0.25 m/s reduced speed.
        box_lower, box_upper: where the TCP of the closed gripper, the flange, and the arm from its elbow on may be,
            world frame, metres.
    """

    lower: Float[np.ndarray, "dof"]
    upper: Float[np.ndarray, "dof"]
    max_speed: Float[np.ndarray, "dof"]
    max_acceleration: Float[np.ndarray, "dof"]
    tcp_speed_m_s: float
    box_lower: Float[np.ndarray, "3"]
    box_upper: Float[np.ndarray, "3"]


def limits_of(
    robot: RobotDescription,
    box_lower: Float[np.ndarray, "3"],
    box_upper: Float[np.ndarray, "3"],
    speed_scale: float,
    margin_rad: float,
    tcp_speed_m_s: float = REDUCED_SPEED_M_S,
) -> MotionLimits:
    """Return a robot's limits, with a margin at the joint limits and a share of its speed.

    Args:
        robot: whose joint, speed and acceleration limits to take.
        box_lower, box_upper: corners of the box that the arm may not leave, world frame, metres.
        speed_scale: share of the robot's joint speed limits.
        margin_rad: distance to keep from the joint limits.
        tcp_speed_m_s: greatest TCP speed; `speed_scale` does not apply to it.
    """
    arm = robot.arm
    return MotionLimits(
        arm.lower + margin_rad,
        arm.upper - margin_rad,
        speed_scale * arm.max_speed,
        arm.max_acceleration,
        tcp_speed_m_s,
        np.asarray(box_lower, dtype=float),
        np.asarray(box_upper, dtype=float),
    )


def stretched(trajectory: Trajectory, factor: float) -> Trajectory:
    """Return the trajectory slowed down by `factor`. Raises ValueError if it is below 1."""
    if not factor >= 1:
        raise ValueError(f"A trajectory is stretched, never sped up: {factor}.")
    return Trajectory(trajectory.times_s * factor, trajectory.qpos, trajectory.qvel / factor)


def turning(
    qpos: Float[np.ndarray, "dof"], by_rad: float, joint: int = 0, duration_s: float = 1.0, samples: int = 51
) -> Trajectory:
    """Return a motion that turns one joint by `by_rad`, from rest to rest.

    Args:
        qpos: joint positions at the start, radians.
        joint: index of the joint, from 0.
        samples: number of samples of the trajectory.
    """
    t = np.linspace(0, duration_s, samples)
    s = t / duration_s
    path, rates = np.tile(qpos, (samples, 1)), np.zeros((samples, len(qpos)))
    path[:, joint] += by_rad * (3 * s**2 - 2 * s**3)
    rates[:, joint] = by_rad * 6 * s * (1 - s) / duration_s
    return Trajectory(t, path, rates)


def thinned(trajectory: Trajectory, most: int) -> Trajectory:
    """Return the trajectory with at most `most` samples, evenly chosen, including both ends."""
    count = len(trajectory.times_s)
    if count <= most:
        return trajectory
    kept = np.unique(np.linspace(0, count - 1, most).round().astype(int))
    return Trajectory(trajectory.times_s[kept], trajectory.qpos[kept], trajectory.qvel[kept])


def stretch_for(trajectory: Trajectory, limits: MotionLimits, robot: RobotDescription) -> float:
    """Return the least factor, at least 1, that slows a trajectory down to the speed and acceleration limits."""
    speed = (_fastest(trajectory) / limits.max_speed).max()
    tcp = _tcp_speed_m_s(trajectory, robot) / limits.tcp_speed_m_s
    # Stretched in time by a factor, accelerations fall with its square.
    acceleration = np.sqrt((_hardest(trajectory) / limits.max_acceleration).max())
    return float(max(1.0, speed, tcp, acceleration))


def form_faults(trajectory: Trajectory, dof: int) -> list[str]:
    """Return why the arrays are not a valid trajectory; empty if they are."""
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
    """Return all faults of a trajectory for an arm at `qpos`; empty if it may go.

    Args:
        qpos: joint positions of the arm now, radians.
        start_tolerance_rad: how far the trajectory may start from `qpos`, in any joint.
    """
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
    ends = np.abs(rates[[0, -1]]).max()
    if ends > _AT_REST_RAD_S:
        faults.append(f"it begins or ends at {ends:.4f} rad/s, not at rest")
    faults += _speed_faults(trajectory, limits, robot)
    faults += _box_faults(path, times, limits, robot)
    return faults


def elbow_link(robot: RobotDescription) -> int:
    """Return the first link beyond the upper arm: its joint is more than 0.2 m from the joint before."""
    lengths = np.linalg.norm(robot.arm.Ts_parent_joint[1:, :3, 3], axis=1)
    far = np.flatnonzero(lengths > _UPPER_ARM_M)
    return int(far[0]) + 1 if len(far) else robot.arm.dof - 1


def _fastest(trajectory: Trajectory) -> Float[np.ndarray, "dof"]:
    """Return the highest speed of each joint, at the samples and between them."""
    between = np.abs(np.diff(trajectory.qpos, axis=0)) / np.diff(trajectory.times_s)[:, None]
    return np.asarray(np.maximum(np.abs(trajectory.qvel).max(axis=0), between.max(axis=0) / _FASTER))


def _hardest(trajectory: Trajectory) -> Float[np.ndarray, "dof"]:
    """Return the highest acceleration of each joint, from differences of its speeds."""
    steps = np.abs(np.diff(trajectory.qvel, axis=0)) / np.diff(trajectory.times_s)[:, None]
    return np.asarray(steps.max(axis=0) / _HARDER)


def _tcp_speed_m_s(trajectory: Trajectory, robot: RobotDescription) -> float:
    tcp = (tool0_poses(robot.arm, trajectory.qpos) @ robot.gripper.T_tool0_tcp(0.0))[:, :3, 3]
    steps = np.linalg.norm(np.diff(tcp, axis=0), axis=1) / np.diff(trajectory.times_s)
    return float(steps.max()) / _FASTER


def _speed_faults(trajectory: Trajectory, limits: MotionLimits, robot: RobotDescription) -> list[str]:
    found = []
    for what, unit, highest, allowed in (
        ("moves at", "rad/s", _fastest(trajectory), limits.max_speed),
        ("accelerates by", "rad/s2", _hardest(trajectory), limits.max_acceleration),
    ):
        joint = int((highest / allowed).argmax())
        if highest[joint] > allowed[joint] * (1 + 1e-6):
            found.append(
                f"joint {joint + 1} {what} {highest[joint]:.3f} {unit}; {allowed[joint]:.3f} are allowed"
            )
    tcp_m_s = _tcp_speed_m_s(trajectory, robot)
    if tcp_m_s > limits.tcp_speed_m_s * (1 + 1e-6):
        found.append(f"the TCP moves at {tcp_m_s:.3f} m/s; {limits.tcp_speed_m_s:.3f} are allowed")
    return found


def outside_box(
    places: Float[np.ndarray, "n k 3"], times: Float[np.ndarray, "n"], limits: MotionLimits, what: str
) -> list[str]:
    """Return a fault if something leaves the box of `limits`; else nothing.

    Args:
        places: positions of k of its points at n times, world frame, metres.
        times: those times, seconds.
        what: its name in the message.
    """
    outside = np.argwhere(((places < limits.box_lower) | (places > limits.box_upper)).any(axis=2))
    if not len(outside):
        return []
    row, k = outside[0]
    at = ", ".join(f"{v:.2f}" for v in places[row, k])
    return [f"{what} is at ({at}) m after {times[row]:.2f} s, outside of the workspace"]


def _box_faults(
    path: np.ndarray, times: np.ndarray, limits: MotionLimits, robot: RobotDescription
) -> list[str]:
    flange = tool0_poses(robot.arm, path)
    tcp = flange @ robot.gripper.T_tool0_tcp(0.0)
    link = robot.spheres.link
    forearm = sphere_centers(robot, path, np.zeros(len(path)))[
        :, (link >= elbow_link(robot)) & (link < robot.arm.dof)
    ]
    parts = (
        ("the TCP", tcp[:, None, :3, 3]),
        ("the flange", flange[:, None, :3, 3]),
        ("the arm from its elbow on", forearm),
    )
    found = (outside_box(places, times, limits, what) for what, places in parts)
    return next((faults for faults in found if faults), [])
