"""Check whole configurations, compiled: which voxels, boxes and parts of itself the robot touches."""

import numpy as np
from numba import njit

from torc.collision.obstacles import SELF, STATIC, box_distance, voxel_bound, voxels_touched
from torc.collision.placement import place_spheres, scratch_for


@njit(cache=True)
def sphere_gap(a, radius_a, b, radius_b, limit):
    """Return the distance of two spheres if it is below a limit, else the limit."""
    dx, dy, dz = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    d2, r = dx * dx + dy * dy + dz * dz, radius_a + radius_b
    near = r + limit
    return np.sqrt(d2) - r if near > 0.0 and d2 < near * near else limit


@njit(cache=True)
def pair_gap(robot, spheres, a, b, limit):
    """Return the distance between two links, up to a limit."""
    n, around = robot.radii.shape[0], robot.link_spheres
    if sphere_gap(spheres[n + a], around[a, 3], spheres[n + b], around[b, 3], limit) == limit:
        return limit
    for s in range(robot.link_start[a], robot.link_start[a + 1]):
        for t in range(robot.link_start[b], robot.link_start[b + 1]):
            limit = sphere_gap(spheres[s], robot.radii[s], spheres[t], robot.radii[t], limit)
    return limit


@njit(cache=True)
def fixed_gap(robot, spheres, link, limit):
    """Return the distance between a link and the parts of the robot that do not move, up to a limit."""
    n = robot.radii.shape[0]
    for t in range(robot.static_spheres.shape[0]):
        fixed, r = robot.static_spheres[t], robot.static_spheres[t, 3]
        if sphere_gap(spheres[n + link], robot.link_spheres[link, 3], fixed, r, limit) < limit:
            for s in range(robot.link_start[link], robot.link_start[link + 1]):
                limit = sphere_gap(spheres[s], robot.radii[s], fixed, r, limit)
    return limit


@njit(cache=True)
def self_clearance(robot, spheres, limit):
    """Return the smallest distance between robot parts that can touch each other or fixed parts, up to a limit."""
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
    """Return (bits, flags) of all that the robot touches at q; with first_only, of the first contact found.

    own: bits ignored as described in `blockers`; voxels_too False: only fixed boxes and the robot itself.
    """
    dof = q.shape[0]
    bits, flags = np.uint64(0), 0
    for i in range(dof):
        if not np.isfinite(q[i]):
            return bits, STATIC | SELF
    place_spheres(q, width_m, robot, scratch)
    spheres = scratch[3]
    # From the hand to the shoulder: the hand touches first in clutter.
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


@njit(cache=True, nogil=True)
def contacts_batch(qpos, width_m, own, bits, flags, robot, world, first_only, voxels_too):
    """Write bits and flags of each configuration."""
    scratch = scratch_for(robot)
    for i in range(len(qpos)):
        bits[i], flags[i] = contacts_at(
            qpos[i], width_m[i], own[i], robot, world, first_only, voxels_too, scratch
        )


@njit(cache=True)
def _world_advance(spheres, dof, own, robot, world, moved, step_m):
    """Return the share of an edge that can be skipped without touching voxels or boxes; negative if one is touched.

    moved[link]: no point of the link moves further than this on the whole edge. A link that is near voxels without
    touching any is assumed free for step_m.
    """
    advance = 1.0
    for link in range(robot.link_start.shape[0] - 2, -1, -1):
        row = padding_row(link, dof)
        clearance = 1.0
        for s in range(robot.link_start[link], robot.link_start[link + 1]):
            x, y, z = spheres[s, 0], spheres[s, 1], spheres[s, 2]
            gap = box_distance(x, y, z, world.boxes) - robot.radii[s] - world.padding[row, 1]
            if gap < 0.0:
                return -1.0
            clearance = min(clearance, gap)
            radius = robot.radii[s] + world.padding[row, 0]
            if radius <= 0.0:
                continue
            gap = voxel_bound(x, y, z, world) - radius
            if gap < 0.0:
                bits, flags = voxels_touched(x, y, z, radius, world, own, row == 0, np.uint64(0), 0, True)
                if bits != 0 or flags != 0:
                    return -1.0
                gap = 0.0
            clearance = min(clearance, gap)
        if moved[link] > 0.0:
            advance = min(advance, max(clearance, step_m) / moved[link])
    return advance


