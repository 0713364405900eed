"""Find the grasps that the arm can carry out in straight lines: down to the object, and up again with it.

A grasp that passes the validity checks may still have no straight approach or lift: a joint limit, the table or the
robot itself blocks every inverse-kinematics solution. This is known before anything is decided.
"""

from dataclasses import dataclass, replace
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
    starts = _Starts(mover, world, report.qpos[valid], tool0_targets(grasps, robot.gripper)[valid], own_ids)
    bounds = {k: _bounding_sphere(scene.object(k).points) for k in set(own_ids.tolist())}
    good = starts.raisable(np.array([bounds[k] for k in own_ids.tolist()]))
    good[good] = starts.among(good).approachable(-grasps.Ts_world_tcp[valid[good], :3, 2])

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


@dataclass(frozen=True)
class _Starts:
    """Grasps to follow lines from: configuration, pose of the flange, own object; and the surroundings."""

    mover: Mover
    world: CollisionWorld
    qpos: Float[np.ndarray, "m dof"]
    Ts_world_tool0: Float[np.ndarray, "m 4 4"]
    own_ids: Int[np.ndarray, "m"]

    def among(self, mask: Bool[np.ndarray, "m"]) -> "_Starts":
        qpos, Ts, own_ids = self.qpos[mask], self.Ts_world_tool0[mask], self.own_ids[mask]
        return replace(self, qpos=qpos, Ts_world_tool0=Ts, own_ids=own_ids)

    def raisable(self, bounds: Float[np.ndarray, "m 4"]) -> Bool[np.ndarray, "m"]:
        """Check whether the shortest lift can be followed, clear of fixed things, with the object off the robot."""
        mover, lifts_m = self.mover, self.mover.config.cartesian.lifts_m
        length_m, count = max(lifts_m), min(mover.line_counts(lifts_m))
        path, reached = mover.follow(
            self.qpos, self.Ts_world_tool0, np.array([0.0, 0.0, 1.0]), length_m, count
        )
        path = np.concatenate([self.qpos[:, None], path], axis=1)[:, ::2]
        good = (reached == count) & ~self._fixed(path).any(axis=1)
        raised = length_m / mover.waypoints(length_m) * 2 * np.arange(path.shape[1])
        spheres = np.repeat(bounds[:, None], path.shape[1], axis=1)
        spheres[:, :, 2] += raised
        rows = np.repeat(good[:, None], path.shape[1], axis=1)
        near = np.zeros(rows.shape, dtype=bool)
        padding_m = self.world.config.self_padding_m
        near[rows] = _near_robot(
            kernel_array(path[rows]), kernel_array(spheres[rows]), mover.arrays, padding_m
        )
        return good & ~near.any(axis=1)

    def approachable(self, backward: Float[np.ndarray, "m 3"]) -> Bool[np.ndarray, "m"]:
        """Check whether there is a free pre-grasp, and a line from it that is clear of everything fixed."""
        mover, back_offs_m = self.mover, self.mover.config.cartesian.back_offs_m
        counts = mover.line_counts(back_offs_m)
        path, reached = mover.follow(self.qpos, self.Ts_world_tool0, backward, max(back_offs_m))
        # Waypoints that were not reached are not finite, and count as in contact.
        ends = path[:, [c - 1 for c in counts]]
        qpos, own_ids = ends.reshape(-1, path.shape[2]), np.repeat(self.own_ids, len(counts))
        free = blockers(self.world, mover.arrays, qpos, mover.opening_m, own_ids).free.reshape(ends.shape[:2])
        fixed = self._fixed(np.concatenate([self.qpos[:, None], path], axis=1)[:, ::2])
        out = np.zeros(len(self.qpos), dtype=bool)
        for j, count in enumerate(counts):
            off = ~fixed[:, : count // 2 + 1].any(axis=1)
            out |= free[:, j] & off & (reached >= count)
        return out

    def _fixed(self, paths: Float[np.ndarray, "m w dof"]) -> Bool[np.ndarray, "m w"]:
        """Check whether table, bin or the robot itself is touched at each waypoint."""
        flat = paths.reshape(-1, paths.shape[2])
        return static_contacts(self.world, self.mover.arrays, flat, self.mover.opening_m).reshape(
            paths.shape[:2]
        )


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
