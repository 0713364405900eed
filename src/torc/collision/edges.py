"""Compiled checks of straight joint-space edges.

Conservative advancement: a configuration with clearance c stays free until some point of the robot has moved
by c, so that much of the edge can be skipped. Where the clearance is small the edge is sampled at a fixed
step.
"""

import numpy as np
from numba import njit

from torc.collision.kernels import contacts_at, fixed_gap, padding_row, pair_gap
from torc.collision.obstacles import box_distance, voxel_bound, voxels_touched
from torc.collision.placement import place_spheres, scratch_for


@njit(cache=True)
def _world_advance(spheres, dof, own, robot, world, moved, step_m):
    """Share of an edge that can be skipped without touching voxels or boxes; negative where one is touched.

    moved[link]: no point of the link moves further than this on the whole edge. A link that is near voxels
    without touching any is taken to be free for step_m.
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
    """Share of an edge that can be skipped without the robot touching itself; negative where it does.

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
    """Largest motion of any point of each link, and of each self pair's links relative to each other."""
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
    """Whether the robot touches anything on the straight joint-space edge from a to b, ends included.

    scene: opening, robot, world, `joint_reach` and step; scratch: see `scratch_for`.
    """
    width_m, robot, world, reach, step_m = scene
    q, spheres = scratch[0], scratch[3]
    dof = a.shape[0]
    # What is in the way is most often wide: look at the middle and the ends first.
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
    """Whether each edge collides."""
    out = np.zeros(len(starts), np.bool_)
    scratch = scratch_for(robot)
    for i in range(len(starts)):
        scene = (width_m[i], robot, world, reach, step_m)
        out[i] = edge_collides(starts[i], ends[i], own[i], scene, scratch)
    return out
