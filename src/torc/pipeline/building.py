"""Build the parts around a task planner from their conditions."""

from dataclasses import dataclass, replace
from pkgutil import resolve_name
from typing import Any

from torc.errors import InputError
from torc.io.digests import part_source
from torc.motion.config import MotionConfig
from torc.motion.protocol import MotionPlanner
from torc.occlusion.volume import FIXED_CAMERA, FIXED_REAL_CAMERA
from torc.perception.noise import stereo_camera
from torc.pipeline.better_bet import BetConfig
from torc.pipeline.failures import FailureConfig
from torc.pipeline.look import Pipeline
from torc.registry.context import BuildContext
from torc.registry.kinds import CONFIGURED, DEPTHS, MOTION_PLANNERS, STAGES
from torc.registry.loading import is_shipped, load_part, make_part
from torc.registry.settings import arguments, changed, config_class, under
from torc.robots.description import RobotDescription
from torc.robots.gripper import GripperDescription
from torc.robots.loading import load_robot, own_source
from torc.specs.conditions import Conditions, PipelineSpec
from torc.workspace.description import Workspace
from torc.workspace.workspace_files import load_workspace, own_workspace_source


@dataclass(frozen=True)
class System:
    """The parts around a task planner, except the camera and the robot's hardware, and what they were built from."""

    conditions: Conditions
    robot: RobotDescription
    workspace: Workspace
    pipeline: Pipeline
    motion_planner: MotionPlanner


def build_system(
    conditions: Conditions, workspace: Workspace | None = None, robot: RobotDescription | None = None
) -> System:
    """Build all parts from their conditions; `workspace` and `robot` replace those that these name.

    Raises InputError if a part is unknown or cannot be built, or a setting does not exist.
    """
    robot = load_robot(conditions.robot) if robot is None else robot
    workspace = load_workspace(conditions.workspace) if workspace is None else workspace
    motion_planner = make_stage(conditions, "motion", BuildContext(robot=robot, workspace=workspace))
    pipeline = build_pipeline(conditions, robot, workspace, noisy=conditions.noise)
    config = MOTION_PLANNERS.traits(motion_planner).config
    if isinstance(config, MotionConfig):
        pipeline = replace(pipeline, motion=config)
    return System(conditions, robot, workspace, pipeline, motion_planner)


def build_pipeline(
    stages: PipelineSpec,
    robot: RobotDescription | GripperDescription,
    workspace: Workspace,
    *,
    noisy: bool = False,
    rough: bool = False,
    max_depth_m: float | None = None,
) -> Pipeline:
    """Build the parts between camera and task planner. Raises as `build_system`.

    For a gripper alone every pose counts as reachable. `noisy` adds the noise of a stereo camera, and expects it;
    `rough` expects depth with a sensor's errors. The occlusion volume trusts readings up to `max_depth_m`.
    """
    check_settings(stages, noisy)
    gripper = robot.gripper if isinstance(robot, RobotDescription) else robot
    context = BuildContext(gripper=gripper, support_z_m=workspace.support_z_m, workspace=workspace)
    depth = make_stage(stages, "depth", context)
    rough = rough or noisy or DEPTHS.traits(depth).rough
    occlusion = configured(stages, "occlusion", FIXED_REAL_CAMERA if rough else FIXED_CAMERA)
    if max_depth_m is not None:
        occlusion = replace(occlusion, max_depth_m=max_depth_m)
    return Pipeline(
        perception=make_stage(stages, "perception", context, rough=rough),
        depth=depth,
        grasp_planner=make_stage(stages, "grasps", context, rough=rough),
        robot=robot,
        workspace=workspace,
        noise=configured(stages, "noise", stereo_camera()) if noisy else None,
        occlusion=occlusion,
        failures=configured(stages, "failures", FailureConfig()),
        bets=configured(stages, "bets", BetConfig()),
        min_score=stages.min_score,
    )


def make_stage(
    stages: PipelineSpec, stage: str, context: BuildContext | None = None, *, rough: bool = False
) -> Any:
    """Build the part of a stage of `STAGES`. Raises as `make_part`."""
    return make_part(
        STAGES[stage], getattr(stages, stage), under(stages.settings, stage), context, rough=rough
    )


def configured(stages: PipelineSpec, stage: str, default: Any) -> Any:
    """Return `default` with the settings of a stage. Raises InputError if a setting cannot be used."""
    return changed(default, under(stages.settings, stage), stage)


def check_settings(stages: PipelineSpec, noisy: bool) -> None:
    """Raise UnknownNameError for a setting that its stage does not have, InputError for one that is not used.

    Loads only the parts that have settings.
    """
    if not noisy and under(stages.settings, "noise"):
        raise InputError("There are settings of the noise, but no noise: add --noise.")
    for stage in dict.fromkeys(path.partition(".")[0] for path in stages.settings):
        settings = under(stages.settings, stage)
        if stage in STAGES:
            arguments(load_part(STAGES[stage], getattr(stages, stage)), settings, stage)
        else:
            changed(default_config(stage), settings, stage)


def sources(conditions: Conditions) -> dict[str, str]:
    """Return fingerprints of the parts that do not come with torc, by field of the conditions.

    Raises InputError for unknown parts.
    """
    found = {"robot": own_source(conditions.robot), "workspace": own_workspace_source(conditions.workspace)}
    for stage, kind in STAGES.items():
        if not is_shipped(kind, name := getattr(conditions, stage)):
            found[stage] = part_source(load_part(kind, name))
    return {name: source for name, source in found.items() if source}


def default_config(stage: str) -> Any:
    """Return the default configuration of a stage; for an exchangeable stage, that of its default part.

    None if the part has no configuration.
    """
    if stage in STAGES:
        config = config_class(load_part(STAGES[stage], getattr(Conditions(), stage)))
        return None if config is None else config()
    value = resolve_name(CONFIGURED[stage])
    return value() if callable(value) else value
