"""Follow straight lines of the flange, and find out whether a grasp has any that are clear; compiled."""

from typing import NamedTuple

import numpy as np
from numba import njit

from torc.collision.contact_kernels import contacts_at
from torc.collision.obstacles import SELF
from torc.collision.placement import scratch_for
from torc.robots.kinematics import forward, jacobian, pose_error, pose_step

_TOLERANCE = 1e-5
"""Metres and radians, per axis."""
_DAMPING = 1e-7
NO_WAY, WAY, UNSURE, NOT_FOLLOWED = 0, 1, 2, 3
"""Whether a grasp has straight ways; unsure if it depends on the shape of what is held."""


class LineRules(NamedTuple):
    """Settings of straight lines, for kernels.

    Attributes:
        lift_spacing_m, approach_spacing_m: distance between waypoints.
        lift: waypoints of the shortest lift.
        back_offs: waypoints of each approach, rising.
        lower, upper: limits of the joints, with their margin.
        max_step_rad: a larger change of a joint between two waypoints is a jump.
        branches: most free inverse-kinematics solutions that are followed.
        opening_m: opening of the gripper until it closes.
    """

    lift_spacing_m: float
    approach_spacing_m: float
    lift: int
    back_offs: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    max_step_rad: float
    branches: int
    opening_m: float


class LineGrasps(NamedTuple):
    """Grasps whose ways are looked for, those of an object side by side, the best first.

    Attributes:
        qpos: the configuration reported for each.
        Ts, backward: pose of the flange at the grasp, and the direction against the approach; world frame.
        own, widths: bit of the object, and opening around it.
        bounds: sphere around the object.
    """

    qpos: np.ndarray
    Ts: np.ndarray
    backward: np.ndarray
    own: np.ndarray
    widths: np.ndarray
    bounds: np.ndarray


@njit(cache=True)
def follow(q_start, T, direction, spacing_m, robot, rules, path, first=0):
    """Fill path, from waypoint `first` on, with configurations on a straight line; return how many it holds in a row.

    The flange moves from pose T by `spacing_m` per waypoint and keeps its orientation. The line ends at the first
    waypoint that is not met within the tolerance, passes a joint limit, or changes a joint by more than max_step_rad.
    """
    dof = q_start.shape[0]
    Ts, scratch, target = np.empty((dof + 1, 3, 4)), np.empty((2, 3, 4)), np.empty((3, 4))
    J, error, work, step = np.empty((6, dof)), np.empty(6), np.empty((7, 6)), np.empty(dof)
    q = q_start.copy() if first == 0 else path[first - 1].copy()
    target[:] = T
    for k in range(first, path.shape[0]):
        for i in range(3):
            target[i, 3] = T[i, 3] + (k + 1) * spacing_m * direction[i]
        met = False
        for _ in range(12):
            forward(q, robot, Ts, scratch)
            if pose_error(Ts[dof], target, error) < _TOLERANCE:
                met = True
                break
            jacobian(Ts, robot.axes, J)
            pose_step(J, error, _DAMPING, work, step)
            q += step
        if not met:
            return k
        previous = path[k - 1] if k > 0 else q_start
        for i in range(dof):
            jump = abs(q[i] - previous[i]) > rules.max_step_rad
            if jump or q[i] < rules.lower[i] or q[i] > rules.upper[i]:
                return k
        path[k] = q
    return path.shape[0]


@njit(cache=True, nogil=True)
def follow_each(starts, Ts, directions, spacing_m, robot, rules, paths, counts):
    """Follow a line from each start."""
    for b in range(starts.shape[0]):
        counts[b] = follow(starts[b], Ts[b], directions[b], spacing_m, robot, rules, paths[b])


@njit(cache=True)
def _near_robot(sphere, height, robot, placed, padding):
    """Check whether a sphere, raised, is near the links that a held object may touch, or a fixed part."""
    x, y, z, r = sphere[0], sphere[1], sphere[2] + height, sphere[3]
    first = robot.radii.shape[0]
    for link in range(robot.axes.shape[0] - 1):
        p, reach = placed[first + link], robot.link_spheres[link, 3] + r + padding
        if (p[0] - x) ** 2 + (p[1] - y) ** 2 + (p[2] - z) ** 2 < reach * reach:
            return True
    for s in robot.static_spheres:
        reach = s[3] + r + padding
        if (s[0] - x) ** 2 + (s[1] - y) ** 2 + (s[2] - z) ** 2 < reach * reach:
            return True
    return False


