"""Closed-form inverse kinematics of 6 joints with the second to fourth parallel, such as a UR's.

With axes w0 .. w5, the flange pose T0 at q = 0 and T = e0 e1 e2 e3 e4 e5 T0 (product of exponentials), n the direction
of the parallel axes and P where the last two axes meet:

1. e1 e2 e3 do not move P along n: that gives the first joint, two solutions;
2. they do not turn n either: that gives the fifth joint, two solutions, and then the last;
3. what remains is a planar arm of two links: the third joint by the distance it has to span, two solutions, then the
   second; and the fourth by the whole turn about n.
"""

import numpy as np
from numba import njit

from torc.robots.description import ArmDescription
from torc.robots.ik_kernels import (
    Structure,
    angle_between,
    apply,
    cross,
    dot,
    elbow_angles,
    matmul,
    structure_of,
    turns_to_plane,
    wrap_into_limits,
    write_best_first,
)
from torc.robots.kinematics import rotate_about


def detect_parallel(arm: ArmDescription) -> Structure | None:
    """Return the structure of an arm whose second to fourth axes are parallel and whose last two meet, or None.

    All other neighbours must be at right angles.
    """
    structure = structure_of(arm, slice(0, 1), slice(4, 6), (0, 3, 4)) if arm.dof == 6 else None
    if (
        structure is None
        or np.linalg.norm(np.cross(structure.axes[1], structure.axes[2:4]), axis=1).max() >= 1e-6
    ):
        return None
    return structure


@njit(cache=True)
def _solve_pose(T, structure, joints, solutions):
    """Write all branches of one pose within the limits to solutions (capacity, 6); return how many."""
    axes, points, T0_inverse, _, wrist = structure
    n = axes[1]
    R, R0, R5, R4, turn, M = np.zeros((6, 3, 3))
    t, v, p, x, work = np.zeros((5, 3))
    first, fifth, third = np.zeros(2), np.zeros(2), np.zeros(2)
    q, count = np.zeros(6), 0
    # G = T T0^-1 as a rotation R and a translation t.
    matmul(T, T0_inverse, R)
    apply(T, T0_inverse[:3, 3], t)
    t += T[:3, 3]
    apply(R, wrist, p)
    p += t - points[0]
    for a in range(turns_to_plane(-axes[0], p, n, dot(n, wrist) - dot(n, points[0]), first, work)):
        rotate_about(axes[0], -first[a], R0)
        matmul(R0, R, M)
        apply(M, axes[5], v)
        for b in range(turns_to_plane(axes[4], axes[5], n, dot(n, v), fifth, work)):
            q[0], q[4] = first[a], fifth[b]
            matmul(R0, R, M)
            rotate_about(axes[4], -q[4], R4)
            # The last joint: rot(w5) M^T n = rot(w4)^-1 n. If w5 is along n, any angle will do.
            apply(M.T, n, v)
            apply(R4, n, x)
            cross(axes[5], v, work)
            q[5] = angle_between(v, x, axes[5], work) if dot(work, work) > 1e-14 else joints.rest[5]
            rotate_about(axes[5], -q[5], R5)
            matmul(R5, R4, turn)
            matmul(M, turn, R5)  # e1 e2 e3, a turn about n
            apply(R5, axes[0], v)
            whole = angle_between(axes[0], v, n, work)
            # Where e1 e2 bring the point of the fourth axis: e0^-1 G e5^-1 e4^-1 of it, seen from the second axis.
            apply(turn, points[3] - wrist, v)
            v += wrist
            apply(R, v, x)
            x += t - points[0]
            apply(R0, x, p)
            p += points[0] - points[1]
            reach = np.sqrt(dot(p, p))
            for c in range(elbow_angles(axes[2], points[2], points[1], points[3], reach, third)):
                q[2] = third[c]
                rotate_about(axes[2], q[2], turn)
                apply(turn, points[3] - points[2], v)
                v += points[2] - points[1]
                q[1] = angle_between(v, p, axes[1], work)
                q[3] = dot(axes[3], n) * (whole - q[1] - dot(axes[2], n) * q[2])
                solutions[count] = q
                if wrap_into_limits(solutions[count], joints):
                    count += 1
    return count


@njit(cache=True, nogil=True)
def parallel_ik_kernel(Ts, structure, joints, out, counts):
    """Solve poses (n, 4, 4): branches, best first, into out (n, capacity, 6) and counts (n,)."""
    solutions = np.empty((max(8, out.shape[1]), out.shape[2]))
    for k in range(len(Ts)):
        count = _solve_pose(Ts[k], structure, joints, solutions)
        counts[k] = write_best_first(solutions, count, joints, out[k])
