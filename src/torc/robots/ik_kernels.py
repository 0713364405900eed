"""The building blocks of closed-form inverse kinematics, compiled: Paden and Kahan's subproblems; limits and ranking.

With the arm's joint axes w0, w1 .. and the flange pose T0 at q = 0, the flange is T = e0 e1 .. T0, each e a turn about
its axis (product of exponentials). (Murray, Li, Sastry: A Mathematical Introduction to Robotic Manipulation, 3.2.)
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from torc.geometry.transforms import invert
from torc.robots.description import ArmDescription
from torc.robots.kinematics import link_poses, rotate_about

FINER = 8
"""Factor on the number of samples of the free angle for a pose that seems out of reach: its gap may be narrow."""
_TWO_PI = 2.0 * np.pi


class Structure(NamedTuple):
    """An arm at q = 0, world frame.

    axes, points: direction of each joint's axis, and a point on it.
    T0_inverse: inverse of the flange's pose.
    shoulder, wrist: where the first and the last axes meet; if they do not, a point on them.
    """

    axes: np.ndarray
    points: np.ndarray
    T0_inverse: np.ndarray
    shoulder: np.ndarray
    wrist: np.ndarray


class Joints(NamedTuple):
    """Limits of the joints and what ranks solutions: the rest configuration, and IkConfig's margin and weight."""

    lower: np.ndarray
    upper: np.ndarray
    rest: np.ndarray
    soft_margin: float
    limit_weight: float


def structure_of(
    arm: ArmDescription, shoulder: slice, wrist: slice, right: tuple[int, ...]
) -> Structure | None:
    """Return the structure of an arm if these joints' axes meet, and the `right` ones are at right angles to the next.

    None otherwise.
    """
    Ts = link_poses(arm, np.zeros((1, arm.dof)))[0]
    axes = np.einsum("kij,kj->ki", Ts[: arm.dof, :3, :3], arm.axes)
    points = Ts[: arm.dof, :3, 3].copy()
    first, last = _common_point(axes[shoulder], points[shoulder]), _common_point(axes[wrist], points[wrist])
    if first is None or last is None or any(abs(axes[i] @ axes[i + 1]) >= 1e-6 for i in right):
        return None
    return Structure(axes, points, invert(Ts[arm.dof]), first, last)


def _common_point(axes: np.ndarray, points: np.ndarray) -> np.ndarray | None:
    """Return the point all lines pass through, or None (least squares of the distances to the lines)."""
    projectors = np.eye(3) - axes[:, :, None] * axes[:, None, :]
    p = np.linalg.lstsq(projectors.sum(axis=0), np.einsum("kij,kj->i", projectors, points), rcond=None)[0]
    distances = np.linalg.norm(np.einsum("kij,kj->ki", projectors, p - points), axis=1)
    return p if distances.max() < 1e-6 else None


@njit(cache=True)
def wrap_near(angle, lower, upper, preferred):
    """Return the angle modulo 2 pi within the limits that is nearest to `preferred`; NaN if there is none."""
    first = angle + _TWO_PI * np.ceil((lower - angle - 1e-12) / _TWO_PI)
    best, distance = np.nan, np.inf
    while first <= upper + 1e-12:
        if abs(first - preferred) < distance:
            best, distance = first, abs(first - preferred)
        first += _TWO_PI
    return min(max(best, lower), upper) if distance < np.inf else np.nan


@njit(cache=True)
def wrap_into_limits(q, joints, first=0):
    """Turn the angles q of joints `first` .. by multiples of 2 pi into the limits; return False if one cannot be."""
    for i in range(q.shape[0]):
        joint = first + i
        q[i] = wrap_near(q[i], joints.lower[joint], joints.upper[joint], joints.rest[joint])
        if np.isnan(q[i]):
            return False
    return True


@njit(cache=True)
def write_best_first(solutions, count, joints, out):
    """Add solutions 2 pi away in one or more joints, as far as limits and space allow, rank all, and write them to out.

    By rising cost: squared distance from rest plus a penalty near limits. Return how many were written.
    """
    count = _add_turns(solutions, count, joints)
    cost = np.zeros(count)
    for k in range(count):
        for i in range(joints.rest.shape[0]):
            q = solutions[k, i]
            cost[k] += (q - joints.rest[i]) ** 2
            margin = min(q - joints.lower[i], joints.upper[i] - q)
            if margin < joints.soft_margin:
                cost[k] += joints.limit_weight * (1.0 - margin / joints.soft_margin) ** 2
    order = np.argsort(cost, kind="mergesort")
    count = min(count, out.shape[0])
    for k in range(count):
        out[k] = solutions[order[k]]
    return count


@njit(cache=True)
def _add_turns(solutions, count, joints):
    for joint in range(solutions.shape[1]):
        for k in range(count):
            for turn in (-_TWO_PI, _TWO_PI):
                angle = solutions[k, joint] + turn
                while joints.lower[joint] <= angle <= joints.upper[joint] and count < solutions.shape[0]:
                    solutions[count] = solutions[k]
                    solutions[count, joint] = angle
                    count += 1
                    angle += turn
    return count