@njit(cache=True)
def _lift(q, T, width_m, bounds, exact, rules, robot, holding, world, path, scratches):
    """Say whether the shortest lift can be followed from q, clear of fixed things, with the object off the robot."""
    up = np.array([0.0, 0.0, 1.0])
    if follow(q, T, up, rules.lift_spacing_m, robot, rules, path) < rules.lift:
        return NO_WAY
    none, scratch, holding_scratch = np.uint64(0), scratches[0], scratches[1]
    found = WAY
    for k in range(0, rules.lift + 1, 2):  # Every second waypoint is checked.
        at = q if k == 0 else path[k - 1]
        if contacts_at(at, rules.opening_m, none, robot, world, True, False, scratch)[1] != 0:
            return NO_WAY
        if exact:
            flags = contacts_at(at, width_m, none, holding, world, False, False, holding_scratch)[1]
            if flags & SELF != 0:
                return NO_WAY
        elif _near_robot(bounds, k * rules.lift_spacing_m, robot, scratch[3], world.self_padding):
            found = UNSURE
    return found


@njit(cache=True)
def _approach(q, T, backward, own, rules, robot, world, path, scratch):
    """Check whether a free pre-grasp leads to q on a line that is clear of everything fixed."""
    none, done = np.uint64(0), 0
    for count in rules.back_offs:
        if follow(q, T, backward, rules.approach_spacing_m, robot, rules, path[:count], done) < count:
            return False
        for k in range(done + 1, count + 1):
            checked = k % 2 == 0
            at = path[k - 1]
            if checked and contacts_at(at, rules.opening_m, none, robot, world, True, False, scratch)[1]:
                return False
        bits, flags = contacts_at(path[count - 1], rules.opening_m, own, robot, world, True, True, scratch)
        if bits == 0 and flags == 0:
            return True
        done = count
    return False


@njit(cache=True)
def _way(g, q, grasps, exact, rules, robot, holding, world, lift, approach, scratches):
    """Say whether grasp g has straight ways from configuration q, which touches nothing."""
    found = _lift(
        q,
        grasps.Ts[g],
        grasps.widths[g],
        grasps.bounds[g],
        exact,
        rules,
        robot,
        holding,
        world,
        lift,
        scratches,
    )
    if found != NO_WAY and _approach(
        q, grasps.Ts[g], grasps.backward[g], grasps.own[g], rules, robot, world, approach, scratches[0]
    ):
        return found
    return NO_WAY


@njit(cache=True)
def _is_free(g, q, grasps, rules, robot, world, scratch):
    """Check whether configuration q of grasp g touches nothing."""
    bits, flags = contacts_at(q, rules.opening_m, grasps.own[g], robot, world, True, True, scratch)
    return bits == 0 and flags == 0


@njit(cache=True, nogil=True)
def first_ways(first, last, most, grasps, rules, robot, world, out):
    """Follow the ways of some objects' grasps, those from first[k] to last[k], until `most` of an object have both.

    From their reported configuration alone. Writes WAY, UNSURE or NO_WAY to `out`, nothing for the others.
    """
    dof = grasps.qpos.shape[1]
    lift, approach = np.empty((rules.lift, dof)), np.empty((rules.back_offs[-1], dof))
    scratches = scratch_for(robot), scratch_for(robot)
    for k in range(len(first)):
        found = 0
        for g in range(first[k], last[k]):
            if found == most:
                break
            q, out[g] = grasps.qpos[g], NO_WAY
            if _is_free(g, q, grasps, rules, robot, world, scratches[0]):
                out[g] = _way(g, q, grasps, False, rules, robot, robot, world, lift, approach, scratches)
                found += out[g] == WAY


@njit(cache=True, nogil=True)
def all_ways(index, solutions, counts, found, exact, grasps, rules, robot, holding, world):
    """Say of some grasps whether any of their inverse-kinematics solutions has straight ways.

    Args:
        index: which grasps.
        solutions, counts: of each, its solutions; the reported one is tried first.
        found: NO_WAY becomes WAY or UNSURE with the first solution that has ways; others keep what they are.
        exact: the object in the hand is the spheres of `holding`; else its bounding sphere, which makes it UNSURE.
    """
    dof = grasps.qpos.shape[1]
    lift, approach = np.empty((rules.lift, dof)), np.empty((rules.back_offs[-1], dof))
    scratches = scratch_for(robot), scratch_for(holding)
    for n in range(len(index)):
        g, tried = index[n], 0
        for s in range(-1, counts[n]):
            if tried == rules.branches or found[n] != NO_WAY:
                break
            q = grasps.qpos[g] if s < 0 else solutions[n, s]
            if _is_free(g, q, grasps, rules, robot, world, scratches[0]):
                tried += 1
                found[n] = _way(g, q, grasps, exact, rules, robot, holding, world, lift, approach, scratches)