@njit(cache=True)
def _self_advance(spheres, robot, padding, moved, between, step_m):
    """Return the share of an edge that can be skipped without the robot touching itself; negative if it does.

    between[p]: no point of one link of pair p moves further than this relative to the other on the whole edge.
    """
    advance = 1.0
    for p in range(robot.self_pairs.shape[0]):
        if between[p] == 0.0:
            continue
        # Beyond the limit the pair does not shorten the advance.
        limit = padding + max(advance * between[p], step_m)
        gap = pair_gap(robot, spheres, robot.self_pairs[p, 0], robot.self_pairs[p, 1], limit) - padding
        if gap < 0.0:
            return -1.0
        advance = min(advance, max(gap, step_m) / between[p])
    for link in range(robot.static_links.shape[0]):
        if not robot.static_links[link] or moved[link] == 0.0:
            continue
        limit = padding + max(advance * moved[link], step_m)
        gap = fixed_gap(robot, spheres, link, limit) - padding
        if gap < 0.0:
            return -1.0
        advance = min(advance, max(gap, step_m) / moved[link])
    return advance


@njit(cache=True)
def _motion_bounds(a, b, robot, reach, moved, between):
    """Write the largest motion of any point of each link, and of each self pair's links relative to each other."""
    dof = a.shape[0]
    for link in range(reach.shape[1]):
        moved[link] = 0.0
        for d in range(dof):
            moved[link] += abs(b[d] - a[d]) * reach[d, link]
    for p in range(robot.self_pairs.shape[0]):
        first = min(robot.self_pairs[p, 0], robot.self_pairs[p, 1])
        last = max(robot.self_pairs[p, 0], robot.self_pairs[p, 1])
        between[p] = 0.0
        # Joints up to the first link move both alike.
        for d in range(first + 1, dof):
            between[p] += abs(b[d] - a[d]) * reach[d, last]


@njit(cache=True)
def edge_collides(a, b, own, scene, scratch):
    """Check whether the robot touches anything on the straight joint-space edge from a to b, ends included.

    scene: opening, robot, world, `joint_reach` and step; scratch: see `scratch_for`.
    """
    width_m, robot, world, reach, step_m = scene
    q, spheres = scratch[0], scratch[3]
    dof = a.shape[0]
    # Obstacles are usually wide: check the middle and the ends first.
    for t in (0.5, 1.0, 0.0):
        for d in range(dof):
            q[d] = a[d] + t * (b[d] - a[d])
        bits, flags = contacts_at(q, width_m, own, robot, world, True, True, scratch)
        if bits != 0 or flags != 0:
            return True
    moved, between = np.empty(reach.shape[1]), np.empty(robot.self_pairs.shape[0])
    _motion_bounds(a, b, robot, reach, moved, between)
    t, self_free_until = 0.0, 0.0
    while t < 1.0:
        for d in range(dof):
            q[d] = a[d] + t * (b[d] - a[d])
        place_spheres(q, width_m, robot, scratch)
        if t >= self_free_until:
            advance = _self_advance(spheres, robot, world.self_padding, moved, between, step_m)
            if advance < 0.0:
                return True
            self_free_until = t + advance
        advance = _world_advance(spheres, dof, own, robot, world, moved, step_m)
        if advance < 0.0:
            return True
        t = min(t + advance, self_free_until)
    return False


@njit(cache=True)
def edges_batch(starts, ends, width_m, own, robot, world, reach, step_m):
    """Check whether each edge collides."""
    out = np.zeros(len(starts), np.bool_)
    scratch = scratch_for(robot)
    for i in range(len(starts)):
        scene = (width_m[i], robot, world, reach, step_m)
        out[i] = edge_collides(starts[i], ends[i], own[i], scene, scratch)
    return out
