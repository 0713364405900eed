"""Plan the motions of a pick for each valid grasp, best first, until all exist (paper: A Modular Pipeline)."""

from dataclasses import replace

import numpy as np

from torc.collision.contacts import carved
from torc.motion.config import MotionConfig
from torc.motion.free_motions import FreeMotions
from torc.motion.holding import Held, held_where_it_lies
from torc.motion.lines import LineContext, line_candidates, timed_lines
from torc.motion.mover import Mover
from torc.motion.protocol import NoMotionError, PickRequest
from torc.motion.search import corner_blends, shortcut, tree_search
from torc.motion.space import MotionQuery
from torc.motion.timing import rounded_path, time_path
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
        self.mover = Mover(robot, self.config)
        self.free = FreeMotions(self.mover, workspace)

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
        rest, width_m, held = arm.rest_qpos, self.mover.opening_m, self.held(request)
        T_world_tcp = tcp_pose(self.robot, rest, width_m)
        c = LineContext(self.mover, request.world, request.object_id, T_world_tcp, width_m, lambda: held)
        c.contacts(rest[None])
        self.mover.follow(rest[None], c.T_world_tool0, c.approach_axis, 0.01)
        possible = c.held.possible
        world = carved(c.world, self.mover.arrays, rest, c.width_m, config.carve_margin_m, possible)
        space = self.mover.space(world, c.width_m, possible)
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
        pairs = line_candidates(context, request.report.qpos[grasp], start)
        free, pair = self.free.to_pre_grasp(context, start, pairs, rng)
        approach, lift = timed_lines(self.mover, pair)
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
        """Return one grasp of a request and all that its motions depend on; `held` as the method of this name says."""
        T, width_m = request.grasps.Ts_world_tcp[grasp], float(request.grasps.widths_m[grasp])
        return LineContext(self.mover, request.world, request.object_id, T, width_m, lambda: held)
