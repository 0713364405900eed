"""Inverse kinematics: every branch of many poses at once.

Arms of three structures are solved in closed form: spherical-revolute-spherical, with a spherical shoulder and an
offset wrist, and with three parallel axes; any other by damped least squares from a fixed set of starts. The
description alone decides which.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float, Int
from numba import njit

from torc.errors import InputError
from torc.geometry.transforms import Pose, invert, kernel_array, make_pose
from torc.parallel import by_rows
from torc.robots.description import ArmDescription, RobotDescription
from torc.robots.ik_kernels import Joints, wrap_into_limits, write_best_first
from torc.robots.ik_seven import detect_offset_wrist, detect_srs, offset_wrist_ik_kernel, srs_ik_kernel
from torc.robots.ik_six import detect_parallel, parallel_ik_kernel
from torc.robots.kinematics import chain_of, forward, jacobian, pose_error, pose_step

DISTINCT_RAD = 0.02
"""Solutions closer than this in every joint count as one: redundant arms have a continuum of them."""


def _starts(arm: ArmDescription, n: int) -> Float[np.ndarray, "n dof"]:
    """Return the rest configuration, then points spread evenly over the joint ranges, always the same.

    A Kronecker sequence on the generalised golden ratio (M. Roberts' R sequence).
    """
    ratio = 2.0
    for _ in range(60):
        ratio = (1.0 + ratio) ** (1.0 / (arm.dof + 1.0))
    steps = ratio ** -np.arange(1.0, arm.dof + 1.0)
    points = (0.5 + np.arange(n)[:, None] * steps) % 1.0
    out = arm.lower + points * (arm.upper - arm.lower)
    out[0] = arm.rest_qpos
    return out


@njit(cache=True)
def _descend(goal, chain, joints, iterations, tolerance, q):
    """Improve q in place; return whether it reached the goal within the tolerance."""
    dof = q.shape[0]
    Ts, trial_Ts, scratch = np.empty((dof + 1, 3, 4)), np.empty((dof + 1, 3, 4)), np.empty((2, 3, 4))
    J, error, trial_error = np.empty((6, dof)), np.empty(6), np.empty(6)
    trial, step, work, damping = np.empty(dof), np.empty(dof), np.empty((7, 6)), 1e-3
    forward(q, chain, Ts, scratch)
    worst = pose_error(Ts[dof], goal, error)
    for _ in range(iterations):
        if worst < tolerance:
            return True
        jacobian(Ts, chain.axes, J)
        pose_step(J, error, damping, work, step)
        trial[:] = np.minimum(np.maximum(q + step, joints.lower), joints.upper)
        forward(trial, chain, trial_Ts, scratch)
        trial_worst = pose_error(trial_Ts[dof], goal, trial_error)
        if np.sum(trial_error**2) < np.sum(error**2):
            q[:], Ts[:], error[:], worst = trial, trial_Ts, trial_error, trial_worst
            damping = max(damping * 0.2, 1e-12)
        else:
            damping = damping * 5.0
            if damping > 1e4:
                return False
    return worst < tolerance


@njit(cache=True, nogil=True)
def numeric_ik_kernel(Ts, chain, starts, iterations, tolerance, joints, out, counts):
    """Solve poses (n, 4, 4): distinct solutions, best first, into out (n, capacity, dof) and counts (n,)."""
    solutions = np.empty(out.shape[1:])
    for k in range(len(Ts)):
        count = 0
        for s in range(starts.shape[0]):
            q = starts[s].copy()
            reached = _descend(Ts[k], chain, joints, iterations, tolerance, q)
            if not reached or not wrap_into_limits(q, joints) or count >= solutions.shape[0]:
                continue
            known = False
            for i in range(count):
                known = known or np.max(np.abs(solutions[i] - q)) < DISTINCT_RAD
            if not known:
                solutions[count] = q
                count += 1
        counts[k] = write_best_first(solutions, count, joints, out[k])


CHUNK = 512
"""Poses per kernel call; bounds the memory for all their branches."""


@dataclass(frozen=True)
class IkConfig:
    """How inverse kinematics is solved.

    Attributes:
        swivel_angles: samples per pose of what the seventh joint leaves free (closed form): elbow positions evenly
            around the circle, or angles of the last joint. More find tighter gaps in clutter and take proportionally
            longer.
        soft_margin_rad: solutions whose joints are closer than this to a limit are ranked lower, by up to
            `limit_weight` per joint, in units of squared radians from rest.
        starts: numerical solver: starting configurations per pose.
        tolerance: numerical solver: largest error of a solution, metres and radians.
    """

    swivel_angles: int = 16
    max_branches: int = 192
    soft_margin_rad: float = 0.2
    limit_weight: float = 4.0
    starts: int = 32
    iterations: int = 60
    tolerance: float = 1e-8


@dataclass(frozen=True)
class IkSolutions:
    """Solutions per pose, best first: joint positions, radians, NaN beyond `count`, which is 0 if unreachable."""

    qpos: Float[np.ndarray, "n b dof"]
    count: Int[np.ndarray, "n"]

    def of(self, i: int) -> Float[np.ndarray, "m dof"]:
        """Return the solutions of pose i."""
        return self.qpos[i, : self.count[i]]


def solve_ik(
    arm: ArmDescription, Ts_world_tool0: Float[np.ndarray, "n 4 4"], config: IkConfig | None = None
) -> IkSolutions:
    """Return all solutions found for each pose of the flange, within the joint limits, including angles 2 pi apart.

    They are ranked by distance from the rest configuration with a penalty near joint limits. Raises InputError if a
    pose is not a rigid transform.
    """
    config = config or IkConfig()
    Ts = kernel_array(Ts_world_tool0)
    _check_poses(Ts)
    solve = closed_form(arm, config) or _numeric(arm, config)
    joints = Joints(arm.lower, arm.upper, arm.rest_qpos, config.soft_margin_rad, config.limit_weight)
    count, parts = np.zeros(len(Ts), dtype=np.int64), []
    for i in range(0, len(Ts), CHUNK):
        some = Ts[i : i + CHUNK]
        out = np.empty((len(some), config.max_branches, arm.dof))
        by_rows(lambda T, found, n: solve(T, joints, found, n), (some, out, count[i : i + CHUNK]))
        parts.append(out[:, : max(1, int(count[i : i + CHUNK].max()))].copy())
    qpos = np.full((len(Ts), max([1, *[part.shape[1] for part in parts]]), arm.dof), np.nan)
    for i, part in zip(range(0, len(Ts), CHUNK), parts):
        qpos[i : i + CHUNK, : part.shape[1]] = part
    qpos[np.arange(qpos.shape[1]) >= count[:, None]] = np.nan
    return IkSolutions(qpos, count)


def _check_poses(Ts: np.ndarray) -> None:
    if Ts.ndim != 3 or Ts.shape[1:] != (4, 4):
        raise InputError(f"Poses must be (n, 4, 4); they are {Ts.shape}.")
    R = Ts[:, :3, :3]
    error = np.abs(np.swapaxes(R, 1, 2) @ R - np.eye(3)).max(axis=(1, 2), initial=0.0)
    bad = ~((error < 1e-6) & (np.linalg.det(R) > 0) & np.isfinite(Ts).all(axis=(1, 2)))
    if bad.any():
        first = int(np.flatnonzero(bad)[0])
        raise InputError(f"Pose {first} is not a rigid transform; normalise its rotation.")


Solver = Callable[[np.ndarray, Joints, np.ndarray, np.ndarray], None]
"""Solves poses (n, 4, 4) for joints; writes to the arrays for solutions and counts."""


@lru_cache(maxsize=32)
def closed_form(arm: ArmDescription, config: IkConfig) -> Solver | None:
    """Return the solver of the arm's structure; None if it has none of them."""
    if (srs := detect_srs(arm)) is not None:
        return lambda Ts, *rest: srs_ik_kernel(Ts, srs, config.swivel_angles, *rest)
    if (offset := detect_offset_wrist(arm)) is not None:
        return lambda Ts, *rest: offset_wrist_ik_kernel(Ts, offset, 2 * config.swivel_angles, *rest)
    if (parallel := detect_parallel(arm)) is not None:
        return lambda Ts, *rest: parallel_ik_kernel(Ts, parallel, *rest)
    return None


def _numeric(arm: ArmDescription, config: IkConfig) -> Solver:
    chain, starts = chain_of(arm), _starts(arm, config.starts)
    return lambda Ts, *rest: numeric_ik_kernel(Ts, chain, starts, config.iterations, config.tolerance, *rest)


_TILTS_RAD = (0.0, np.pi / 4, np.pi / 2)
"""Tilts of the approach: straight down, slanting, level."""


def reached(robot: RobotDescription, points: Float[np.ndarray, "n 3"]) -> Bool[np.ndarray, "n"]:
    """Check whether the half-open gripper's TCP reaches each point (world frame, metres), ignoring collisions.

    It comes from above, slanting, or level and away from the base.
    """
    T_tcp_tool0 = invert(robot.gripper.T_tool0_tcp(robot.gripper.max_width_m / 2))
    Ts = [_approach(robot, point, tilt) @ T_tcp_tool0 for point in points for tilt in _TILTS_RAD]
    found = solve_ik(robot.arm, np.array(Ts)).count > 0
    return np.asarray(found.reshape(len(points), -1).any(axis=1))


def _approach(robot: RobotDescription, point: Float[np.ndarray, "3"], tilt_rad: float) -> Pose:
    """Return the TCP's pose at a point: z the approach, tilted from straight down away from the base; x level."""
    away = point[:2] - robot.arm.T_world_base[:2, 3]
    distance = float(np.linalg.norm(away))
    # Above the base every direction leads away.
    away = away / distance if distance > 1e-6 else np.array([1.0, 0.0])
    z = np.array([*(np.sin(tilt_rad) * away), -np.cos(tilt_rad)])
    x = np.array([-away[1], away[0], 0.0])
    return make_pose(np.column_stack([x, np.cross(z, x), z]), point)
