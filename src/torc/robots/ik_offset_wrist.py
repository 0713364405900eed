"""Closed-form inverse kinematics of 7 joints with a spherical shoulder, whose last axis misses the wrist, as a Panda's.

With axes w0 .. w6, the flange pose T0 at q = 0 and T = e0 e1 .. e6 T0 (product of exponentials), S the shoulder and W
where axes w4 and w5 meet: the last angle is the free one, sampled (as by He and Liu, "Analytical Inverse Kinematics for
Franka Emika Panda", 2021). For each:

1. the elbow angle follows from the distance |S W|, two solutions;
2. the shoulder turns the arm's W on to the wanted W; its turn about S W by the angle between w4 and w5, two solutions;
3. the shoulder's rotation is split into three angles, two solutions, and the rest into two.
"""

from typing import Any

import numpy as np
from numba import njit

from torc.robots.description import ArmDescription
from torc.robots.ik_ranking import add_turns, rank_solutions, wrap_into_limits, wrap_near
from torc.robots.ik_subproblems import (
    angle_between,
    apply,
    common_point,
    dot,
    elbow_angles,
    joint_lines,
    matmul,
    matmul_transposed,
    shortest_rotation,
    split_rotation,
    turns_to_plane,
)
from torc.robots.kinematics_kernels import rotate_about

FINER = 8
"""Factor on the number of last angles tried for a pose that seems out of reach."""

OffsetWristStructure = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""At q = 0, world frame: axes (7, 3), shoulder (3,), a point of the elbow axis (3,), wrist (3,), a point of the last
axis (3,), inverse flange pose (4, 4)."""


def detect_offset_wrist(arm: ArmDescription) -> OffsetWristStructure | None:
    """Return the arm's structure, or None.

    It takes 7 joints, the first three axes meeting in one point, neighbours at right angles, and the fifth meeting the
    sixth.
    """
    if arm.dof != 7:
        return None
    axes, points, T0_inverse = joint_lines(arm)
    shoulder, wrist = common_point(axes[:3], points[:3]), common_point(axes[4:6], points[4:6])
    right = [abs(axes[i] @ axes[i + 1]) < 1e-6 for i in (0, 1)]
    if shoulder is None or wrist is None or not all(right):
        return None
    return axes, shoulder, points[3].copy(), wrist, points[6].copy(), T0_inverse


@njit(cache=True)
def _solve_pose(
    T: np.ndarray, structure: tuple[Any, ...], samples: int, lower: np.ndarray, upper: np.ndarray, rest: np.ndarray,
    solutions: np.ndarray,
) -> int:  # fmt: skip
    """Write all branches of one pose within the limits to solutions (capacity, 7); return how many."""
    axes, shoulder, elbow, wrist, last, T0_inverse = structure
    work, elbows, swivels, first = np.zeros((6, 3)), np.zeros(2), np.zeros(2), np.zeros((2, 3))
    R, G, R3, Rmin, Rs, turn, M = np.zeros((7, 3, 3))
    t, v, p, unit, a, b = np.zeros((6, 3))
    q, count = np.zeros(7), 0
    # T T0^-1 as a rotation R and a translation t.
    matmul(T, T0_inverse, R)
    apply(T, T0_inverse[:3, 3], t)
    t += T[:3, 3]
    for k in range(samples):
        q[6] = lower[6] + (k + 0.5) / samples * (upper[6] - lower[6])
        rotate_about(axes[6], -q[6], turn)
        matmul(R, turn, G)
        # Where W must be: T T0^-1 e6^-1 of it, seen from the shoulder.
        apply(turn, wrist - last, v)
        v += last
        apply(R, v, p)
        p += t - shoulder
        reach = np.sqrt(dot(p, p))
        if reach < 1e-9:
            continue
        unit[:] = p / reach
        apply(G, axes[5], a)
        for e in range(elbow_angles(axes[3], elbow, shoulder, wrist, reach, elbows)):
            q[3] = elbows[e]
            if np.isnan(wrap_near(q[3], lower[3], upper[3], rest[3])):
                continue
            rotate_about(axes[3], q[3], R3)
            apply(R3, wrist - elbow, v)
            v += elbow - shoulder
            shortest_rotation(v, p, Rmin, work)
            apply(R3, axes[4], v)
            apply(Rmin, v, b)
            for s in range(turns_to_plane(unit, b, a, dot(axes[4], axes[5]), swivels, work[0])):
                rotate_about(unit, swivels[s], turn)
                matmul(turn, Rmin, Rs)
                matmul_transposed(Rs, G, turn)
                matmul_transposed(R3, turn, M)  # e4 e5
                apply(M, axes[5], v)
                q[4] = angle_between(axes[5], v, axes[4], work[0])
                for i in range(3):
                    v[i] = M[0, i] * axes[4, 0] + M[1, i] * axes[4, 1] + M[2, i] * axes[4, 2]
                q[5] = angle_between(v, axes[4], axes[5], work[0])
                for f in range(split_rotation(Rs, axes[0], axes[1], axes[2], first, work)):
                    q[:3] = first[f]
                    if count < solutions.shape[0]:
                        solutions[count] = q
                        if wrap_into_limits(solutions[count], lower, upper, rest):
                            count += 1
    return count


@njit(cache=True)
def offset_wrist_ik_kernel(
    Ts: np.ndarray, structure: tuple[Any, ...], samples: int, lower: np.ndarray, upper: np.ndarray, rest: np.ndarray,
    soft_margin: float, limit_weight: float, out: np.ndarray, counts: np.ndarray,
) -> None:  # fmt: skip
    """Solve poses (n, 4, 4): branches, best first, into out (n, capacity, 7) and counts (n,)."""
    solutions = np.empty((out.shape[1], out.shape[2]))
    for k in range(Ts.shape[0]):
        count = _solve_pose(Ts[k], structure, samples, lower, upper, rest, solutions)
        if count == 0:
            count = _solve_pose(Ts[k], structure, FINER * samples, lower, upper, rest, solutions)
        count = add_turns(lower, upper, solutions, count)
        rank_solutions(lower, upper, rest, soft_margin, limit_weight, solutions, count, out[k])
        counts[k] = count
