"""Check whether a server's motion may be carried out: its ends, the joint limits, its speed, and contacts."""

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicHermiteSpline

from torc.collision.contact_kernels import edges_batch
from torc.geometry.transforms import kernel_array
from torc.motion.config import MotionConfig
from torc.motion.space import FreeSpace, MotionQuery, loosened
from torc.records import Trajectory
from torc.robots.description import ArmDescription
from torc_networks.fields import Motion

_NEAR_RAD = 2e-3
_LIMIT_RAD = 1e-3
_LONGEST_S = 120.0


class UnusableMotionError(Exception):
    """A motion does not fit the query: the server did not do what it was asked to."""


def usable_trajectory(
    motion: Motion, query: MotionQuery, arm: ArmDescription, config: MotionConfig
) -> tuple[Trajectory, int]:
    """Return the motion as it will be carried out, and the index of the goal it leads to; contacts are not checked.

    Start and end are made exact, and a motion that is too fast for the arm is slowed down as a whole. Raises
    UnusableMotionError if it begins or ends elsewhere, leaves the joint limits, or takes longer than two minutes.
    """
    times, qpos = motion.times_s, motion.qpos
    gaps = np.abs(query.goals - qpos[-1]).max(axis=1)
    chosen = int(np.argmin(gaps))
    start_gap = float(np.abs(qpos[0] - query.start).max())
    if start_gap > _NEAR_RAD:
        raise UnusableMotionError(f"the motion begins {start_gap:.3f} rad from where the arm is.")
    if gaps[chosen] > _NEAR_RAD:
        raise UnusableMotionError(f"the motion ends {gaps[chosen]:.3f} rad from the nearest goal.")
    _check_limits(qpos, arm)
    share = (times / times[-1])[:, None]
    qpos = qpos + (1 - share) * (query.start - qpos[0]) + share * (query.goals[chosen] - qpos[-1])
    trajectory = _slowed(times, qpos, arm, config)
    _check_limits(trajectory.qpos, arm)
    return trajectory, chosen


def stays_free(trajectory: Trajectory, space: FreeSpace, grazing_m: float) -> bool:
    """Check that nothing is touched on the way, between the samples either; paddings may be entered by grazing_m."""
    strict = loosened(space, grazing_m)
    if strict.collides(trajectory.qpos).any():
        return False
    starts, ends = kernel_array(trajectory.qpos[:-1]), kernel_array(trajectory.qpos[1:])
    n = len(starts)
    width_m, *scene = strict.scene
    return not edges_batch(starts, ends, np.full(n, width_m), np.zeros(n, np.uint64), *scene).any()


def _slowed(
    times: Float[np.ndarray, "t"], qpos: Float[np.ndarray, "t dof"], arm: ArmDescription, config: MotionConfig
) -> Trajectory:
    """Sample as torc's own trajectories are, at rest at both ends, as slowly as the arm needs."""
    speeds = np.gradient(qpos, times, axis=0)
    speeds[0] = speeds[-1] = 0.0
    path, timing = CubicHermiteSpline(times, qpos, speeds), config.timing
    speed, acceleration = _extremes(times, qpos, speeds)
    speed = speed / (timing.speed_scale * arm.max_speed)
    acceleration = acceleration / (timing.acceleration_scale * arm.max_acceleration)
    slower = max(1.0, float(speed.max()), float(np.sqrt(acceleration.max())))
    duration = slower * float(times[-1])
    if not duration <= _LONGEST_S:
        raise UnusableMotionError(
            f"the motion would take {duration:.0f} s; {_LONGEST_S:.0f} s is the longest."
        )
    at = np.linspace(0.0, times[-1], max(2, int(np.ceil(duration / timing.sample_s)) + 1))
    qvel = path(at, 1) / slower
    qvel[0] = qvel[-1] = 0.0
    return Trajectory(slower * at, path(at), qvel)


def _extremes(
    times: Float[np.ndarray, "t"], qpos: Float[np.ndarray, "t dof"], speeds: Float[np.ndarray, "t dof"]
) -> tuple[Float[np.ndarray, "dof"], Float[np.ndarray, "dof"]]:
    """Return the largest speed and acceleration of each joint on the cubics through the samples."""
    h = np.diff(times)[:, None]
    mean, v0, v1 = np.diff(qpos, axis=0) / h, speeds[:-1], speeds[1:]
    a0, a1 = (6 * mean - 4 * v0 - 2 * v1) / h, (2 * v0 + 4 * v1 - 6 * mean) / h
    # The acceleration changes evenly from a0 to a1: where it passes zero the speed is extreme.
    turns = a0 * a1 < 0
    at = np.divide(a0, a0 - a1, out=np.zeros_like(a0), where=turns)
    within = np.abs(v0 + 0.5 * h * a0 * at)
    return np.maximum(np.abs(speeds).max(axis=0), within.max(axis=0)), np.abs([a0, a1]).max(axis=(0, 1))


def _check_limits(qpos: Float[np.ndarray, "t dof"], arm: ArmDescription) -> None:
    over = np.maximum(arm.lower - qpos, qpos - arm.upper).max()
    if over > _LIMIT_RAD:
        raise UnusableMotionError(
            f"the motion leaves the joint limits by {over:.3f} rad: has the server other limits?"
        )
