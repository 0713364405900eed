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

from torc.geometry.transforms import invert
from torc.robots.description import ArmDescription
from torc.robots.ik_ranking import add_turns, rank_solutions, wrap_into_limits
from torc.robots.kernels import rotate_about
from torc.robots.kinematics import link_poses

FINER = 8
"""Times as many swivel angles are tried for a pose that seems out of reach."""


SrsStructure = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""At q = 0, world frame: axes (7, 3), shoulder (3,), a point of the elbow axis (3,), wrist (3,),
inverse flange pose (4, 4)."""


def detect_srs(arm: ArmDescription) -> SrsStructure | None:
    """The arm's S-R-S structure, or None: it takes 7 joints, the first three axes meeting in one point and the last
    three in another, neighbours of each three at right angles.
    """
    if arm.dof != 7:
        return None
    Ts = link_poses(arm, np.zeros((1, 7)))[0]
    axes = np.einsum("kij,kj->ki", Ts[:7, :3, :3], arm.axes)
    points = Ts[:7, :3, 3]
    shoulder, wrist = (_common_point(axes[i : i + 3], points[i : i + 3]) for i in (0, 4))
    right = [abs(axes[i] @ axes[i + 1]) < 1e-6 for i in (0, 1, 4, 5)]
    if shoulder is None or wrist is None or not all(right):
        return None
    return axes, shoulder, points[3].copy(), wrist, invert(Ts[7])


def _common_point(axes: np.ndarray, points: np.ndarray) -> np.ndarray | None:
    """The point all lines pass through, or None (least squares of the distances to the lines)."""
    projectors = np.eye(3) - axes[:, :, None] * axes[:, None, :]
    p = np.linalg.lstsq(projectors.sum(axis=0), np.einsum("kij,kj->i", projectors, points), rcond=None)[0]
    distances = np.linalg.norm(np.einsum("kij,kj->ki", projectors, p - points), axis=1)
    return p if distances.max() < 1e-6 else None


@njit(cache=True)
def _dot(a: np.ndarray, b: np.ndarray) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True)
def _cross(a: np.ndarray, b: np.ndarray, out: np.ndarray) -> None:
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@njit(cache=True)
def _apply(R: np.ndarray, v: np.ndarray, out: np.ndarray) -> None:
    for i in range(3):
        out[i] = R[i, 0] * v[0] + R[i, 1] * v[1] + R[i, 2] * v[2]


@njit(cache=True)
def _matmul(A: np.ndarray, B: np.ndarray, out: np.ndarray) -> None:
    for i in range(3):
        for j in range(3):
            out[i, j] = A[i, 0] * B[0, j] + A[i, 1] * B[1, j] + A[i, 2] * B[2, j]


@njit(cache=True)
def _matmul_transposed(A: np.ndarray, B: np.ndarray, out: np.ndarray) -> None:
    for i in range(3):
        for j in range(3):
            out[i, j] = A[0, i] * B[0, j] + A[1, i] * B[1, j] + A[2, i] * B[2, j]


@njit(cache=True)
def _angle_between(v: np.ndarray, u: np.ndarray, axis: np.ndarray, work: np.ndarray) -> float:
    """Turn about the axis that brings v towards u; 0 if v or u is along the axis (first subproblem)."""
    _cross(v, u, work)
    s, c = _dot(axis, work), _dot(v, u) - _dot(axis, v) * _dot(axis, u)
    return np.arctan2(s, c) if s * s + c * c > 1e-20 else 0.0


@njit(cache=True)
def _split_rotation(
    R: np.ndarray, a: np.ndarray, b: np.ndarray, c: np.ndarray, out: np.ndarray, work: np.ndarray
) -> int:
    """Angles out (2, 3) with R = rot(a) rot(b) rot(c), a and c at right angles to b; how many solutions."""
    u, v, w = work[0], work[1], work[2]
    M = work[3:6]
    _apply(R, c, u)
    _cross(b, c, w)
    middle = np.arctan2(_dot(a, w), _dot(a, c))
    half = np.arccos(min(1.0, max(-1.0, _dot(a, u))))
    n = 2 if 1e-7 < half < np.pi - 1e-7 else 1
    for k in range(n):
        out[k, 1] = middle + (half if k == 0 else -half)
        rotate_about(b, out[k, 1], M)
        _apply(M, c, v)
        out[k, 0] = _angle_between(v, u, a, w)
        # What remains for c: rot(c) b = rot(b)^T rot(a)^T R b, and rot(b) leaves b as it is.
        _apply(R, b, v)
        rotate_about(a, -out[k, 0], M)
        _apply(M, v, w)
        rotate_about(b, -out[k, 1], M)
        _apply(M, w, v)
        out[k, 2] = _angle_between(b, v, c, w)
    return n


@njit(cache=True)
def _shortest_rotation(v: np.ndarray, p: np.ndarray, out: np.ndarray, work: np.ndarray) -> None:
    """The rotation that turns direction v onto direction p about their common normal."""
    axis = work[0]
    _cross(v, p, axis)
    s, c = np.sqrt(_dot(axis, axis)), _dot(v, p)
    if s < 1e-9 * np.sqrt(_dot(v, v) * _dot(p, p)):
        # Parallel or opposite: any axis at right angles will do.
        work[1] = 0.0
        work[1, np.argmin(np.abs(v))] = 1.0
        _cross(v, work[1], axis)
        s = np.sqrt(_dot(axis, axis))
        axis /= s
        rotate_about(axis, 0.0 if c > 0 else np.pi, out)
        return
    axis /= s
    rotate_about(axis, np.arctan2(s, c), out)


@njit(cache=True)
def _elbow_angles(
    axis: np.ndarray,
    elbow: np.ndarray,
    shoulder: np.ndarray,
    wrist: np.ndarray,
    reach: float,
    out: np.ndarray,
) -> int:
    """Turns of the wrist about the elbow's axis after which it is `reach` from the shoulder; how many (0..2)."""
    w, s = wrist - elbow, shoulder - elbow
    along = _dot(axis, w) - _dot(axis, s)
    w_flat, s_flat = w - _dot(axis, w) * axis, s - _dot(axis, s) * axis
    lw, ls = np.sqrt(_dot(w_flat, w_flat)), np.sqrt(_dot(s_flat, s_flat))
    if lw < 1e-9 or ls < 1e-9:
        return 0
    cosine = (lw * lw + ls * ls + along * along - reach * reach) / (2.0 * lw * ls)
    if abs(cosine) > 1.0 + 1e-12:
        return 0
    opening = np.arccos(min(1.0, max(-1.0, cosine)))
    normal = np.empty(3)
    start = _angle_between(w_flat, s_flat, axis, normal)
    out[0], out[1] = start + opening, start - opening
    return 2 if 1e-7 < opening < np.pi - 1e-7 else 1


