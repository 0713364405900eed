"""The motions of a pick, for each valid grasp, best first, until all exist (paper: A Modular Pipeline)."""

from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np
from jaxtyping import Float

from torc.collision.checks import carved, robot_arrays
from torc.collision.world import CollisionWorld
from torc.geometry.transforms import invert, make_pose, transform_points
from torc.motion.config import MotionConfig, even_yaws
from torc.motion.following import follow_line
from torc.motion.holding import hull_spheres
from torc.motion.lines import LineContext, LinePair, line_fault, line_pairs
from torc.motion.protocol import PickRequest
from torc.motion.queries import timed_motion
from torc.motion.space import FreeSpace, free_space
from torc.motion.timing import time_line
from torc.records import GraspStatus, PickPlan, PlanFailure, PlanStage, Trajectory
from torc.robots.description import RobotDescription
from torc.robots.ik import solve_ik
from torc.scenes.workspace import Workspace

if TYPE_CHECKING:
    from torc.motion.pink_lines import PinkFollower


class _StageError(Exception):
    """A query found nothing; becomes a PlanFailure."""

    def __init__(self, stage: PlanStage, reason: str) -> None:
        super().__init__(reason)
        self.stage, self.reason = stage, reason


class OmplMotionPlanner:
    """Plans picks: RRT-Connect for the free motions, differential inverse kinematics for the straight ones."""

    def __init__(
        self, robot: RobotDescription, workspace: Workspace, config: MotionConfig | None = None
    ) -> None:
        self.robot, self.workspace = robot, workspace
        self.config = MotionConfig() if config is None else config
        self._arrays = robot_arrays(robot)

    def plan_pick(self, request: PickRequest, rng: np.random.Generator) -> PickPlan | PlanFailure:
        """Motions for the best valid grasp for which all of them exist, or where the last one failed."""
        order = request.grasps.of(request.object_id)
        order = order[request.report.status[order] == GraspStatus.VALID][: self.config.max_grasps]
        failure = PlanFailure(
            PlanStage.GRASP_CHOICE, f"Object {request.object_id} has no valid grasp.", grasps_tried=0
        )
        for tried, grasp in enumerate(order, start=1):
            try:
                return self._plan_grasp(request, int(grasp), tried, rng)
            except _StageError as failed:
                failure = PlanFailure(failed.stage, failed.reason, tried)
        return failure

    def _plan_grasp(self, request: PickRequest, grasp: int, tried: int, rng: np.random.Generator) -> PickPlan:
        T_world_tcp = request.grasps.Ts_world_tcp[grasp].astype(float)
        width = float(np.clip(request.grasps.widths_m[grasp], 0.0, self.robot.gripper.max_width_m))
        T_world_tool0 = T_world_tcp @ invert(self.robot.gripper.T_tool0_tcp(width))
        points = request.scene.object(request.object_id).points
        held = hull_spheres(
            transform_points(invert(T_world_tool0), points.astype(float)), self.config.attached_spheres
        )
        context = LineContext(
            self.robot.arm, self._arrays, request.world, self._opening_m, request.object_id, width, held
        )
        pairs = self._lines(request, grasp, context, T_world_tool0, T_world_tcp[:3, 2])
        free, pair = self._free(request, pairs, rng)
        approach_path, lift_path = self._refined(pair)
        cartesian = self.config.cartesian
        approach = self._timed_line(approach_path, pair.approach_poses, cartesian.approach_speed_m_s)
        lift = self._timed_line(lift_path, pair.lift_poses, cartesian.lift_speed_m_s)
        transfer, home = self._deliver(request, lift_path[-1], width, held, rng)
        return PickPlan(
            request.object_id, grasp, T_world_tcp, width, free, approach, lift, transfer, home, tried
        )

    # -- approach and lift
    # ------------------------------------------------------------------------------------------

    def _lines(
        self,
        request: PickRequest,
        grasp: int,
        context: LineContext,
        T_world_tool0: Float[np.ndarray, "4 4"],
        approach_axis: Float[np.ndarray, "3"],
    ) -> list[LinePair]:
        """Candidates for approach and lift, best first."""
        branches, config = self._branches(request, grasp, context, T_world_tool0), self.config.cartesian
        blocked: list[LinePair] = []
        for i in range(config.max_rounds):
            some = branches[i * config.max_branches : (i + 1) * config.max_branches]
            pairs, others = line_pairs(
                context, T_world_tool0, approach_axis, some, request.qpos_start, config
            )
            if pairs:
                return pairs
            blocked += others
        why = "no pre-grasp is free" if blocked else "no straight approach and lift within reach"
        raise _StageError(PlanStage.APPROACH, f"Grasp {grasp}: {why}.")

    def _branches(
        self, request: PickRequest, grasp: int, context: LineContext, T_world_tool0: np.ndarray
    ) -> Float[np.ndarray, "b dof"]:
        """Free inverse-kinematics solutions of the grasp; the report's own one first."""
        solutions = solve_ik(self.robot.arm, T_world_tool0[None]).of(0)
        reported = request.report.qpos[grasp]
        if np.all(np.isfinite(reported)):
            solutions = np.vstack([reported, solutions])
        if len(solutions) == 0:
            raise _StageError(PlanStage.INVERSE_KINEMATICS, f"Grasp {grasp} is out of reach.")
        free = context.contacts(solutions).free
        if not free.any():
            raise _StageError(
                PlanStage.INVERSE_KINEMATICS, f"Grasp {grasp}: the arm touches something in every solution."
            )
        return solutions[free]

    def _refined(self, pair: LinePair) -> tuple[np.ndarray, np.ndarray]:
        """Joint paths of approach and lift: pink's where it stays on the lines, else the compiled follower's."""
        if not self.config.cartesian.use_pink:
            return pair.approach, pair.lift
        cartesian = self.config.cartesian
        approach = self._pink_line(pair.approach, pair.approach_poses, cartesian.approach_speed_m_s)
        lift = self._relifted(pair, approach[-1])
        return approach, self._pink_line(lift, pair.lift_poses, cartesian.lift_speed_m_s)

    def _relifted(self, pair: LinePair, q_grasp: Float[np.ndarray, "dof"]) -> Float[np.ndarray, "k dof"]:
        """The lift from a configuration that differs a little from the one it was planned for."""
        arm, cartesian = self.robot.arm, self.config.cartesian
        paths, counts = follow_line(
            self._arrays,
            q_grasp[None],
            pair.lift_poses[1:],
            arm.lower,
            arm.upper,
            cartesian.max_joint_step_rad,
        )
        if counts[0] < len(pair.lift_poses) - 1:
            raise _StageError(PlanStage.LIFT, "The lift cannot be followed from where the approach ends.")
        return np.vstack([q_grasp, paths[0]])

    def _pink_line(
        self, path: Float[np.ndarray, "m dof"], poses: Float[np.ndarray, "m 4 4"], speed_m_s: float
    ) -> Float[np.ndarray, "m dof"]:
        """The line by pink if that is sound, else the path given."""
        dt_s = self.config.cartesian.step_m / speed_m_s
        followed = self._follower.follow(path[0], poses[1:], path[1:], dt_s)
        if followed is None:
            return path
        followed = np.vstack([path[0], followed])
        sound = line_fault(self.robot.arm, followed, poses, self.config.cartesian) is None
        return followed if sound else path

    def _timed_line(
        self, path: Float[np.ndarray, "m dof"], poses: Float[np.ndarray, "m 4 4"], speed_m_s: float
    ) -> Trajectory:
        distances = np.linalg.norm(poses[:, :3, 3] - poses[0, :3, 3], axis=1)
        return time_line(path, distances, speed_m_s, self.robot.arm, self.config.timing)

    # -- free motions
    # -----------------------------------------------------------------------------------------------

    def _free(
        self, request: PickRequest, pairs: list[LinePair], rng: np.random.Generator
    ) -> tuple[Trajectory, LinePair]:
        """From the start to one of the pre-grasps."""
        pairs = pairs[: self.config.search.goals]
        start = np.asarray(request.qpos_start, dtype=float)
        world = self._opened(request.world, start, self._opening_m, PlanStage.FREE)
        goals = np.stack([pair.approach[0] for pair in pairs])
        margin = self.config.carve_margin_m
        for goal in goals[self._space(world, self._opening_m).collides(goals)]:
            # Only the object to be grasped can be in the way here: let the hand come close to it at this
            # place.
            world = carved(world, self._arrays, goal, self._opening_m, margin, only_id=request.object_id)
        space = self._space(world, self._opening_m)
        open_goals = ~space.collides(goals)
        pairs = [pair for pair, good in zip(pairs, open_goals) if good]
        if not pairs:
            raise _StageError(PlanStage.FREE, "Every pre-grasp touches something.")
        motion, chosen = self._motion(space, start, goals[open_goals], None, PlanStage.FREE, rng)
        return motion, pairs[chosen]

    def _deliver(
        self,
        request: PickRequest,
        start: Float[np.ndarray, "dof"],
        width_m: float,
        held: Float[np.ndarray, "a 4"],
        rng: np.random.Generator,
    ) -> tuple[Trajectory, Trajectory]:
        """With the object to the bin, and back to rest."""
        own = request.object_id
        transfer = self._transfer(request, start, width_m, held, rng)
        over_bin, rest = transfer.qpos[-1], self.robot.arm.rest_qpos
        empty = request.world.without_object(own)
        for place in (over_bin, rest):
            empty = self._opened(empty, place, self._opening_m, PlanStage.TRANSFER)
        space = self._space(empty, self._opening_m)
        home, _ = self._motion(space, over_bin, rest[None], None, PlanStage.TRANSFER, rng)
        return transfer, home

    def _transfer(
        self,
        request: PickRequest,
        start: Float[np.ndarray, "dof"],
        width_m: float,
        held: Float[np.ndarray, "a 4"],
        rng: np.random.Generator,
    ) -> Trajectory:
        """With the object to the bin.

        What the object hid stays an obstacle at first: another object may stand there. Where arm or object are in
        it already, or no way is found, it is taken to be free; and so is, at last, more of the start's surroundings.
        """
        cautious = request.world.without_object(request.object_id, unknown=False)
        bold = request.world.without_object(request.object_id)
        margin, stage = self.config.carve_margin_m, PlanStage.TRANSFER
        if not self._space(cautious, width_m, held).collides(start[None])[0]:
            worlds = [cautious, bold]
        else:
            worlds = [self._opened(bold, start, width_m, stage, held, m) for m in (margin, 2 * margin)]
        for world in worlds[:-1]:
            try:
                return self._to_bin(self._space(world, width_m, held), start, rng)
            except _StageError:
                continue
        return self._to_bin(self._space(worlds[-1], width_m, held), start, rng)

    def _to_bin(
        self, space: FreeSpace, start: Float[np.ndarray, "dof"], rng: np.random.Generator
    ) -> Trajectory:
        """To the drop position, where it is quick to reach both from here and from the rest position."""
        for goals in self._drop_qpos:
            goals = goals[~space.collides(goals)]
            if len(goals):
                later = space.seconds_between(goals, self.robot.arm.rest_qpos)
                return self._motion(space, start, goals, later, PlanStage.TRANSFER, rng)[0]
        raise _StageError(PlanStage.TRANSFER, "No free configuration above the bin.")

    def _motion(
        self,
        space: FreeSpace,
        start: Float[np.ndarray, "dof"],
        goals: Float[np.ndarray, "g dof"],
        cost: Float[np.ndarray, "g"] | None,
        stage: PlanStage,
        rng: np.random.Generator,
    ) -> tuple[Trajectory, int]:
        """A free motion to one of the goals, and which."""
        cost = np.zeros(len(goals)) if cost is None else cost
        found = timed_motion(space, start, goals, cost, self.robot.arm, self.config, rng)
        if found is PlanStage.TIMING:
            raise _StageError(found, f"The path found for the {stage} could not be timed and stay free.")
        if isinstance(found, PlanStage):
            raise _StageError(stage, f"No free path was found for the {stage}.")
        return found

    def _opened(
        self,
        world: CollisionWorld,
        qpos: Float[np.ndarray, "dof"],
        width_m: float,
        stage: PlanStage,
        held: Float[np.ndarray, "a 4"] | None = None,
        margin_m: float | None = None,
    ) -> CollisionWorld:
        """The world without the voxels that the robot touches where it is: it is there, so they are free."""
        if not self._space(world, width_m, held).collides(qpos[None])[0]:
            return world
        margin_m = self.config.carve_margin_m if margin_m is None else margin_m
        world = carved(world, self._arrays, qpos, width_m, margin_m, held)
        if self._space(world, width_m, held).collides(qpos[None])[0]:
            raise _StageError(
                stage, "Where a motion has to start or end, the arm touches table, bin or itself."
            )
        return world

    def _space(
        self, world: CollisionWorld, width_m: float, held: Float[np.ndarray, "a 4"] | None = None
    ) -> FreeSpace:
        arm = self.robot.arm
        return free_space(self._arrays, world, width_m, (arm.lower, arm.upper), arm.max_speed, held)

    # -- fixed things, computed when first needed
    # ----------------------------------------------------------------------

    @cached_property
    def _opening_m(self) -> float:
        widest = self.robot.gripper.max_width_m
        return widest if self.config.opening_m is None else min(self.config.opening_m, widest)

    @cached_property
    def _follower(self) -> "PinkFollower":
        # Imported when needed: pink and pinocchio take a second to load.
        from torc.motion.pink_lines import PinkFollower

        return PinkFollower(self.robot.arm, self.config.cartesian.limit_margin_rad)

    @cached_property
    def _drop_qpos(self) -> list[Float[np.ndarray, "n dof"]]:
        """Configurations with the gripper pointing down over the bin, one array per height."""
        T_tcp_tool0 = invert(self.robot.gripper.T_tool0_tcp(self._opening_m))
        out = []
        for raised in self.config.drop_raises_m:
            position = np.add(self.workspace.drop_position, (0.0, 0.0, raised))
            poses = []
            for yaw in even_yaws(self.config.drop_yaws):
                c, s = np.cos(yaw), np.sin(yaw)
                R = np.array([[c, s, 0.0], [s, -c, 0.0], [0.0, 0.0, -1.0]])
                poses.append(make_pose(R, position) @ T_tcp_tool0)
            solutions = solve_ik(self.robot.arm, np.stack(poses))
            out.append(solutions.qpos[np.isfinite(solutions.qpos[:, :, 0])])
        return out


def with_backend(config: MotionConfig, backend: Literal["ompl", "numba"]) -> MotionConfig:
    """The same settings with another search backend."""
    return replace(config, search=replace(config.search, backend=backend))
