"""Is a pick plan what it claims to be? An independent check on the robot's full geometry."""

from dataclasses import dataclass
from itertools import pairwise

import coal
import numpy as np
from jaxtyping import Float
from scipy.spatial import cKDTree

from tests.helpers.full_geometry import FullGeometry, Obstacle, convex_hull, solid_boxes, voxel_octree
from torc.collision.collision_world import FREE, SURFACE
from torc.geometry.transforms import invert, transform_points
from torc.motion.protocol import PickRequest
from torc.records import PickPlan, Trajectory
from torc.robots.description import RobotDescription
from torc.robots.kinematics import tool0_poses
from torc.workspace.description import Workspace


@dataclass(frozen=True)
class CheckerConfig:
    """What is allowed.

    Attributes:
        gripper_dip_m: the gripper's shapes may enter obstacles by this much on free motions.
        start_zone_m: voxels this close to the robot at the start of a free motion do not count: it is there.
        sample_s: time between checked configurations.
        line_m, line_rad: largest deviation of a Cartesian motion from its line.
    """

    gripper_dip_m: float = 0.005
    start_zone_m: float = 0.04
    sample_s: float = 0.03
    line_m: float = 0.0015
    line_rad: float = 0.01


class PlanChecker:
    """Checks plans of one robot in one workspace."""

    def __init__(
        self, robot: RobotDescription, workspace: Workspace, config: CheckerConfig | None = None
    ) -> None:
        self.config = CheckerConfig() if config is None else config
        self._robot, self._workspace = robot, workspace
        self._geometry = FullGeometry(robot, self.config.gripper_dip_m)
        self._fixed = solid_boxes(workspace.static_boxes())

    def faults(self, plan: PickPlan, request: PickRequest) -> list[str]:
        """Everything that is wrong with a plan; empty if nothing is."""
        return [
            *self._continuity(plan, request),
            *self._limits(plan),
            *self._lines(plan),
            *self._collisions(plan, request),
            *self._held_object(plan, request),
        ]

    def _continuity(self, plan: PickPlan, request: PickRequest) -> list[str]:
        segments = _segments(plan)
        out = []
        if np.abs(plan.free.qpos[0] - request.qpos_start).max() > 1e-6:
            out.append("The plan does not start where the arm is.")
        if np.abs(plan.home.qpos[-1] - self._robot.arm.rest_qpos).max() > 1e-6:
            out.append("The plan does not end at rest.")
        for (first, a), (second, b) in pairwise(segments):
            if np.abs(a.qpos[-1] - b.qpos[0]).max() > 1e-6:
                out.append(f"{second} does not start where {first} ends.")
        return out

    def _limits(self, plan: PickPlan) -> list[str]:
        arm, out = self._robot.arm, []
        for name, t in _segments(plan):
            dt = np.diff(t.times_s)
            if t.times_s[0] != 0 or np.any(dt <= 0):
                out.append(f"{name}: times do not rise from 0.")
                continue
            if np.any(t.qpos < arm.lower - 1e-9) or np.any(t.qpos > arm.upper + 1e-9):
                out.append(f"{name}: beyond a joint limit.")
            if np.any(np.abs(t.qvel) > arm.max_speed + 1e-6):
                out.append(f"{name}: too fast.")
            measured = np.diff(t.qpos, axis=0) / dt[:, None]
            if np.any(np.abs(measured) > arm.max_speed + 1e-6):
                out.append(f"{name}: moves faster than permitted between samples.")
            # Positions and velocities must belong together: the mean velocity lies between those at the ends.
            slack = 0.6 * arm.max_acceleration * dt[:, None] + 1e-6
            if np.any(np.abs(measured - 0.5 * (t.qvel[1:] + t.qvel[:-1])) > slack):
                out.append(f"{name}: velocities do not belong to the positions.")
            if np.any(np.abs(np.diff(t.qvel, axis=0) / dt[:, None]) > 1.05 * arm.max_acceleration):
                out.append(f"{name}: accelerates too much.")
            if np.any(np.abs(t.qvel[[0, -1]]) > 1e-6):
                out.append(f"{name}: not at rest at its ends.")
        return out

    def _lines(self, plan: PickPlan) -> list[str]:
        out = []
        axis = plan.T_world_tcp[:3, 2]
        for name, t, direction in (
            ("approach", plan.approach, axis),
            ("lift", plan.lift, np.array([0, 0, 1.0])),
        ):
            Ts = tool0_poses(self._robot.arm, t.qpos) @ self._robot.gripper.T_tool0_tcp(plan.width_m)
            at_grasp = Ts[-1] if name == "approach" else Ts[0]
            if np.abs(at_grasp - plan.T_world_tcp).max() > 2e-3:
                out.append(f"{name}: not at the grasp where it should be.")
            offset = Ts[:, :3, 3] - plan.T_world_tcp[:3, 3]
            aside = offset - np.outer(offset @ direction, direction)
            if np.linalg.norm(aside, axis=1).max() > self.config.line_m:
                out.append(f"{name}: off its line by {1e3 * np.linalg.norm(aside, axis=1).max():.1f} mm.")
            turn = np.linalg.norm(Ts[:, :3, :3] - plan.T_world_tcp[:3, :3], axis=(1, 2)) / np.sqrt(2)
            if turn.max() > self.config.line_rad:
                out.append(f"{name}: turns by {turn.max():.3f} rad.")
            if np.any(np.diff(offset @ direction) < -1e-4):
                out.append(f"{name}: goes back and forth.")
        return out

    def _collisions(self, plan: PickPlan, request: PickRequest) -> list[str]:
        out = []
        for name, t in _segments(plan):
            width = plan.width_m if name in ("lift", "transfer") else self._robot.gripper.max_width_m
            everything: list[Obstacle] = []
            arm_only: list[Obstacle] = []
            if name in ("free", "transfer", "home"):
                everything, arm_only = self._voxels(name, plan, request, t.qpos[0], width)
            found = self._first_contact(t, width, [*self._fixed, *everything], arm_only)
            if found is not None:
                out.append(f"{name}: {found}")
        return out

    def _held_object(self, plan: PickPlan, request: PickRequest) -> list[str]:
        """The visible points of the held object must not enter table or bin, nor their hull the robot."""
        out = []
        for q in _thinned(plan.transfer, self.config.sample_s):
            points = self._held_points(plan, request, q)
            for box in self._workspace.static_boxes():
                depth = np.asarray(box.size) / 2 - np.abs(points - np.asarray(box.center))
                if np.any(depth.min(axis=1) > 0):
                    out.append(f"transfer: the held object enters {box.name} at {np.round(q, 3).tolist()}.")
                    return out
        return out + self._held_on_robot(plan, request)

    def _held_on_robot(self, plan: PickPlan, request: PickRequest) -> list[str]:
        """Where the hull of the held points first touches the robot, the hand that holds it left out."""
        q_grasp, dof = plan.lift.qpos[0], self._robot.arm.dof
        hull = convex_hull(self._held_points(plan, request, q_grasp))
        T_at_grasp = tool0_poses(self._robot.arm, q_grasp[None])[0]
        others = np.flatnonzero(self._geometry.links < dof - 1)
        for name, t in (("lift", plan.lift), ("transfer", plan.transfer)):
            qpos = _thinned(t, self.config.sample_s)
            for q, T in zip(qpos, tool0_poses(self._robot.arm, qpos) @ invert(T_at_grasp)):
                obstacle = (hull, coal.Transform3s(T[:3, :3], T[:3, 3]))
                hits = self._geometry.touching(self._geometry.place(q, plan.width_m), [obstacle], others)
                if hits:
                    parts = ", ".join(self._geometry.name(i) for i in hits)
                    return [f"{name}: the held object touches {parts} at {np.round(q, 3).tolist()}."]
        return []

    def _first_contact(
        self, t: Trajectory, width_m: float, everything: list[Obstacle], arm_only: list[Obstacle]
    ) -> str | None:
        """Where the robot first touches an obstacle or itself; arm_only: obstacles that the gripper may touch."""
        links, dof = self._geometry.links, self._robot.arm.dof
        moving, arm = np.flatnonzero(links >= 2), np.flatnonzero((links >= 2) & (links < dof))
        for q in _thinned(t, self.config.sample_s):
            poses = self._geometry.place(q, width_m)
            hits = self._geometry.touching(poses, everything, moving)
            hits += self._geometry.touching(poses, arm_only, arm)
            pairs = self._geometry.self_contacts(poses)
            if hits or pairs:
                names = [self._geometry.name(i) for i in hits]
                names += [f"{self._geometry.name(i)} on {self._geometry.name(j)}" for i, j in pairs]
                return f"{', '.join(names)} touch(es) at {np.round(q, 3).tolist()}"
        return None

    def _voxels(
        self,
        name: str,
        plan: PickPlan,
        request: PickRequest,
        q_start: Float[np.ndarray, "dof"],
        width_m: float,
    ) -> tuple[list[Obstacle], list[Obstacle]]:
        """Obstacles for the whole robot (other objects), and for the arm's links alone (the own surface)."""
        world = request.world
        centers, occupied = world.grid.centers(), world.kind != FREE
        mine = (world.bits & (np.uint64(1) << np.uint64(request.object_id))) != 0
        index = np.argwhere(occupied)
        poses = self._geometry.place(q_start, width_m)
        everywhere = np.flatnonzero(self._geometry.links >= 0)
        distance = self._geometry.distance_to_points(poses, everywhere, centers[occupied])
        if name == "transfer":
            held = self._held_points(plan, request, q_start)
            distance = np.minimum(distance, cKDTree(held).query(centers[occupied])[0])
        index = index[distance < self.config.start_zone_m]
        occupied[tuple(index.T)] = False
        size = world.grid.voxel_size_m
        own_surface = mine & (world.kind == SURFACE)
        if name == "free":
            return voxel_octree(centers[occupied & ~mine], size), voxel_octree(
                centers[occupied & own_surface], size
            )
        return voxel_octree(centers[occupied & ~mine], size), []

    def _held_points(
        self, plan: PickPlan, request: PickRequest, qpos: Float[np.ndarray, "dof"]
    ) -> Float[np.ndarray, "n 3"]:
        """The visible points of the object when it is held at qpos."""
        points = request.scene.object(plan.object_id).points.astype(float)
        T_world_tool0 = plan.T_world_tcp @ invert(self._robot.gripper.T_tool0_tcp(plan.width_m))
        now = tool0_poses(self._robot.arm, qpos[None])[0]
        return transform_points(now @ invert(T_world_tool0), points)


def _segments(plan: PickPlan) -> list[tuple[str, Trajectory]]:
    return [(name, getattr(plan, name)) for name in ("free", "approach", "lift", "transfer", "home")]


def _thinned(t: Trajectory, sample_s: float) -> Float[np.ndarray, "n dof"]:
    stride = max(1, round(sample_s / max(t.times_s[1] - t.times_s[0], 1e-9)))
    index = np.unique(np.append(np.arange(0, len(t.qpos), stride), len(t.qpos) - 1))
    return t.qpos[index]
