"""Find the grasps that the arm can carry out in straight lines: down to the object, and up again with it.

A grasp that passes the validity checks may still have no straight approach or lift: a joint limit, the table or the
robot itself blocks every inverse-kinematics solution. This is known before anything is decided.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from torc.collision.collision_world import CollisionWorld
from torc.collision.contacts import with_attached, world_arrays
from torc.collision.placement import RobotArrays
from torc.geometry.transforms import invert, kernel_array
from torc.grasping.validity import tool0_targets
from torc.motion.config import MotionConfig
from torc.motion.holding import Held, held_where_it_lies
from torc.motion.line_kernels import NO_WAY, NOT_FOLLOWED, UNSURE, LineGrasps, all_ways, first_ways
from torc.motion.mover import Mover
from torc.parallel import by_rows
from torc.records import GraspReport, GraspSet, GraspStatus, OcclusionVolume, SegmentedScene
from torc.robots.description import RobotDescription
from torc.robots.ik import solve_ik


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
    """Return VALID grasps that have no straight approach from a free pre-grasp, or no straight lift.

    Each object's grasps are followed by falling score until as many of them have both as the motion planner tries
    (`config.max_grasps`); the others are left alone. A grasp that was followed is returned if and only if
    `line_candidates` finds nothing for it, whatever the start.

    Args:
        grasps, report, scene, volume, world: as in a PickRequest.
        support_z_m: height of the support, world frame.
        config: settings of the motion planner that will carry them out.
    """
    out = np.zeros(len(grasps), dtype=bool)
    ranked = [k[report.status[k] == GraspStatus.VALID] for k in map(grasps.of, report.object_ids)]
    order = np.concatenate([np.zeros(0, dtype=np.int64), *ranked])
    ends = np.cumsum([0, *map(len, ranked)])
    search = _Search(grasps, report, order, scene, volume, world, Mover(robot, config), support_z_m)
    out[order] = search.ways(ends) == NO_WAY
    return out


_ROOM_M = 0.03


@dataclass(frozen=True)
class _Search:
    """Looks for straight ways of the grasps `order`; see `without_lines`."""

    all: GraspSet
    report: GraspReport
    order: np.ndarray
    scene: SegmentedScene
    volume: OcclusionVolume
    world: CollisionWorld
    mover: Mover
    support_z_m: float
    held: dict[int, Held] = field(default_factory=dict)
    """The objects as they would be held, world frame, as far as they were asked for."""

    def ways(self, ends: Int[np.ndarray, "k1"]) -> UInt8[np.ndarray, "m"]:
        """Return what is known of each grasp's ways; object k's grasps are those from ends[k] to ends[k + 1]."""
        found = np.full(len(self.order), NOT_FOLLOWED, dtype=np.uint8)
        if len(found) == 0:
            return found
        arm, grasps = self.mover.arm, self.grasps
        fixed, world = (self.mover.line_rules, self.mover.arrays), world_arrays(self.world)
        most = self.mover.config.max_grasps
        # Most can be carried out from their configuration in the report; the others' solutions are not kept.
        by_rows(first_ways, (ends[:-1], ends[1:]), most, grasps, *fixed, world, found, least=1)
        rest = np.flatnonzero((found == NO_WAY) | (found == UNSURE))
        solutions = solve_ik(arm, self.tool0[rest])
        some = found[rest]
        columns = rest, kernel_array(solutions.qpos), solutions.count, some
        by_rows(all_ways, columns, False, grasps, *fixed, fixed[1], world, least=1)
        for n in np.flatnonzero(some == UNSURE).tolist():
            some[n], holding = NO_WAY, self._holding(int(rest[n]))
            by_rows(all_ways, [c[n : n + 1] for c in columns], True, grasps, *fixed, holding, world)
        found[rest] = some
        return found

    @cached_property
    def tool0(self) -> Float[np.ndarray, "m 4 4"]:
        """The flange at each grasp."""
        return tool0_targets(self.all, self.mover.robot.gripper)[self.order]

    @cached_property
    def grasps(self) -> LineGrasps:
        """The grasps for kernels."""
        index, ids = self.order, self.all.object_ids[self.order]
        widths_m = np.clip(self.all.widths_m[index], 0.0, self.mover.robot.gripper.max_width_m)
        bounds = {k: _bounding_sphere(self.scene.object(k).points) for k in np.unique(ids).tolist()}
        return LineGrasps(
            qpos=kernel_array(self.report.qpos[index]),
            Ts=kernel_array(self.tool0[:, :3]),
            backward=kernel_array(-self.all.Ts_world_tcp[index][:, :3, 2]),
            own=np.uint64(1) << ids.astype(np.uint64),
            widths=kernel_array(widths_m),
            bounds=np.array([bounds[k] for k in ids.tolist()]),
        )

    def _holding(self, n: int) -> RobotArrays:
        """Return the robot with what is seen of a grasp's object in its hand."""
        object_id = int(self.all.object_ids[self.order[n]])
        if object_id not in self.held:
            o, camera = (
                self.scene.object(object_id),
                self.scene.observation.T_world_camera[:3, 3].astype(float),
            )
            most = self.mover.config.attached_spheres
            self.held[object_id] = held_where_it_lies(o, camera, self.volume, self.support_z_m, most)
        held = self.held[object_id].moved(invert(self.tool0[n]))
        return with_attached(self.mover.arrays, held.seen)


def _bounding_sphere(points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "4"]:
    """Return a sphere around an object, with room for the spheres that stand for it when it is held."""
    rows = np.ascontiguousarray(points.T)  # coordinate by coordinate: several times as fast
    middle = 0.5 * (rows.min(axis=1) + rows.max(axis=1)).astype(float)
    return np.append(middle, np.linalg.norm(rows - middle[:, None], axis=0).max() + _ROOM_M)
