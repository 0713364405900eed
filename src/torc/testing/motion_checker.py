"""Is a pick plan what it claims to be? An independent check on the robot's full geometry."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from torc.motion.protocol import PickRequest
from torc.records import PickPlan, Trajectory
from torc.robots.description import RobotDescription
from torc.robots.kinematics import tool0_poses
from torc.scenes.workspace import Workspace
from torc.testing.full_geometry import FullGeometry, solid_boxes, voxel_octree


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
    start_zone_m: float = 0.03
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
        ]

    def _continuity(self, plan: PickPlan, request: PickRequest) -> list[str]:
        segments = _segments(plan)
        out = []
        if np.abs(plan.free.qpos[0] - request.qpos_start).max() > 1e-6:
            out.append("The plan does not start where the arm is.")
        if np.abs(plan.home.qpos[-1] - self._robot.arm.rest_qpos).max() > 1e-6:
            out.append("The plan does not end at rest.")
        for (first, a), (second, b) in zip(segments[:-1], segments[1:]):
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
        for name, t, direction in (("approach", plan.approach, axis), ("lift", plan.lift, np.array([0, 0, 1.0]))):
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
        opening = self._robot.gripper.max_width_m
        dof = self._robot.arm.dof
        out = []
        for name, t in _segments(plan):
            width = plan.width_m if name in ("lift", "transfer") else opening
            voxels = []
            if name in ("free", "transfer", "home"):
                own = request.object_id if name == "free" else None
                voxels = self._voxels(request, t.qpos[0], width, own)
            for q in _thinned(t, self.config.sample_s):
                poses = self._geometry.place(q, width)
                arm = np.flatnonzero((self._geometry.links >= 2) & (self._geometry.links < dof))
                moving = np.flatnonzero(self._geometry.links >= 2)
                hits = self._geometry.touching(poses, self._fixed, moving)
                if voxels:
                    hits += self._geometry.touching(poses, voxels[0], moving)
                    hits += self._geometry.touching(poses, voxels[1], arm)
                pairs = self._geometry.self_contacts(poses)
                if hits or pairs:
                    names = [self._geometry.name(i) for i in hits]
                    pair_names = [f"{self._geometry.name(i)} and {self._geometry.name(j)}" for i, j in pairs]
                    out.append(f"{name}: touches at {np.round(q, 3).tolist()}: {names + pair_names}")
                    break
        return out

    def _voxels(
        self, request: PickRequest, q_start: Float[np.ndarray, "dof"], width_m: float, own: int | None
    ) -> tuple[list, list]:
        """Obstacles for the whole robot (other objects), and for the arm's links only (surface of the own object)."""
        world = request.world
        bit = np.uint64(1) << np.uint64(request.object_id)
        occupied = world.kind > 0
        mine = (world.bits & bit) != 0
        centers = world.grid.centers()
        zone = self._near_robot(centers, occupied, q_start, width_m, world.grid.voxel_size_m)
        others = voxel_octree(centers[occupied & ~mine & ~zone], world.grid.voxel_size_m)
        surface = None
        if own is not None:
            surface = voxel_octree(centers[mine & (world.kind == 1) & ~zone], world.grid.voxel_size_m)
        return [o for o in (others,) if o is not None], [o for o in (surface,) if o is not None]

    def _near_robot(
        self, centers: np.ndarray, occupied: np.ndarray, q: np.ndarray, width_m: float, voxel_size_m: float
    ) -> np.ndarray:
        """Voxels around the robot's shapes at q, if it touches any there; else none."""
        zone = np.zeros(occupied.shape, dtype=bool)
        poses = self._geometry.place(q, width_m)
        moving = np.flatnonzero(self._geometry.links >= 0)
        tree = voxel_octree(centers[occupied], voxel_size_m)
        if tree is None:
            return zone
        index = np.argwhere(occupied)
        distance = self._geometry.distance_to_points(poses, moving, centers[occupied])
        near = distance < self.config.start_zone_m
        if near.any():
            zone[tuple(index[near].T)] = True
        return zone


def _segments(plan: PickPlan) -> list[tuple[str, Trajectory]]:
    return [(name, getattr(plan, name)) for name in ("free", "approach", "lift", "transfer", "home")]


def _thinned(t: Trajectory, sample_s: float) -> Float[np.ndarray, "n dof"]:
    stride = max(1, round(sample_s / max(t.times_s[1] - t.times_s[0], 1e-9)))
    index = np.unique(np.append(np.arange(0, len(t.qpos), stride), len(t.qpos) - 1))
    return t.qpos[index]
