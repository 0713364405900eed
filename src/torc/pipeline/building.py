"""The one place where the parts around a task planner are made from their conditions."""

from dataclasses import dataclass, replace
from pkgutil import resolve_name
from typing import Any

from torc.errors import InputError, UnknownNameError
from torc.fingerprints import part_source
from torc.motion.config import MotionConfig
from torc.motion.protocol import MotionPlanner
from torc.occlusion.volume import FIXED_CAMERA, FIXED_REAL_CAMERA, OcclusionConfig
from torc.perception.noise import NoiseConfig, stereo_camera
from torc.perception.protocol import Depth, Perception
from torc.pipeline.better_bet import BetConfig
from torc.pipeline.failures import FailureConfig
from torc.pipeline.look import Pipeline
from torc.plugins import load_part, make_part
from torc.robots.description import RobotDescription
from torc.robots.gripper import GripperDescription
from torc.robots.loading import load_robot, own_source
from torc.specs.conditions import Conditions, PipelineSpec
from torc.specs.settings import arguments, changed, config_class, under
from torc.stages import CONFIGURED, STAGES
from torc.workspace.description import Workspace
from torc.workspace.files import load_workspace, own_workspace_source


@dataclass(frozen=True)
class System:
    """The parts around a task planner, but for the camera and the robot's hardware, and what they were made from."""

    conditions: Conditions
    robot: RobotDescription
    workspace: Workspace
    pipeline: Pipeline
    motion_planner: MotionPlanner


def build_system(
    conditions: Conditions, workspace: Workspace | None = None, robot: RobotDescription | None = None
) -> System:
    """All parts, made from their conditions; `workspace` and `robot` take the place of those that they name.

    Raises InputError for a part that is unknown or cannot be made, and for a setting that it has not.
    """
    robot = load_robot(conditions.robot) if robot is None else robot
    workspace = load_workspace(conditions.workspace) if workspace is None else workspace
    motion_planner = make_stage(conditions, "motion", robot=robot, workspace=workspace)
    pipeline = build_pipeline(conditions, robot, workspace, noisy=conditions.noise)
    config = getattr(motion_planner, "config", None)
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
    """The parts between camera and task planner; for a gripper alone every pose counts as reachable. `noisy` adds the
    noise of a stereo camera, and expects it; `rough` expects depth with a sensor's errors; `max_depth_m` is how far the
    occlusion volume believes readings. Raises as `build_system`.
    """
    check_settings(stages, noisy)
    seeing = build_seeing(stages, workspace, noisy=noisy, rough=rough)
    occlusion = seeing.occlusion
    if max_depth_m is not None:
        occlusion = replace(occlusion, max_depth_m=max_depth_m)
    gripper = robot.gripper if isinstance(robot, RobotDescription) else robot
    support_z_m = workspace.support_z_m
    return Pipeline(
        perception=seeing.perception,
        depth=seeing.depth,
        grasp_planner=make_stage(
            stages,
            "grasps",
            rough=seeing.rough,
            gripper=gripper,
            support_z_m=support_z_m,
            workspace=workspace,
        ),
        robot=robot,
        workspace=workspace,
        noise=seeing.noise,
        occlusion=occlusion,
        failures=configured(stages, "failures", FailureConfig()),
        bets=configured(stages, "bets", BetConfig()),
        min_score=stages.min_score,
    )


@dataclass(frozen=True)
class SeeingParts:
    """What turns a snapshot into a segmented scene and an occlusion volume; as in `Pipeline`. `rough`: depth has a
    sensor's errors.
    """

    perception: Perception
    depth: Depth
    noise: NoiseConfig | None
    occlusion: OcclusionConfig
    rough: bool


def build_seeing(
    stages: PipelineSpec, workspace: Workspace, *, noisy: bool = False, rough: bool = False
) -> SeeingParts:
    """The part of a pipeline that sees. As `build_pipeline`."""
    depth = make_stage(stages, "depth", workspace=workspace)
    rough = rough or noisy or getattr(depth, "rough", False)
    return SeeingParts(
        perception=make_stage(stages, "perception", rough=rough, workspace=workspace),
        depth=depth,
        noise=configured(stages, "noise", stereo_camera()) if noisy else None,
        occlusion=configured(stages, "occlusion", FIXED_REAL_CAMERA if rough else FIXED_CAMERA),
        rough=rough,
    )


def make_stage(stages: PipelineSpec, stage: str, *, rough: bool = False, **offered: Any) -> Any:
    """The part of a stage, see `torc.stages.STAGES`; what is `offered` goes to a part that has parameters of these
    names. If its configuration has a class method `rough`, that makes it where depth has a sensor's errors.
    """
    kind, name = STAGES[stage], getattr(stages, stage)
    settings, part = under(stages.settings, stage), load_part(kind, name)
    rough_config = getattr(config_class(part), "rough", None) if rough else None
    default = None if rough_config is None else rough_config()
    return make_part(kind, name, arguments(part, settings, stage, default), offered)


def configured(stages: PipelineSpec, stage: str, default: Any) -> Any:
    """A configuration with the settings of a stage. Raises InputError."""
    return changed(default, under(stages.settings, stage), stage)


def check_settings(stages: PipelineSpec, noisy: bool) -> None:
    """Raises InputError for settings of what there is not, or of what is not used."""
    known = [*STAGES, *CONFIGURED]
    for path in stages.settings:
        stage, dot, _ = path.partition(".")
        if stage not in known or not dot:
            raise UnknownNameError("stage in the setting", path, [f"{s}." for s in known])
    if not noisy and under(stages.settings, "noise"):
        raise InputError("There are settings of the noise, but no noise: add --noise.")


def sources(conditions: Conditions) -> dict[str, str]:
    """Fingerprints of what does not come with torc, by field of the conditions. Raises InputError for unknown parts."""
    found = {"robot": own_source(conditions.robot), "workspace": own_workspace_source(conditions.workspace)}
    for stage, kind in STAGES.items():
        if (name := getattr(conditions, stage)) not in kind.built_in:
            part = load_part(kind, name)
            found[stage] = "" if kind.ships(name) else part_source(part)
    return {name: source for name, source in found.items() if source}


def stage_configs() -> dict[str, Any]:
    """The configuration of each shipped stage, as it is without settings; that of its default part, if it can be
    exchanged.
    """
    found: dict[str, Any] = {}
    for stage, kind in STAGES.items():
        config = config_class(load_part(kind, next(iter(kind.built_in))))
        if config is not None:
            found[stage] = config()
    for stage, path in CONFIGURED.items():
        value = resolve_name(path)
        found[stage] = value() if callable(value) else value
    return found
