"""Compiled checks of straight joint-space edges.

Conservative advancement: a configuration with clearance c stays free until some point of the robot has moved
by c, so that much of the edge can be skipped. Where the clearance is small the edge is sampled at a fixed
step.
"""

import numpy as np
from numba import njit

from torc.collision.kernels import contacts_at, padding_row, self_clearance
from torc.collision.obstacles import box_distance, voxel_bound, voxels_touched
from torc.collision.placement import place_spheres, sphere_rows


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
def edge_collides(a, b, width_m, own, robot, world, reach, step_m, q, Ts, scratch, spheres):
    """Whether the robot touches anything on the straight joint-space edge from a to b, ends included."""
    dof = a.shape[0]
    # What is in the way is most often wide: look at the middle and the ends first.
    for t in (0.5, 1.0, 0.0):
        for d in range(dof):
            q[d] = a[d] + t * (b[d] - a[d])
        bits, flags = contacts_at(q, width_m, own, robot, world, True, True, Ts, scratch, spheres)
        if bits != 0 or flags != 0:
            return True
    moved = np.zeros(reach.shape[1])
    for link in range(reach.shape[1]):
        for d in range(dof):
            moved[link] += abs(b[d] - a[d]) * reach[d, link]
    most = np.max(moved)
    if most == 0.0:
        return False
    t, self_gap = 0.0, 0.0
    while t < 1.0:
        for d in range(dof):
            q[d] = a[d] + t * (b[d] - a[d])
        place_spheres(q, width_m, robot, Ts, scratch, spheres)
        advance = _world_advance(spheres, dof, own, robot, world, moved, step_m)
        if advance < 0.0:
            return True
        # Two parts that both move come closer by at most twice what one of them moves: this stays valid for a
        # while.
        if self_gap < 2.0 * step_m:
            self_gap = self_clearance(robot, spheres, 0.3) - world.self_padding
            if self_gap < 0.0:
                return True
        advance = min(advance, max(step_m, 0.5 * self_gap) / most)
        self_gap -= 2.0 * advance * most
        t += advance
    return False


@njit(cache=True)
def edges_batch(starts, ends, width_m, own, robot, world, reach, step_m):
    """Whether each edge collides."""
    n, dof = starts.shape
    out = np.zeros(n, np.bool_)
    q, Ts, scratch = np.empty(dof), np.empty((dof + 1, 3, 4)), np.empty((3, 4))
    spheres = np.empty((sphere_rows(robot), 3))
    for i in range(n):
        out[i] = edge_collides(
            starts[i], ends[i], width_m[i], own[i], robot, world, reach, step_m, q, Ts, scratch, spheres
        )
    return out


@njit(cache=True)
def path_collides(path, width_m, own, robot, world, reach, step_m):
    """Index of the first edge of a path that collides, or -1."""
    m, dof = path.shape
    q, Ts, scratch = np.empty(dof), np.empty((dof + 1, 3, 4)), np.empty((3, 4))
    spheres = np.empty((sphere_rows(robot), 3))
    for i in range(m - 1):
        if edge_collides(
            path[i], path[i + 1], width_m, own, robot, world, reach, step_m, q, Ts, scratch, spheres
        ):
            return i
    return -1
