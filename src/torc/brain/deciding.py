"""From a frame to the decision."""

from dataclasses import replace

from torc.brain.answer import Answer
from torc.errors import InputError
from torc.occlusion.volume import FIXED_CAMERA
from torc.perception.segmentation import PerceptionConfig
from torc.pipeline.building import build_pipeline
from torc.pipeline.frames import Frame
from torc.pipeline.look import Pipeline
from torc.pipeline.state import EpisodeState, stage_rng
from torc.pipeline.warm_up import rehearse_look
from torc.records import OcclusionVolume
from torc.robots.description import RobotDescription
from torc.robots.loading import load_robot
from torc.robots.names import DEFAULT_ROBOT
from torc.specs.conditions import PipelineSpec
from torc.task_planning.asking import ask_planner, rehearse_planner
from torc.task_planning.protocol import TaskPlanner
from torc.task_planning.registry import make_planner
from torc.workspace.description import Box, Workspace
from torc.workspace.files import load_workspace

# Frames come from any distance: what perception takes for a reading, the volume does too.
_ANY_DISTANCE = replace(FIXED_CAMERA, max_depth_m=PerceptionConfig().max_depth_m)
_SAME_TABLE_M = 0.02
"""A support this close to the height of the robot's own table is that table."""


def decide_frame(
    frame: Frame,
    planner: TaskPlanner | None = None,
    *,
    robot: RobotDescription | str | None = None,
    volume: OcclusionVolume | None = None,
    seed: int = 0,
    stages: PipelineSpec | None = None,
) -> Answer:
    """Which object to pick next in a frame.

    Args:
        planner: task planner; DG-SELECT by default.
        robot: whose reach counts (a description, or its name or path); None checks only the gripper (a Robotiq
            2F-85) and takes every pose as reachable.
        volume: the occlusion volume after the frame before, None for the first frame.
        stages: depth, perception, grasp planner and their settings; the defaults if not given.

    Raises:
        InputError: a part cannot be made, or the planner named an object that is not in sight.
        PlannerError, PartError, GraspPlannerError: a part crashed, or its answer cannot be used.
    """
    planner = planner or make_planner("dg-select")
    look = _pipeline(frame, robot, stages).look(
        frame.observation,
        None if volume is None else EpisodeState(volume),
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
    stages: PipelineSpec | None = None,
) -> None:
    """Use every kernel that `decide_frame` may need once, on a made-up scene: then none is compiled in it."""
    rehearse_planner(planner, rehearse_look(_pipeline(frame, robot, stages)).context)


def _pipeline(frame: Frame, robot: RobotDescription | str | None, stages: PipelineSpec | None) -> Pipeline:
    description = load_robot(robot) if isinstance(robot, str) else robot
    who = load_robot(DEFAULT_ROBOT).gripper if description is None else description
    workspace = _workspace(frame, with_robot=description is not None)
    return build_pipeline(stages or PipelineSpec(), who, workspace, occlusion=_ANY_DISTANCE)


def _workspace(frame: Frame, *, with_robot: bool) -> Workspace:
    """The frame's support surface as the table; with a robot the workspace's own, if that is what is seen."""
    own = replace(load_workspace(), grid=frame.grid)
    if with_robot and abs(frame.support_z_m - own.support_z_m) < _SAME_TABLE_M:
        return own
    # A workspace has a bin; here it is out of everything's way.
    nowhere = replace(load_workspace().bin, center=(0.0, 0.0, -100.0))
    low, high = frame.grid.origin, frame.grid.upper
    (x, y, _), (dx, dy, _) = (0.5 * (high + low)).tolist(), (high - low).tolist()
    table = Box("table", (x, y, frame.support_z_m - 0.05), (dx + 0.4, dy + 0.4, 0.10))
    return replace(load_workspace(), table=table, bin=nowhere, grid=frame.grid)
