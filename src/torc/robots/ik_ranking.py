"""Shared by the inverse-kinematics solvers: angles within limits, and the order of the solutions."""

import numpy as np
from numba import njit

TWO_PI = 2.0 * np.pi


@njit(cache=True)
def wrap_near(angle: float, lower: float, upper: float, preferred: float) -> float:
    """Return the angle modulo 2 pi within the limits that is nearest to `preferred`; NaN if there is none."""
    first = angle + TWO_PI * np.ceil((lower - angle - 1e-12) / TWO_PI)
    best, distance = np.nan, np.inf
    while first <= upper + 1e-12:
        if abs(first - preferred) < distance:
            best, distance = first, abs(first - preferred)
        first += TWO_PI
    return min(max(best, lower), upper) if distance < np.inf else np.nan


@njit(cache=True)
def wrap_into_limits(q: np.ndarray, lower: np.ndarray, upper: np.ndarray, preferred: np.ndarray) -> bool:
    """Turn the angles of q by multiples of 2 pi into the limits, in place; return False if one cannot be."""
    for i in range(q.shape[0]):
        q[i] = wrap_near(q[i], lower[i], upper[i], preferred[i])
        if np.isnan(q[i]):
            return False
    return True


@njit(cache=True)
def add_turns(lower: np.ndarray, upper: np.ndarray, solutions: np.ndarray, count: int) -> int:
    """Append the solutions 2 pi away in one or more joints, as far as limits and space allow; return the new count."""
    capacity, dof = solutions.shape
    for joint in range(dof):
        for k in range(count):
            for turn in (-TWO_PI, TWO_PI):
                angle = solutions[k, joint] + turn
                while lower[joint] <= angle <= upper[joint] and count < capacity:
                    solutions[count] = solutions[k]
                    solutions[count, joint] = angle
                    count += 1
                    angle += turn
    return count


@njit(cache=True)
def rank_solutions(
    lower: np.ndarray, upper: np.ndarray, rest: np.ndarray, soft_margin: float, limit_weight: float,
    solutions: np.ndarray, count: int, out: np.ndarray,
) -> None:  # fmt: skip
    """Copy solutions to out, by rising cost: squared distance from rest plus a penalty near limits."""
    cost = np.zeros(count)
    for k in range(count):
        for i in range(rest.shape[0]):
            q = solutions[k, i]
            cost[k] += (q - rest[i]) ** 2
            margin = min(q - lower[i], upper[i] - q)
            if margin < soft_margin:
                cost[k] += limit_weight * (1.0 - margin / soft_margin) ** 2
    order = np.argsort(cost, kind="mergesort")
    for k in range(count):
        out[k] = solutions[order[k]]
