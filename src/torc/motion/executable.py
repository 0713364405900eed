"""Find the grasps that the arm can carry out in straight lines: down to the object, and up again with it.

A grasp that passes the validity checks may still have no straight approach or lift: a joint limit, the table or the
robot itself blocks every inverse-kinematics solution. This is known before anything is decided.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, UInt8

from torc.collision.collision_world import CollisionWorld
from torc.collision.contacts import with_attached, world_arrays
from torc.collision.placement import RobotArrays
from torc.geometry.transforms import invert, kernel_array
from torc.grasping.validity import tool0_targets
from torc.motion.config import MotionConfig
from torc.motion.holding import Held, held_where_it_lies
from torc.motion.line_kernels import NO_WAY, UNSURE, WAY, ways
from torc.motion.mover import Mover
from torc.parallel import by_rows
from torc.records import GraspReport, GraspSet, GraspStatus, OcclusionVolume, SegmentedScene
from torc.robots.description import RobotDescription
from torc.robots.ik import IkSolutions, solve_ik


def without_lines(
    grasps: GraspSet,
    report: GraspReport,
    scene: SegmentedScene,
    volume: OcclusionVolume,
    world: CollisionWorld,
    robot: RobotDescription,
    support_z_m: float,
    config: MotionConfig,
    most: int | None = None,
) -> Bool[np.ndarray, "n"]:
    """Return VALID grasps that have no straight approach from a free pre-grasp, or no straight lift.

    Each object's grasps are followed by falling score until `most` of them have both, and the others left alone:
    nobody tries them. Followed grasps are returned exactly if `line_candidates` finds nothing for them, whatever the
    start.

    Args:
        grasps, report, scene, volume, world: as in a PickRequest.
        support_z_m: height of the support, world frame.
        config: settings of the motion planner that will carry them out.
        most: grasps with straight ways that are enough for an object; None to follow all.
    """
    out = np.zeros(len(grasps), dtype=bool)
    search = _Search(grasps, report, scene, volume, world, Mover(robot, config), support_z_m)
    waiting = {}
    for k in report.object_ids:
        ranked = grasps.of(k)
        waiting[k] = ranked[report.status[ranked] == GraspStatus.VALID]
    missing = dict.fromkeys(waiting, len(grasps) if most is None else most)
    while len(index := np.concatenate([np.zeros(0, int), *(w[: missing[k]] for k, w in waiting.items())])):
        out[index] = ~search.have_ways(index)
        for k, ranked in waiting.items():
            some = ranked[: missing[k]]
            waiting[k] = ranked[len(some) :]
            missing[k] -= int(np.count_nonzero(~out[some]))
    return out


_ROOM_M = 0.03


@dataclass(frozen=True)
class _Search:
    """Looks for straight ways of grasps; see `without_lines`."""

    grasps: GraspSet
    report: GraspReport
    scene: SegmentedScene
    volume: OcclusionVolume
    world: CollisionWorld
    mover: Mover
    support_z_m: float
    _held: dict[int, Held] = field(default_factory=dict)
    _bounds: dict[int, Float[np.ndarray, "4"]] = field(default_factory=dict)

    @cached_property
    def tool0(self) -> Float[np.ndarray, "n 4 4"]:
        """The flange at each grasp."""
        return tool0_targets(self.grasps, self.mover.robot.gripper)

    def have_ways(self, index: np.ndarray) -> Bool[np.ndarray, "m"]:
        """Check which of some grasps have straight ways."""
        m = len(index)
        # Most can be carried out from their configuration in the report; the others' solutions are not kept.
        found = self._ways(index, IkSolutions(np.zeros((m, 0, self.mover.arm.dof)), np.zeros(m, np.int64)))
        if len(rest := np.flatnonzero(found != WAY)):
            solutions = solve_ik(self.mover.arm, self.tool0[index[rest]])
            found[rest] = self._ways(index[rest], solutions)
            for k in rest[found[rest] == UNSURE].tolist():
                own = slice(k, k + 1)
                some = np.flatnonzero(rest == k)
                found[own] = self._ways(
                    index[own], IkSolutions(solutions.qpos[some], solutions.count[some]), exact=True
                )
        return found != NO_WAY

    def _ways(self, index: np.ndarray, solutions: IkSolutions, exact: bool = False) -> UInt8[np.ndarray, "m"]:
        """Return NO_WAY, WAY or UNSURE for some grasps; if `exact`, for a single one, with its object in the hand."""
        grasps, mover, out = self.grasps, self.mover, np.zeros(len(index), np.uint8)
        ids = grasps.object_ids[index]
        rows = (
            kernel_array(self.report.qpos[index]),
            kernel_array(solutions.qpos),
            solutions.count,
            kernel_array(self.tool0[index][:, :3]),
            kernel_array(-grasps.Ts_world_tcp[index][:, :3, 2]),
            np.uint64(1) << ids.astype(np.uint64),
            kernel_array(np.clip(grasps.widths_m[index], 0.0, mover.robot.gripper.max_width_m)),
            np.array([self.bounding_sphere(k) for k in ids.tolist()]),
            out,
        )
        holding = self._holding(int(index[0])) if exact else mover.arrays
        world = world_arrays(self.world)
        by_rows(ways, rows, exact, mover.line_rules(), mover.arrays, holding, world, least=2)
        return out

    def _holding(self, grasp: int) -> RobotArrays:
        """Return the robot with what is seen of a grasp's object in its hand."""
        held = self.held(int(self.grasps.object_ids[grasp])).moved(invert(self.tool0[grasp]))
        return with_attached(self.mover.arrays, held.seen)

    def held(self, object_id: int) -> Held:
        """Return an object as it would be held, world frame, where it is now."""
        if object_id not in self._held:
            camera = self.scene.observation.T_world_camera[:3, 3].astype(float)
            self._held[object_id] = held_where_it_lies(
                self.scene.object(object_id),
                camera,
                self.volume,
                self.support_z_m,
                self.mover.config.attached_spheres,
            )
        return self._held[object_id]

    def bounding_sphere(self, object_id: int) -> Float[np.ndarray, "4"]:
        """Return a sphere around an object, with room for the spheres that stand for it when it is held."""
        if object_id not in self._bounds:
            points = self.scene.object(object_id).points
            middle = 0.5 * (points.min(axis=0) + points.max(axis=0)).astype(float)
            radius = np.linalg.norm(points - middle, axis=1).max() + _ROOM_M
            self._bounds[object_id] = np.append(middle, radius)
        return self._bounds[object_id]
