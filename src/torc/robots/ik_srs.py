"""Closed-form inverse kinematics of spherical-revolute-spherical arms of 7 joints (shoulder, elbow, wrist).

With the arm's joint axes w0..w6 and the flange pose T0 at q = 0, the flange is T = e0 e1 e2 e3 e4 e5 e6 T0, each e
a turn about its axis (product of exponentials). Joints 0-2 turn about the shoulder S and joints 4-6 about the wrist W:

1. the elbow angle follows from the distance |S W|, two solutions (Paden and Kahan's third subproblem);
2. the shoulder must then turn the arm's W onto the wanted W, which leaves one free angle: the swivel, sampled;
3. shoulder and wrist rotations are split into three angles each, two solutions per split.
"""

from typing import Any

import numpy as np
from numba import njit

from torc.robots.description import ArmDescription
from torc.robots.ik_ranking import add_turns, rank_solutions, wrap_into_limits
from torc.robots.ik_subproblems import (
    apply,
    common_point,
    dot,
    elbow_angles,
    joint_lines,
    matmul,
    matmul_transposed,
    shortest_rotation,
    split_rotation,
)
from torc.robots.kinematics_kernels import rotate_about

FINER = 8
"""Factor on the number of swivel angles tried for a pose that seems out of reach."""


SrsStructure = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""At q = 0, world frame: axes (7, 3), shoulder (3,), a point of the elbow axis (3,), wrist (3,),
inverse flange pose (4, 4)."""


def detect_srs(arm: ArmDescription) -> SrsStructure | None:
    """Return the arm's S-R-S structure, or None.

    It takes 7 joints, the first three axes meeting in one point and the last three in another, neighbours of each three
    at right angles.
    """
    if arm.dof != 7:
        return None
    axes, points, T0_inverse = joint_lines(arm)
    shoulder, wrist = (common_point(axes[i : i + 3], points[i : i + 3]) for i in (0, 4))
    right = [abs(axes[i] @ axes[i + 1]) < 1e-6 for i in (0, 1, 4, 5)]
    if shoulder is None or wrist is None or not all(right):
        return None
    return axes, shoulder, points[3].copy(), wrist, T0_inverse


@njit(cache=True)
def _solve_pose(
    T: np.ndarray, structure: tuple[Any, ...], swivels: int, lower: np.ndarray, upper: np.ndarray, rest: np.ndarray,
    solutions: np.ndarray,
) -> int:  # fmt: skip
    """Write all branches of one pose within the limits to solutions (capacity, 7); return how many."""
    axes, shoulder, elbow, wrist, T0_inverse = structure
    work, elbows = np.zeros((6, 3)), np.zeros(2)
    R, R3, Rmin, Rs, Rw, turn = np.zeros((6, 3, 3))
    first, last = np.zeros((2, 3)), np.zeros((2, 3))
    v, p, unit, q = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(7)
    matmul(T, T0_inverse, R)
    # The wrist does not move with joints 4-6: its wanted position is that of the point W of the flange.
    apply(T0_inverse, wrist, v)
    v += T0_inverse[:3, 3]
    apply(T, v, p)
    p += T[:3, 3] - shoulder
    reach = np.sqrt(dot(p, p))
    if reach < 1e-9:
        return 0
    unit[:] = p / reach
    count = 0
    for e in range(elbow_angles(axes[3], elbow, shoulder, wrist, reach, elbows)):
        rotate_about(axes[3], elbows[e], R3)
        apply(R3, wrist - elbow, v)
        v += elbow - shoulder
        shortest_rotation(v, p, Rmin, work)
        for k in range(swivels):
            rotate_about(unit, 2.0 * np.pi * k / swivels, turn)
            matmul(turn, Rmin, Rs)
            matmul_transposed(Rs, R, turn)
            matmul_transposed(R3, turn, Rw)
            n_first = split_rotation(Rs, axes[0], axes[1], axes[2], first, work)
            n_last = split_rotation(Rw, axes[4], axes[5], axes[6], last, work)
            for i in range(n_first):
                for j in range(n_last):
                    q[:3], q[3], q[4:] = first[i], elbows[e], last[j]
                    if count < solutions.shape[0] and wrap_into_limits(q, lower, upper, rest):
                        solutions[count] = q
                        count += 1
    return count


@njit(cache=True)
def srs_ik_kernel(
    Ts: np.ndarray, structure: tuple[Any, ...], swivels: int, lower: np.ndarray, upper: np.ndarray, rest: np.ndarray,
    soft_margin: float, limit_weight: float, out: np.ndarray, counts: np.ndarray,
) -> None:  # fmt: skip
    """Solve poses (n, 4, 4): branches, best first, into out (n, capacity, 7) and counts (n,)."""
    solutions = np.empty((out.shape[1], out.shape[2]))
    for k in range(Ts.shape[0]):
        count = _solve_pose(Ts[k], structure, swivels, lower, upper, rest, solutions)
        if count == 0:
            # The elbow may have room in a gap narrower than the steps tried.
            count = _solve_pose(Ts[k], structure, FINER * swivels, lower, upper, rest, solutions)
        count = add_turns(lower, upper, solutions, count)
        rank_solutions(lower, upper, rest, soft_margin, limit_weight, solutions, count, out[k])
        counts[k] = count
