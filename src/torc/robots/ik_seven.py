"""Closed-form inverse kinematics of 7 joints with a spherical shoulder (product of exponentials: see `ik_kernels`).

S is the shoulder, where axes w0, w1 and w2 meet, W the wrist. One angle is free, and sampled:

- With a spherical wrist, where w4, w5 and w6 meet, it is the swivel, the arm's turn about the line S W.
- If only w4 and w5 meet and the last axis passes by, as a Panda's, it is the last angle (as by He and Liu, "Analytical
  Inverse Kinematics for Franka Emika Panda", 2021). The turn about S W then follows from the angle between w4 and w5,
  two solutions.

In both cases the elbow angle follows from the distance |S W|, two solutions (Paden and Kahan's third subproblem); the
shoulder turns the arm's W onto the wanted one; and the rotations of shoulder and wrist are split into angles.
"""

import numpy as np
from numba import njit

from torc.robots.description import ArmDescription
from torc.robots.ik_kernels import (
    FINER,
    Structure,
    angle_between,
    apply,
    dot,
    elbow_angles,
    matmul,
    shortest_rotation,
    split_rotation,
    structure_of,
    turns_to_plane,
    wrap_into_limits,
    wrap_near,
    write_best_first,
)
from torc.robots.kinematics import rotate_about


def detect_srs(arm: ArmDescription) -> Structure | None:
    """Return the structure of an arm with spherical shoulder and wrist, neighbours in each at right angles, or None."""
    return structure_of(arm, slice(0, 3), slice(4, 7), (0, 1, 4, 5)) if arm.dof == 7 else None


def detect_offset_wrist(arm: ArmDescription) -> Structure | None:
    """Return the structure of an arm with a spherical shoulder, as above, whose fifth axis meets the sixth, or None."""
    return structure_of(arm, slice(0, 3), slice(4, 6), (0, 1)) if arm.dof == 7 else None


@njit(cache=True, nogil=True)
def srs_ik_kernel(Ts, structure, swivels, joints, out, counts):
    """Solve poses (n, 4, 4): branches, best first, into out (n, capacity, 7) and counts (n,)."""
    solutions = np.empty(out.shape[1:])
    for k in range(len(Ts)):
        count = _solve_srs(Ts[k], structure, swivels, joints, solutions)
        if count == 0:
            count = _solve_srs(Ts[k], structure, FINER * swivels, joints, solutions)
        counts[k] = write_best_first(solutions, count, joints, out[k])


@njit(cache=True, nogil=True)
def offset_wrist_ik_kernel(Ts, structure, samples, joints, out, counts):
    """Solve poses (n, 4, 4): branches, best first, into out (n, capacity, 7) and counts (n,)."""
    solutions = np.empty(out.shape[1:])
    for k in range(len(Ts)):
        count = _solve_offset(Ts[k], structure, samples, joints, solutions)
        if count == 0:
            count = _solve_offset(Ts[k], structure, FINER * samples, joints, solutions)
        counts[k] = write_best_first(solutions, count, joints, out[k])


@njit(cache=True)
def _solve_srs(T, structure, swivels, joints, solutions):
    """Write all branches of one pose within the limits to solutions (capacity, 7); return how many."""
    axes, points, T0_inverse, shoulder, wrist = structure
    elbow = points[3]
    work, elbows = np.zeros((9, 3)), np.zeros(2)
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
        q[3] = wrap_near(elbows[e], joints.lower[3], joints.upper[3], joints.rest[3])
        if np.isnan(q[3]):
            continue
        rotate_about(axes[3], elbows[e], R3)
        apply(R3, wrist - elbow, v)
        v += elbow - shoulder
        shortest_rotation(v, p, Rmin, work)
        for k in range(swivels):
            rotate_about(unit, 2.0 * np.pi * k / swivels, turn)
            matmul(turn, Rmin, Rs)
            n_first = split_rotation(Rs, axes[0], axes[1], axes[2], joints, 0, first, work)
            if n_first == 0:
                continue
            matmul(Rs.T, R, turn)
            matmul(R3.T, turn, Rw)
            n_last = split_rotation(Rw, axes[4], axes[5], axes[6], joints, 4, last, work)
            for i in range(n_first):
                for j in range(n_last):
                    if count < solutions.shape[0]:
                        q[:3], q[4:] = first[i], last[j]
                        solutions[count] = q
                        count += 1
    return count


@njit(cache=True)
def _solve_offset(T, structure, samples, joints, solutions):
    """Write all branches of one pose within the limits to solutions (capacity, 7); return how many."""
    axes, points, T0_inverse, shoulder, wrist = structure
    elbow, last, lower, upper = points[3], points[6], joints.lower, joints.upper
    work, elbows, swivels, first = np.zeros((9, 3)), np.zeros(2), np.zeros(2), np.zeros((2, 3))
    R, G, R3, Rmin, Rs, turn, M = np.zeros((7, 3, 3))
    t, v, p, unit, a, b = np.zeros((6, 3))
    q, count = np.zeros(7), 0
    # T T0^-1 as a rotation R and a translation t.
    matmul(T, T0_inverse, R)
    apply(T, T0_inverse[:3, 3], t)
    t += T[:3, 3]
    for k in range(samples):
        sample = lower[6] + (k + 0.5) / samples * (upper[6] - lower[6])
        q[6] = wrap_near(sample, lower[6], upper[6], joints.rest[6])
        rotate_about(axes[6], -sample, turn)
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
            q[3] = wrap_near(elbows[e], lower[3], upper[3], joints.rest[3])
            if np.isnan(q[3]):
                continue
            rotate_about(axes[3], elbows[e], R3)
            apply(R3, wrist - elbow, v)
            v += elbow - shoulder
            shortest_rotation(v, p, Rmin, work)
            apply(R3, axes[4], v)
            apply(Rmin, v, b)
            for s in range(turns_to_plane(unit, b, a, dot(axes[4], axes[5]), swivels, work[0])):
                rotate_about(unit, swivels[s], turn)
                matmul(turn, Rmin, Rs)
                matmul(Rs.T, G, turn)
                matmul(R3.T, turn, M)  # e4 e5
                apply(M, axes[5], v)
                q[4] = angle_between(axes[5], v, axes[4], work[0])
                apply(M.T, axes[4], v)
                q[5] = angle_between(v, axes[4], axes[5], work[0])
                if not wrap_into_limits(q[4:6], joints, 4):
                    continue
                for f in range(split_rotation(Rs, axes[0], axes[1], axes[2], joints, 0, first, work)):
                    if count < solutions.shape[0]:
                        q[:3] = first[f]
                        solutions[count] = q
                        count += 1
    return count
