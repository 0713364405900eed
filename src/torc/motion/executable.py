"""Which grasps the arm can carry out in straight lines: down to the object, and up again with it.

A grasp that passes the checks of validity may still have no straight approach or lift: a joint limit, the table or the
robot itself is in the way of every inverse-kinematics solution. That is known before anything is decided.
"""

from dataclasses import dataclass
from functools import cache, partial

import numpy as np
from jaxtyping import Bool, Float, Int
from numba import njit

from torc.collision.checks import blockers, robot_arrays, static_contacts
from torc.collision.placement import RobotArrays, place_spheres, sphere_rows
from torc.collision.world import CollisionWorld
from torc.geometry.arrays import kernel_array
from torc.geometry.transforms import invert
from torc.motion.config import CartesianConfig, MotionConfig
from torc.motion.extent import held_where_it_lies
from torc.motion.following import follow_lines, waypoints_of
from torc.motion.holding import Held
from torc.motion.line_context import line_context
from torc.motion.lines import line_counts
from torc.motion.straight_motions import StraightMotions
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
    """The VALID grasps that have no straight approach from a free pre-grasp, or no straight lift.

    Exactly those for which `StraightMotions.candidates` finds nothing, whatever the start.

    Args:
        grasps, report: as in a PickRequest.
        scene, volume, world: likewise.
        robot: whose arm.
        support_z_m: height of the table top.
        config: settings of the motion planner that will carry them out.
    """
    out = np.zeros(len(grasps), dtype=bool)
    valid = np.flatnonzero(report.status == GraspStatus.VALID)
    arrays, camera = robot_arrays(robot), scene.observation.T_world_camera[:3, 3].astype(float)
    asked = _Scene(robot, arrays, world, config)
    bounds = {
        k: _bounding_sphere(scene.object(k).points) for k in np.unique(grasps.object_ids[valid]).tolist()
    }
    doubtful = valid[~_obvious(grasps, report.qpos, valid, bounds, asked)]
    straight = StraightMotions(robot.arm, config)

    @cache
    def held(object_id: int) -> Held:
        return held_where_it_lies(
            scene.object(object_id), camera, volume, support_z_m, config.attached_spheres
        )

    for grasp in doubtful.tolist():
        own_id = int(grasps.object_ids[grasp])
        T, width_m = grasps.Ts_world_tcp[grasp], float(grasps.widths_m[grasp])
        hold = partial(held, own_id)
        context = line_context(robot, arrays, world, asked.opening_m, own_id, T, width_m, hold)
        out[grasp] = not straight.exist(context, report.qpos[grasp])
    return out


_ROOM_M = 0.03


@dataclass(frozen=True)
class _Scene:
    robot: RobotDescription
    arrays: RobotArrays
    world: CollisionWorld
    config: MotionConfig

    @property
    def opening_m(self) -> float:
        """Of the gripper before it closes."""
        return self.config.opening(self.robot.gripper.max_width_m)


def _obvious(
    grasps: GraspSet,
    qpos: Float[np.ndarray, "n dof"],
    index: Int[np.ndarray, "m"],
    bounds: dict[int, Float[np.ndarray, "4"]],
    scene: _Scene,
) -> Bool[np.ndarray, "m"]:
    """Of the grasps in `index`, those that can be carried out from their configuration in `qpos`, all asked at once."""
    if len(index) == 0:
        return np.zeros(0, dtype=bool)
    gripper, config = scene.robot.gripper, scene.config.cartesian
    Ts_world_tcp, own_ids = (
        grasps.Ts_world_tcp[index].astype(float),
        grasps.object_ids[index].astype(np.int64),
    )
    widths_m = np.clip(grasps.widths_m[index].astype(float), 0.0, gripper.max_width_m)
    starts = _Starts(qpos[index], Ts_world_tcp @ invert(gripper.Ts_tool0_tcp_at(widths_m)), own_ids)
    spheres = np.array([bounds[k] for k in own_ids.tolist()])
    good = _raisable(starts, spheres, scene, config)
    good[good] = _approachable(starts.among(good), -Ts_world_tcp[good, :3, 2], scene, config)
    return good


