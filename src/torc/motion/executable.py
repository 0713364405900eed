"""Find the grasps that the arm can carry out in straight lines: down to the object, and up again with it.

A grasp that passes the validity checks may still have no straight approach or lift: a joint limit, the table or the
robot itself blocks every inverse-kinematics solution. This is known before anything is decided.
"""

from functools import cache, partial

import numpy as np
from jaxtyping import Bool, Float, Int
from numba import njit

from torc.collision.collision_world import CollisionWorld
from torc.collision.contacts import blockers, static_contacts
from torc.collision.placement import place_spheres, scratch_for
from torc.geometry.transforms import kernel_array
from torc.grasping.validity import tool0_targets
from torc.motion.config import MotionConfig
from torc.motion.holding import Held, held_where_it_lies
from torc.motion.lines import LineContext, lines_exist
from torc.motion.mover import Mover
from torc.records import GraspReport, GraspSet, GraspStatus, OcclusionVolume, SegmentedScene
from torc.robots.description import RobotDescription


def without_lines(
    grasps: GraspSet,
    report: GraspReport,
    scene: SegmentedScene,
    volume: OcclusionVolume,
    world: CollisionWorld,
    robot: RobotDescription,
    support_z_m: float,
    config: MotionConfig,
) -> Bool[np.ndarray, "n"]:
    """Return the VALID grasps that have no straight approach from a free pre-grasp, or no straight lift.

    These are exactly the ones for which `line_candidates` finds nothing, whatever the start. `config`: settings of the
    motion planner that will carry them out; the rest as in a PickRequest.
    """
    out = np.zeros(len(grasps), dtype=bool)
    valid = np.flatnonzero(report.status == GraspStatus.VALID)
    if len(valid) == 0:
        return out
    mover, camera = Mover(robot, config), scene.observation.T_world_camera[:3, 3].astype(float)
    # Most can be carried out from their configuration in the report: all are checked at once.
    own_ids = grasps.object_ids[valid].astype(np.int64)
    qpos, Ts_world_tool0 = report.qpos[valid], tool0_targets(grasps, robot.gripper)[valid]
    bounds = {k: _bounding_sphere(scene.object(k).points) for k in set(own_ids.tolist())}
    spheres, backward = np.array([bounds[k] for k in own_ids.tolist()]), -grasps.Ts_world_tcp[valid, :3, 2]
    good = _raisable(mover, world, qpos, Ts_world_tool0, spheres)
    good[good] = _approachable(mover, world, qpos[good], Ts_world_tool0[good], own_ids[good], backward[good])

    @cache
    def held(object_id: int) -> Held:
        return held_where_it_lies(
            scene.object(object_id), camera, volume, support_z_m, config.attached_spheres
        )

    for grasp in valid[~good].tolist():
        own_id = int(grasps.object_ids[grasp])
        T, width_m = grasps.Ts_world_tcp[grasp], float(grasps.widths_m[grasp])
        context = LineContext(mover, world, own_id, T, width_m, partial(held, own_id))
        out[grasp] = not lines_exist(context, report.qpos[grasp])
    return out


_ROOM_M = 0.03


_Qpos = Float[np.ndarray, "m dof"]
_Poses = Float[np.ndarray, "m 4 4"]


def _raisable(
    mover: Mover, world: CollisionWorld, qpos: _Qpos, Ts_world_tool0: _Poses, bounds: Float[np.ndarray, "m 4"]
) -> Bool[np.ndarray, "m"]:
    """Check whether the shortest lift can be followed, clear of fixed things, with the object off the robot."""
    lifts_m = mover.config.cartesian.lifts_m
    length_m, count = max(lifts_m), min(mover.line_counts(lifts_m))
    path, reached = mover.follow(qpos, Ts_world_tool0, np.array([0.0, 0.0, 1.0]), length_m, count)
    path = np.concatenate([qpos[:, None], path], axis=1)[:, ::2]
    good = (reached == count) & ~_fixed(mover, world, path).any(axis=1)
    spheres = np.repeat(bounds[:, None], path.shape[1], axis=1)
    spheres[:, :, 2] += length_m / mover.waypoints(length_m) * 2 * np.arange(path.shape[1])
    rows = np.repeat(good[:, None], path.shape[1], axis=1)
    near = np.zeros(rows.shape, dtype=bool)
    paths, spheres = kernel_array(path[rows]), kernel_array(spheres[rows])
    near[rows] = _near_robot(paths, spheres, mover.arrays, world.config.self_padding_m)
    return good & ~near.any(axis=1)


def _approachable(
    mover: Mover,
    world: CollisionWorld,
    qpos: _Qpos,
    Ts_world_tool0: _Poses,
    own_ids: Int[np.ndarray, "m"],
    backward: Float[np.ndarray, "m 3"],
) -> Bool[np.ndarray, "m"]:
    """Check whether there is a free pre-grasp, and a line from it that is clear of everything fixed."""
    back_offs_m = mover.config.cartesian.back_offs_m
    counts = mover.line_counts(back_offs_m)
    path, reached = mover.follow(qpos, Ts_world_tool0, backward, max(back_offs_m))
    # Waypoints that were not reached are not finite, and count as in contact.
    ends, owns = path[:, [c - 1 for c in counts]], np.repeat(own_ids, len(counts))
    free = blockers(world, mover.arrays, ends.reshape(-1, path.shape[2]), mover.opening_m, owns).free
    fixed = _fixed(mover, world, np.concatenate([qpos[:, None], path], axis=1)[:, ::2])
    off = np.stack([~fixed[:, : count // 2 + 1].any(axis=1) for count in counts], axis=1)
    return np.any(free.reshape(off.shape) & off & (reached[:, None] >= counts), axis=1)


def _fixed(mover: Mover, world: CollisionWorld, paths: np.ndarray) -> Bool[np.ndarray, "m w"]:
    """Check whether table, bin or the robot itself is touched at each waypoint of paths (m, w, dof)."""
    flat = paths.reshape(-1, paths.shape[2])
    return static_contacts(world, mover.arrays, flat, mover.opening_m).reshape(paths.shape[:2])


def _bounding_sphere(points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "4"]:
    """Return a sphere around an object, with room for the spheres that stand for it when it is held."""
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0)).astype(float)
    return np.append(middle, np.linalg.norm(points - middle, axis=1).max() + _ROOM_M)


@njit(cache=True)
def _near_robot(qpos, spheres, robot, padding):
    """Check whether each sphere touches the spheres around the links that a held object may touch, or a fixed part."""
    n, dof = qpos.shape
    out = np.zeros(n, np.bool_)
    scratch = scratch_for(robot)
    placed = scratch[3]
    first = robot.radii.shape[0]
    for i in range(n):
        place_spheres(qpos[i], 0.0, robot, scratch)
        x, y, z, r = spheres[i]
        for link in range(dof - 1):
            p, reach = placed[first + link], robot.link_spheres[link, 3] + r + padding
            if (p[0] - x) ** 2 + (p[1] - y) ** 2 + (p[2] - z) ** 2 < reach * reach:
                out[i] = True
        for s in robot.static_spheres:
            reach = s[3] + r + padding
            if (s[0] - x) ** 2 + (s[1] - y) ** 2 + (s[2] - z) ** 2 < reach * reach:
                out[i] = True
    return out
