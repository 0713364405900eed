"""Plan the motions of a pick for each valid grasp, best first, until all exist (paper: A Modular Pipeline)."""

from dataclasses import replace

import numpy as np

from torc.collision.contacts import carved, robot_arrays
from torc.geometry.transforms import Pose
from torc.motion.config import MotionConfig
from torc.motion.following import follow_lines
from torc.motion.free_motions import FreeMotions
from torc.motion.geometry import rounded_path
from torc.motion.holding import Held, held_where_it_lies
from torc.motion.line_context import LineContext, line_context
from torc.motion.protocol import NoMotionError, PickRequest
from torc.motion.smoothing import corner_blends, shortcut
from torc.motion.space import MotionQuery, free_space
from torc.motion.straight_motions import StraightMotions
from torc.motion.timing import time_path
from torc.motion.tree_search import tree_search
from torc.records import GraspStatus, PickPlan, PlanFailure, PlanStage
from torc.registry.kinds import MotionPlannerTraits
from torc.robots.description import RobotDescription
from torc.robots.kinematics import tcp_pose
from torc.workspace.description import Workspace


class SamplingMotionPlanner(MotionPlannerTraits):
    """Plans picks: RRT-Connect for the free motions, differential inverse kinematics for the straight ones."""

    def __init__(
        self, robot: RobotDescription, workspace: Workspace, config: MotionConfig | None = None
    ) -> None:
        self.robot, self.workspace = robot, workspace
        self.config = MotionConfig() if config is None else config
        self._arrays = robot_arrays(robot)
        self.straight = StraightMotions(robot.arm, self.config)
        self.free = FreeMotions(robot, self._arrays, workspace, self.config)

    def plan_pick(self, request: PickRequest, rng: np.random.Generator) -> PickPlan | PlanFailure:
        """Return motions for the best valid grasp for which all of them exist, or where the last one failed."""
        order = request.grasps.of(request.object_id)
        order = order[request.report.status[order] == GraspStatus.VALID][: self.config.max_grasps]
        failure = PlanFailure(
            PlanStage.GRASP_CHOICE, f"Object {request.object_id} has no valid grasp.", grasps_tried=0
        )
        if len(order) == 0:
            return failure
        held = self.held(request)
        for tried, grasp in enumerate(order.tolist(), start=1):
            try:
                return self._plan_grasp(request, grasp, tried, held, rng)
            except NoMotionError as failed:
                failure = PlanFailure(failed.stage, f"Grasp {grasp}: {failed.reason}", tried)
        return failure

    def warm_up(self, request: PickRequest) -> None:
        """Run every compiled kernel once and discard the results; the path that is shortened need not be free."""
        arm, config, rng = self.robot.arm, self.config, np.random.default_rng(0)
        rest = arm.rest_qpos
        width_m = config.opening(self.robot.gripper.max_width_m)
        T_world_tcp = tcp_pose(self.robot, rest, width_m)
        c = self._context(request, T_world_tcp, width_m, self.held(request))
        c.contacts(rest[None])
        Ts, directions = c.T_world_tool0[None], c.approach_axis[None]
        follow_lines(arm, c.robot, rest[None], Ts, directions, 0.01, config.cartesian)
        world = carved(c.world, c.robot, rest, c.width_m, config.carve_margin_m, c.held.possible)
        space = free_space(c.robot, world, c.width_m, (arm.lower, arm.upper), arm.max_speed, c.held.possible)
        path = np.clip(rest + 0.05 * np.eye(3, arm.dof), arm.lower, arm.upper)
        space.collides(path)
        space.edge_free(path[0], path[1])
        tree_search(MotionQuery(space, path[0], path[1:]), replace(config.search, max_iterations=4), rng)
        path = shortcut(path, 1, space, rng)
        path = np.vstack([path[0], rest, path[-1]])
        for part in rounded_path(path, corner_blends(path, config.search.blend_rad, space)):
            time_path(part, arm, config.timing)

    def _plan_grasp(
        self, request: PickRequest, grasp: int, tried: int, held: Held, rng: np.random.Generator
    ) -> PickPlan:
        start = np.asarray(request.qpos_start, dtype=float)
        context = self.context(request, grasp, held)
        pairs = self.straight.candidates(context, request.report.qpos[grasp], start)
        free, pair = self.free.to_pre_grasp(context, start, pairs, rng)
        approach, lift = self.straight.timed(pair)
        transfer = self.free.to_bin(context, lift.qpos[-1], rng)
        home = self.free.home(context, transfer.qpos[-1], rng)
        return PickPlan(
            request.object_id,
            grasp,
            request.grasps.Ts_world_tcp[grasp].astype(float),
            context.width_m,
            free,
            approach,
            lift,
            transfer,
            home,
            tried,
        )

    def held(self, request: PickRequest) -> Held:
        """Return the object of a request as it would be held, world frame, where it is now."""
        camera = request.scene.observation.T_world_camera[:3, 3].astype(float)
        return held_where_it_lies(
            request.scene.object(request.object_id),
            camera,
            request.volume,
            self.workspace.support_z_m,
            self.config.attached_spheres,
        )

    def context(self, request: PickRequest, grasp: int, held: Held) -> LineContext:
        """Return one grasp of a request and everything that its motions depend on.

        `held` is the result of the method `held`.
        """
        grasps = request.grasps
        return self._context(request, grasps.Ts_world_tcp[grasp], float(grasps.widths_m[grasp]), held)

    def _context(self, request: PickRequest, T_world_tcp: Pose, width_m: float, held: Held) -> LineContext:
        opening_m = self.config.opening(self.robot.gripper.max_width_m)
        own_id, world = request.object_id, request.world
        return line_context(
            self.robot, self._arrays, world, opening_m, own_id, T_world_tcp, width_m, lambda: held
        )