@njit(cache=True)
def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True)
def cross(a, b, out):
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@njit(cache=True)
def apply(R, v, out):
    for i in range(3):
        out[i] = R[i, 0] * v[0] + R[i, 1] * v[1] + R[i, 2] * v[2]


@njit(cache=True)
def matmul(A, B, out):
    for i in range(3):
        for j in range(3):
            out[i, j] = A[i, 0] * B[0, j] + A[i, 1] * B[1, j] + A[i, 2] * B[2, j]


@njit(cache=True)
def angle_between(v, u, axis, work):
    """Return the turn about the axis that brings v towards u; 0 if v or u is along the axis (first subproblem)."""
    cross(v, u, work)
    s, c = dot(axis, work), dot(v, u) - dot(axis, v) * dot(axis, u)
    return np.arctan2(s, c) if s * s + c * c > 1e-20 else 0.0


@njit(cache=True)
def split_rotation(R, a, b, c, joints, first, out, work):
    """Write angles to out (2, 3) with R = rot(a) rot(b) rot(c), a and c at right angles to b; return how many.

    They are within the limits of the joints from `first` on.
    """
    u, v, w = work[0], work[1], work[2]
    A, B = work[3:6], work[6:9]
    apply(R, c, u)
    cross(b, c, w)
    middle = np.arctan2(dot(a, w), dot(a, c))
    half = np.arccos(min(1.0, max(-1.0, dot(a, u))))
    count = 0
    for k in range(2 if 1e-7 < half < np.pi - 1e-7 else 1):
        angles = out[count]
        angles[1] = middle + (half if k == 0 else -half)
        if np.isnan(wrap_near(angles[1], joints.lower[first + 1], joints.upper[first + 1], 0.0)):
            continue  # spares most of the work
        rotate_about(b, angles[1], B)
        apply(B, c, v)
        angles[0] = angle_between(v, u, a, w)
        # What remains for c: rot(c) b = rot(b)^T rot(a)^T R b, and rot(b) does not move b.
        apply(R, b, v)
        rotate_about(a, -angles[0], A)
        apply(A, v, w)
        apply(B.T, w, v)
        angles[2] = angle_between(b, v, c, w)
        count += wrap_into_limits(angles, joints, first)
    return count


@njit(cache=True)
def shortest_rotation(v, p, out, work):
    """Write the rotation that turns direction v onto direction p about their common normal."""
    axis = work[0]
    cross(v, p, axis)
    s, c = np.sqrt(dot(axis, axis)), dot(v, p)
    if s < 1e-9 * np.sqrt(dot(v, v) * dot(p, p)):
        # Parallel or opposite: any axis at right angles will do.
        work[1] = 0.0
        work[1, np.argmin(np.abs(v))] = 1.0
        cross(v, work[1], axis)
        s = np.sqrt(dot(axis, axis))
        axis /= s
        rotate_about(axis, 0.0 if c > 0 else np.pi, out)
        return
    axis /= s
    rotate_about(axis, np.arctan2(s, c), out)


@njit(cache=True)
def elbow_angles(axis, elbow, shoulder, wrist, reach, out):
    """Write turns of the wrist about the elbow's axis that put it `reach` from the shoulder; return how many (0..2)."""
    w, s = wrist - elbow, shoulder - elbow
    along = dot(axis, w) - dot(axis, s)
    w_flat, s_flat = w - dot(axis, w) * axis, s - dot(axis, s) * axis
    lw, ls = np.sqrt(dot(w_flat, w_flat)), np.sqrt(dot(s_flat, s_flat))
    if lw < 1e-9 or ls < 1e-9:
        return 0
    cosine = (lw * lw + ls * ls + along * along - reach * reach) / (2.0 * lw * ls)
    if abs(cosine) > 1.0 + 1e-12:
        return 0
    opening = np.arccos(min(1.0, max(-1.0, cosine)))
    normal = np.empty(3)
    start = angle_between(w_flat, s_flat, axis, normal)
    out[0], out[1] = start + opening, start - opening
    return 2 if 1e-7 < opening < np.pi - 1e-7 else 1


@njit(cache=True)
def turns_to_plane(axis, v, normal, distance, out, work):
    """Write turns of v about the axis, both unit or not, that make normal . v `distance`; return how many (0..2)."""
    cross(axis, v, work)
    along = dot(axis, v) * dot(normal, axis)
    c, s = dot(normal, v) - along, dot(normal, work)
    r = np.sqrt(c * c + s * s)
    if r < 1e-9:
        return 0
    cosine = (distance - along) / r
    if abs(cosine) > 1.0 + 1e-9:
        return 0
    middle, opening = np.arctan2(s, c), np.arccos(min(1.0, max(-1.0, cosine)))
    out[0], out[1] = middle + opening, middle - opening
    return 2 if 1e-7 < opening < np.pi - 1e-7 else 1
