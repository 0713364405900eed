"""From a frame to the decision."""

from dataclasses import replace

from torc.brain.answer import Answer
from torc.errors import InputError
from torc.grasping.names import DEFAULT_GRASPS
from torc.grasping.registry import make_grasp_planner
from torc.occlusion.volume import FIXED_CAMERA, empty_volume
from torc.perception.privileged import LabelPerception
from torc.pipeline.frames import Frame
from torc.pipeline.look import Pipeline
from torc.pipeline.min_score import DEFAULT_MIN_SCORE
from torc.pipeline.seeding import stage_rng
from torc.pipeline.warm_up import rehearse_look
from torc.records import OcclusionVolume
from torc.robots.description import RobotDescription
from torc.robots.loading import load_robot
from torc.robots.names import DEFAULT_ROBOT
from torc.scenes.workspace import Bin, Box, Workspace
from torc.task_planning.asking import ask_planner, rehearse_planner
from torc.task_planning.protocol import TaskPlanner
from torc.task_planning.registry import make_planner

_SAME_TABLE_M = 0.02
"""A support this close to the height of the robot's own table is that table."""


def decide_frame(
    frame: Frame,
    planner: TaskPlanner | None = None,
    *,
    robot: RobotDescription | str | None = None,
    volume: OcclusionVolume | None = None,
    seed: int = 0,
    min_score: float = DEFAULT_MIN_SCORE,
    grasps: str = DEFAULT_GRASPS,
) -> Answer:
    """Which object to pick next in a frame.

    Args:
        frame: the snapshot with masks, see `load_frame`.
        planner: task planner; DG-SELECT by default.
        robot: whose reach counts (a description, or its name or path); None checks only the gripper (a Robotiq
            2F-85) and takes every pose as reachable.
        volume: the occlusion volume after the frame before, None for the first frame.
        seed: decides all random draws.
        min_score: grasps that are less likely to deliver wait until no object has a better one; see `Pipeline`.
        grasps: the grasp planner, by name or as "module:Class".

    Raises:
        InputError: `min_score` is no probability, the grasp planner cannot be made, or the planner named an object that
            is not in sight.
        PlannerError, GraspPlannerError: a planner crashed, or answered something that is no decision or no grasps.
    """
    planner = planner or make_planner("dg-select")
    before = volume if volume is not None else empty_volume(frame.grid)
    look = _pipeline(frame, robot, min_score, grasps).look(
        frame.observation,
        before,
        target_description=frame.target_description,
        seed=seed,
        labels=frame.labels,
    )
    decision = ask_planner(planner, look.context, stage_rng(seed, 0, "decide"))
    if decision.object_id is not None and decision.object_id not in look.context.scene.ids:
        raise InputError(
            f"Task planner '{planner.name}' named object {decision.object_id}, which is not in sight."
        )
    return Answer(decision, look, frame.labels, frame.names)


def rehearse(
    frame: Frame,
    planner: TaskPlanner,
    *,
    robot: RobotDescription | str | None = None,
    grasps: str = DEFAULT_GRASPS,
) -> None:
    """Use every kernel that `decide_frame` may need once, on a made-up scene: then none is compiled in it."""
    rehearse_planner(planner, rehearse_look(_pipeline(frame, robot, grasps=grasps)).context)


def _pipeline(
    frame: Frame,
    robot: RobotDescription | str | None,
    min_score: float = DEFAULT_MIN_SCORE,
    grasps: str = DEFAULT_GRASPS,
) -> Pipeline:
    description = load_robot(robot) if isinstance(robot, str) else robot
    gripper = description.gripper if description is not None else load_robot(DEFAULT_ROBOT).gripper
    perception = LabelPerception()
    return Pipeline(
        perception=perception,
        grasp_planner=make_grasp_planner(grasps, gripper, frame.support_z_m),
        robot=description if description is not None else gripper,
        workspace=_workspace(frame, with_robot=description is not None),
        # Frames come from any distance: what perception takes for a reading, the volume does too.
        occlusion=replace(FIXED_CAMERA, max_depth_m=perception.config.max_depth_m),
        min_score=min_score,
    )


def _workspace(frame: Frame, *, with_robot: bool) -> Workspace:
    """The frame's support surface as the table; with a robot the workspace's own, if that is what is seen."""
    own = Workspace(grid=frame.grid)
    if with_robot and abs(frame.support_z_m - own.support_z_m) < _SAME_TABLE_M:
        return own
    # A workspace has a bin; here it is out of everything's way.
    nowhere = Bin(center=(0.0, 0.0, -100.0))
    (x, y, _), (dx, dy, _) = (
        0.5 * (frame.grid.upper + frame.grid.origin),
        frame.grid.upper - frame.grid.origin,
    )
    table = Box(
        "table", (float(x), float(y), frame.support_z_m - 0.05), (float(dx) + 0.4, float(dy) + 0.4, 0.10)
    )
    return Workspace(table=table, bin=nowhere, grid=frame.grid)
