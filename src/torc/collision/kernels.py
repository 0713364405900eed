"""Compiled checks of whole configurations: which voxels, boxes and parts of itself the robot touches."""

import numpy as np
from numba import njit

from torc.collision.obstacles import SELF, STATIC, box_distance, voxel_bound, voxels_touched
from torc.collision.placement import place_spheres, scratch_for


@njit(cache=True)
def sphere_gap(a, radius_a, b, radius_b, limit):
    """Distance of two spheres where it is below a limit, else the limit."""
    dx, dy, dz = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    d2, r = dx * dx + dy * dy + dz * dz, radius_a + radius_b
    near = r + limit
    return np.sqrt(d2) - r if near > 0.0 and d2 < near * near else limit


@njit(cache=True)
def pair_gap(robot, spheres, a, b, limit):
    """Distance between two links, up to a limit."""
    n, around = robot.radii.shape[0], robot.link_spheres
    if sphere_gap(spheres[n + a], around[a, 3], spheres[n + b], around[b, 3], limit) == limit:
        return limit
    for s in range(robot.link_start[a], robot.link_start[a + 1]):
        for t in range(robot.link_start[b], robot.link_start[b + 1]):
            limit = sphere_gap(spheres[s], robot.radii[s], spheres[t], robot.radii[t], limit)
    return limit


@njit(cache=True)
def fixed_gap(robot, spheres, link, limit):
    """Distance between a link and the parts of the robot that do not move, up to a limit."""
    n = robot.radii.shape[0]
    for t in range(robot.static_spheres.shape[0]):
        fixed, r = robot.static_spheres[t], robot.static_spheres[t, 3]
        if sphere_gap(spheres[n + link], robot.link_spheres[link, 3], fixed, r, limit) < limit:
            for s in range(robot.link_start[link], robot.link_start[link + 1]):
                limit = sphere_gap(spheres[s], robot.radii[s], fixed, r, limit)
    return limit


@njit(cache=True)
def self_clearance(robot, spheres, limit):
    """Smallest distance between parts of the robot that can touch each other or its fixed parts, up to a limit."""
    for p in range(robot.self_pairs.shape[0]):
        limit = pair_gap(robot, spheres, robot.self_pairs[p, 0], robot.self_pairs[p, 1], limit)
    for link in range(robot.static_links.shape[0]):
        if robot.static_links[link]:
            limit = fixed_gap(robot, spheres, link, limit)
    return limit


@njit(cache=True)
def padding_row(link, dof):
    if link < dof:
        return 0
    return 1 if link <= dof + 2 else 2


@njit(cache=True)
def contacts_at(q, width_m, own, robot, world, first_only, voxels_too, scratch):
    """(bits, flags) of all that the robot touches at q; with first_only, of the first contact found.

    own: bits ignored as described in `blockers`; voxels_too False: only fixed boxes and the robot itself.
    """
    dof = q.shape[0]
    bits, flags = np.uint64(0), 0
    for i in range(dof):
        if not np.isfinite(q[i]):
            return bits, STATIC | SELF
    place_spheres(q, width_m, robot, scratch)
    spheres = scratch[3]
    # From the hand to the shoulder: the hand is what touches first in clutter.
    for link in range(robot.link_start.shape[0] - 2, -1, -1):
        row = padding_row(link, dof)
        for s in range(robot.link_start[link], robot.link_start[link + 1]):
            x, y, z = spheres[s, 0], spheres[s, 1], spheres[s, 2]
            if (
                flags & STATIC == 0
                and box_distance(x, y, z, world.boxes) < robot.radii[s] + world.padding[row, 1]
            ):
                flags |= STATIC
                if first_only:
                    return bits, flags
            radius = robot.radii[s] + world.padding[row, 0]
            if voxels_too and radius > 0.0 and voxel_bound(x, y, z, world) < radius:
                bits, flags = voxels_touched(x, y, z, radius, world, own, row == 0, bits, flags, first_only)
                if first_only and (bits != 0 or flags != 0):
                    return bits, flags
    if self_clearance(robot, spheres, world.self_padding) < world.self_padding:
        flags |= SELF
    return bits, flags


@njit(cache=True)
def contacts_batch(qpos, width_m, own, robot, world, first_only, voxels_too):
    """(bits, flags) of each configuration."""
    n, scratch = len(qpos), scratch_for(robot)
    bits, flags = np.zeros(n, np.uint64), np.zeros(n, np.uint8)
    for i in range(n):
        bits[i], flags[i] = contacts_at(
            qpos[i], width_m[i], own[i], robot, world, first_only, voxels_too, scratch
        )
    return bits, flags