@dataclass(frozen=True)
class _Starts:
    """Grasps to follow lines from: configuration, pose of the flange, own object."""

    qpos: Float[np.ndarray, "m dof"]
    Ts_world_tool0: Float[np.ndarray, "m 4 4"]
    own_ids: Int[np.ndarray, "m"]

    def among(self, mask: Bool[np.ndarray, "m"]) -> "_Starts":
        return _Starts(self.qpos[mask], self.Ts_world_tool0[mask], self.own_ids[mask])

    def __len__(self) -> int:
        return len(self.qpos)

    def followed(
        self, directions: Float[np.ndarray, "m 3"], waypoints: int, length_m: float, scene: _Scene
    ) -> tuple[Float[np.ndarray, "m w dof"], Int[np.ndarray, "m"]]:
        """The first waypoints of lines of that length, and how many of them are reached."""
        arm, config = scene.robot.arm, scene.config.cartesian
        limits = arm.lower + config.limit_margin_rad, arm.upper - config.limit_margin_rad
        spacing_m = length_m / waypoints_of(length_m, config.step_m)
        return follow_lines(
            scene.arrays,
            self.qpos,
            self.Ts_world_tool0,
            directions,
            waypoints,
            spacing_m,
            limits,
            config.max_joint_step_rad,
        )


def _raisable(
    starts: _Starts, bounds: Float[np.ndarray, "m 4"], scene: _Scene, config: CartesianConfig
) -> Bool[np.ndarray, "m"]:
    """Whether the shortest lift can be followed, off everything fixed, and with the object surely off the robot."""
    length_m = max(config.lifts_m)
    count = min(line_counts(config.lifts_m, waypoints_of(length_m, config.step_m)))
    up = np.tile([0.0, 0.0, 1.0], (len(starts), 1))
    path, reached = starts.followed(up, count, length_m, scene)
    path = np.concatenate([starts.qpos[:, None], path], axis=1)[:, ::2]
    good = (reached == count) & ~_fixed(path, scene).any(axis=1)
    raised = length_m / waypoints_of(length_m, config.step_m) * 2 * np.arange(path.shape[1])
    spheres = np.repeat(bounds[:, None], path.shape[1], axis=1)
    spheres[:, :, 2] += raised
    rows = good[:, None] & np.ones(path.shape[1], dtype=bool)
    near = np.zeros(rows.shape, dtype=bool)
    near[rows] = _near_robot(
        kernel_array(path[rows]), kernel_array(spheres[rows]), scene.arrays, scene.world.config.self_padding_m
    )
    return good & ~near.any(axis=1)


def _approachable(
    starts: _Starts, backward: Float[np.ndarray, "m 3"], scene: _Scene, config: CartesianConfig
) -> Bool[np.ndarray, "m"]:
    """Whether there is a free pre-grasp, and a line from it that is off everything fixed."""
    length_m = max(config.back_offs_m)
    waypoints = waypoints_of(length_m, config.step_m)
    counts = line_counts(config.back_offs_m, waypoints)
    path, reached = starts.followed(backward, waypoints, length_m, scene)
    # What was not reached is not finite, and counts as in contact.
    ends = path[:, [c - 1 for c in counts]]
    own_ids = np.repeat(starts.own_ids, len(counts))
    flat = ends.reshape(-1, path.shape[2])
    free = blockers(scene.world, scene.arrays, flat, scene.opening_m, own_ids).free.reshape(ends.shape[:2])
    fixed = _fixed(np.concatenate([starts.qpos[:, None], path], axis=1)[:, ::2], scene)
    out = np.zeros(len(starts), dtype=bool)
    for j, count in enumerate(counts):
        off = ~fixed[:, : count // 2 + 1].any(axis=1)
        out |= free[:, j] & off & (reached >= count)
    return out


def _fixed(paths: Float[np.ndarray, "m w dof"], scene: _Scene) -> Bool[np.ndarray, "m w"]:
    """Whether table, bin or the robot itself is touched at each waypoint."""
    flat = paths.reshape(-1, paths.shape[2])
    return static_contacts(scene.world, scene.arrays, flat, scene.opening_m).reshape(paths.shape[:2])


def _bounding_sphere(points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "4"]:
    """A sphere around an object, with room for the spheres that stand for it when it is held."""
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0)).astype(float)
    return np.append(middle, np.linalg.norm(points - middle, axis=1).max() + _ROOM_M)


@njit(cache=True)
def _near_robot(qpos, spheres, robot, padding):
    """Whether each sphere touches the spheres around the links that a held object may touch, or a fixed part."""
    n, dof = qpos.shape
    out = np.zeros(n, np.bool_)
    Ts, scratch = np.empty((dof + 1, 3, 4)), np.empty((3, 4))
    placed = np.empty((sphere_rows(robot), 3))
    first = robot.radii.shape[0]
    for i in range(n):
        place_spheres(qpos[i], 0.0, robot, Ts, scratch, placed)
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
