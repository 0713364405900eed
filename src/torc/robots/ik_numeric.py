"""Inverse kinematics of any arm by damped least squares (Levenberg-Marquardt) from a fixed set of starts."""

import numpy as np
from jaxtyping import Float
from numba import njit

from torc.robots.description import ArmDescription
from torc.robots.ik_ranking import add_turns, rank_solutions, wrap_into_limits
from torc.robots.kernels import jacobian_kernel, link_poses_kernel, pose_error

DISTINCT_RAD = 0.02
"""Solutions closer than this in every joint count as the same: redundant arms have a continuum of them."""


def start_configurations(arm: ArmDescription, n: int) -> Float[np.ndarray, "n dof"]:
    """The rest configuration, then points spread evenly over the joint ranges, always the same ones.

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
def _damped_step(J: np.ndarray, error: np.ndarray, damping: float, A: np.ndarray, step: np.ndarray) -> None:
    """step = J^T (J J^T + damping I)^-1 error, by Cholesky's factorisation in A (6, 6)."""
    dof = step.shape[0]
    y = np.empty(6)
    for i in range(6):
        for j in range(i + 1):
            value = damping if i == j else 0.0
            for k in range(dof):
                value += J[i, k] * J[j, k]
            for k in range(j):
                value -= A[i, k] * A[j, k]
            A[i, j] = np.sqrt(max(value, 1e-18)) if i == j else value / A[j, j]
        y[i] = error[i]
        for k in range(i):
            y[i] -= A[i, k] * y[k]
        y[i] /= A[i, i]
    for i in range(5, -1, -1):
        for k in range(i + 1, 6):
            y[i] -= A[k, i] * y[k]
        y[i] /= A[i, i]
    for k in range(dof):
        step[k] = 0.0
        for i in range(6):
            step[k] += J[i, k] * y[i]


@njit(cache=True)
def _descend(
    goal: np.ndarray, chain: tuple, lower: np.ndarray, upper: np.ndarray, iterations: int, tolerance: float,
    q: np.ndarray,
) -> bool:  # fmt: skip
    """Improve q in place; whether it reached the goal within the tolerance."""
    base, parents, axes, tool0 = chain
    dof = q.shape[0]
    Ts, trial_Ts = np.empty((1, dof + 1, 4, 4)), np.empty((1, dof + 1, 4, 4))
    J, A, error, trial_error = np.empty((6, dof)), np.empty((6, 6)), np.empty(6), np.empty(6)
    step, trial, damping = np.empty(dof), np.empty(dof), 1e-3
    link_poses_kernel(base, parents, axes, tool0, q.reshape(1, dof), Ts)
    worst = pose_error(Ts[0, dof], goal, error)
    for _ in range(iterations):
        if worst < tolerance:
            return True
        jacobian_kernel(Ts[0], axes, J)
        _damped_step(J, error, damping, A, step)
        for i in range(dof):
            trial[i] = min(max(q[i] + step[i], lower[i]), upper[i])
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
    goals: np.ndarray, chain: tuple, starts: np.ndarray, iterations: int, tolerance: float,
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