@njit(cache=True)
def _solve_pose(
    T: np.ndarray, structure: tuple[Any, ...], swivels: int, lower: np.ndarray, upper: np.ndarray, rest: np.ndarray,
    solutions: np.ndarray,
) -> int:  # fmt: skip
    """All branches of one pose within the limits into solutions (capacity, 7); how many."""
    axes, shoulder, elbow, wrist, T0_inverse = structure
    work, elbows = np.zeros((6, 3)), np.zeros(2)
    R, R3, Rmin, Rs, Rw, turn = np.zeros((6, 3, 3))
    first, last = np.zeros((2, 3)), np.zeros((2, 3))
    v, p, unit, q = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(7)
    _matmul(T, T0_inverse, R)
    # The wrist does not move with joints 4-6: its wanted position is that of the point W of the flange.
    _apply(T0_inverse, wrist, v)
    v += T0_inverse[:3, 3]
    _apply(T, v, p)
    p += T[:3, 3] - shoulder
    reach = np.sqrt(_dot(p, p))
    if reach < 1e-9:
        return 0
    unit[:] = p / reach
    count = 0
    for e in range(_elbow_angles(axes[3], elbow, shoulder, wrist, reach, elbows)):
        rotate_about(axes[3], elbows[e], R3)
        _apply(R3, wrist - elbow, v)
        v += elbow - shoulder
        _shortest_rotation(v, p, Rmin, work)
        for k in range(swivels):
            rotate_about(unit, 2.0 * np.pi * k / swivels, turn)
            _matmul(turn, Rmin, Rs)
            _matmul_transposed(Rs, R, turn)
            _matmul_transposed(R3, turn, Rw)
            n_first = _split_rotation(Rs, axes[0], axes[1], axes[2], first, work)
            n_last = _split_rotation(Rw, axes[4], axes[5], axes[6], last, work)
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
