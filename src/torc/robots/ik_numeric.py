"""Inverse kinematics of any arm by damped least squares (Levenberg-Marquardt) from a fixed set of starts."""

from typing import Any

import numpy as np
from jaxtyping import Float
from numba import njit

from torc.robots.description import ArmDescription
from torc.robots.ik_ranking import add_turns, rank_solutions, wrap_into_limits
from torc.robots.kernels import jacobian_kernel, link_poses_kernel, pose_error

DISTINCT_RAD = 0.02
"""Solutions closer than this in every joint count as the same: redundant arms have a continuum of them."""


def start_configurations(arm: ArmDescription, n: int) -> Float[np.ndarray, "n dof"]:
    """The rest configuration, then points spread evenly over the joint ranges, always the same: a Kronecker sequence on
    the generalised golden ratio (M. Roberts' R sequence).
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
def _descend(
    goal: np.ndarray, chain: tuple[Any, ...], lower: np.ndarray, upper: np.ndarray, iterations: int, tolerance: float,
    q: np.ndarray,
) -> bool:  # fmt: skip
    """Improve q in place; whether it reached the goal within the tolerance."""
    base, parents, axes, tool0 = chain
    dof = q.shape[0]
    Ts, trial_Ts = np.empty((1, dof + 1, 4, 4)), np.empty((1, dof + 1, 4, 4))
    J, error, trial_error = np.empty((6, dof)), np.empty(6), np.empty(6)
    trial, damping = np.empty(dof), 1e-3
    link_poses_kernel(base, parents, axes, tool0, q.reshape(1, dof), Ts)
    worst = pose_error(Ts[0, dof], goal, error)
    for _ in range(iterations):
        if worst < tolerance:
            return True
        jacobian_kernel(Ts[0], axes, J)
        step = J.T @ np.linalg.solve(J @ J.T + damping * np.eye(6), error)
        trial[:] = np.minimum(np.maximum(q + step, lower), upper)
        link_poses_kernel(base, parents, axes, tool0, trial.reshape(1, dof), trial_Ts)
        trial_worst = pose_error(trial_Ts[0, dof], goal, trial_error)
        if np.sum(trial_error**2) < np.sum(error**2):
            q[:], Ts[:], error[:], worst = trial, trial_Ts, trial_error, trial_worst
            damping = max(damping * 0.2, 1e-12)
        else:
            damping = damping * 5.0
            if damping > 1e4:
                return False
    return worst < tolerance


@njit(cache=True)
def numeric_ik_kernel(
    goals: np.ndarray, chain: tuple[Any, ...], starts: np.ndarray, iterations: int, tolerance: float,
    lower: np.ndarray, upper: np.ndarray, rest: np.ndarray, soft_margin: float, limit_weight: float,
    out: np.ndarray, counts: np.ndarray,
) -> None:  # fmt: skip
    """Solve poses (n, 4, 4): distinct solutions, best first, into out (n, capacity, dof) and counts (n,)."""
    solutions = np.empty((out.shape[1], out.shape[2]))
    for k in range(goals.shape[0]):
        count = 0
        for s in range(starts.shape[0]):
            q = starts[s].copy()
            reached = _descend(goals[k], chain, lower, upper, iterations, tolerance, q)
            if not reached or not wrap_into_limits(q, lower, upper, rest) or count >= solutions.shape[0]:
                continue
            known = False
            for i in range(count):
                known = known or np.max(np.abs(solutions[i] - q)) < DISTINCT_RAD
            if not known:
                solutions[count] = q
                count += 1
        count = add_turns(lower, upper, solutions, count)
        rank_solutions(lower, upper, rest, soft_margin, limit_weight, solutions, count, out[k])
        counts[k] = count
