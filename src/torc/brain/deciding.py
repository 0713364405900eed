"""Decide which object to pick next in a frame."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from torc.brain.answer import Answer, Sought
from torc.drawing.label_places import mask_anchor
from torc.errors import InputError
from torc.perception.protocol import Depth, Perception, Wanted
from torc.perception.segmentation import PerceptionConfig
from torc.pipeline.building import build_pipeline
from torc.pipeline.frames import Frame
from torc.pipeline.look import Pipeline
from torc.pipeline.planners import as_planner
from torc.pipeline.state import EpisodeState, stage_rng
from torc.pipeline.warm_up import announced_compilation, rehearse_look
from torc.records import Capture, Observation, OcclusionVolume, SegmentedScene
from torc.registry.kinds import DEPTHS, PERCEPTIONS
from torc.robots.description import RobotDescription
from torc.robots.loading import load_robot
from torc.robots.names import DEFAULT_ROBOT
from torc.specs.conditions import PipelineSpec
from torc.task_planning.protocol import TaskPlanner, ask_planner, rehearse_planner
from torc.vlm.find_target import TargetByText
from torc.vlm.protocol import VlmClient
from torc.workspace.description import Box, Workspace
from torc.workspace.workspace_files import load_workspace

# Frames come from any distance: the volume accepts every reading that perception accepts.
_ANY_DISTANCE_M = PerceptionConfig().max_depth_m
_OWN_EYES = "embedded"
_SAME_TABLE_M = 0.02
"""A support within this distance of the robot's table height is that table."""


def decide_frame(
    frame: Frame,
    planner: TaskPlanner | str | Callable[[], TaskPlanner] = "dg-select",
    *,
    robot: RobotDescription | str | None = None,
    volume: OcclusionVolume | None = None,
    seed: int = 0,
    stages: PipelineSpec | None = None,
    wanted: Wanted | None = None,
    finder: VlmClient | None = None,
) -> Answer:
    """Decide which object to pick next in a frame. The first call compiles kernels, and says so on stderr.

    Args:
        frame: the picture, its depth, and masks if it has any.
        planner: a task planner's name, a planner, or its class.
        robot: the robot whose reach counts (a description, or its name or path); None checks only the gripper (a
            Robotiq 2F-85) and takes every pose as reachable.
        volume: the occlusion volume after the previous frame; None for the first frame.
        seed: decides all random draws.
        stages: depth, perception, grasp planner and their settings; the defaults if not given. For a frame without
            masks the default perception is torc's own eyes.
        wanted: the target, for a frame without masks; the frame's description by default.
        finder: a model that looks for the target by its description, in a frame without masks.

    Raises:
        InputError: a part cannot be made, the planner named an object that is not in sight, or a robot should work
            in a frame whose camera pose was estimated.
        PlannerError, PartError, GraspPlannerError: a part crashed, or its answer cannot be used.
    """
    decider = FrameDecider(frame, planner, robot=robot, stages=stages)
    return decider.decide(volume=volume, seed=seed, wanted=wanted, finder=finder)


class FrameDecider:
    """The parts that decide for a frame. `decide_frame` explains the arguments."""

    def __init__(
        self,
        frame: Frame,
        planner: TaskPlanner | str | Callable[[], TaskPlanner] = "dg-select",
        *,
        robot: RobotDescription | str | None = None,
        stages: PipelineSpec | None = None,
    ) -> None:
        self.frame, self.stages = frame, stages or PipelineSpec()
        self.planner = as_planner(planner)
        self.pipeline = _pipeline(frame, robot, self.stages)

    def rehearse(self) -> None:
        """Run every kernel that `decide` may need once, on a made-up scene, so that no decision compiles any."""
        rehearse_planner(self.planner, rehearse_look(self.pipeline).context)

    def decide(
        self,
        *,
        volume: OcclusionVolume | None = None,
        seed: int = 0,
        wanted: Wanted | None = None,
        finder: VlmClient | None = None,
    ) -> Answer:
        """Decide. Raises what `decide_frame` raises."""
        frame, planner, pipeline = self.frame, self.planner, self.pipeline
        # Objects that perception finds are numbered by perception.
        given = frame.labels if PERCEPTIONS.traits(pipeline.perception).needs_labels else {}
        wanted = wanted or Wanted(frame.target_description)
        marked = wanted if given else _marked(frame, wanted)
        sought = Sought.LABEL if given else _sought(marked, pipeline.perception, finder)
        if finder is not None:
            pipeline = replace(pipeline, perception=TargetByText(pipeline.perception, finder))
        before = None if volume is None else EpisodeState(volume)
        with announced_compilation():
            look = pipeline.look(frame.capture, before, wanted=marked, seed=seed, labels=given)
            scene = look.context.scene
            if not given:
                _check_found(scene, wanted)
            decision = ask_planner(planner, look.context, stage_rng(seed, 0, "decide"))
        if decision.object_id is not None and decision.object_id not in look.context.scene.ids:
            raise InputError(
                f"Task planner '{planner.name}' named object {decision.object_id}, which is not in sight; "
                f"{', '.join(map(str, look.context.scene.ids))} are."
            )
        return Answer(
            decision,
            look,
            labels=given or {k: k for k in scene.ids},
            names=frame.names if given else {},
            eyes=eyes_of(frame.capture, self.stages),
            sought=sought,
            pose_estimated=frame.pose_estimated,
            warnings=(*frame.warnings, *size_doubts(scene)),
        )


def _marked(frame: Frame, wanted: Wanted) -> Wanted:
    """Return the target for a perception that finds the objects itself: from the masks if nothing else shows it."""
    truth = frame.label_image
    if truth is None or frame.target_id is None or wanted.mark or wanted.pictures:
        return wanted
    row, col = mask_anchor(truth == frame.target_id)
    return replace(wanted, mark=(col, row))


def _sought(wanted: Wanted, perception: Perception, finder: VlmClient | None) -> Sought:
    """Return how a perception that finds the objects itself knows the target."""
    if wanted.mark:
        return Sought.MARK
    if wanted.pictures:
        return Sought.PICTURES
    words = finder is not None or PERCEPTIONS.traits(perception).reads_words
    return Sought.WORDS if wanted.description and words else Sought.NOTHING


def _check_found(scene: SegmentedScene, wanted: Wanted) -> None:
    """Raise InputError if nothing was found at all, or nothing at the mark."""
    if not scene.objects:
        raise InputError(f"No object was found in the picture: {_readings(scene.observation)}")
    if wanted.mark and scene.target_id is None:
        raise InputError(
            f"No object was found at the mark {','.join(map(str, wanted.mark))}. Leave the mark out and give --out "
            "DIR: DIR/seen.png shows the objects that were found."
        )


def _readings(observation: Observation) -> str:
    """Say what may be wrong with a picture in which nothing was found."""
    read = observation.depth_m > 0
    if not read.any():
        return "no pixel has a reading of depth. With --depth sgbm: are the pictures left and right, in this order?"
    median_m = np.median(observation.depth_m[read])
    return (
        f"{read.mean():.0%} of the pixels have a reading of depth, in the median {median_m:.2f} m. "
        "Check the depth's unit, and whether something stands within the watched region."
    )


def _pipeline(frame: Frame, robot: RobotDescription | str | None, stages: PipelineSpec) -> Pipeline:
    if robot is not None and frame.pose_estimated:
        raise InputError(
            "A robot's reach counts only where the camera's pose in the robot's base frame is known, and this frame's "
            "pose was estimated from the picture. Store T_world_camera in the frame, or leave the robot (--robot) out."
        )
    description = load_robot(robot) if isinstance(robot, str) else robot
    who = load_robot(DEFAULT_ROBOT).gripper if description is None else description
    workspace = workspace_of(frame, with_robot=description is not None)
    used = replace(stages, perception=eyes_of(frame.capture, stages))
    # Masks may come with depth of any kind; a frame without masks comes from a camera.
    rough = frame.label_image is None
    pipeline = build_pipeline(used, who, workspace, rough=rough, max_depth_m=_ANY_DISTANCE_M)
    refuse_made_up(used, pipeline.depth)
    return pipeline


def refuse_made_up(stages: PipelineSpec, depth: Depth) -> None:
    """Raise InputError for a depth stage that adds a camera's errors: real pictures already have them."""
    if DEPTHS.traits(depth).simulated_only:
        raise InputError(
            f"--depth {stages.depth} adds a camera's errors to the exact depth of a simulation. A real picture has "
            "them already: leave --depth out."
        )


def eyes_of(seen: Capture, stages: PipelineSpec) -> str:
    """Return the chosen perception, or torc's own where the default one cannot read a picture without masks."""
    asked = stages.perception
    blind = seen.label_image is None and asked == PipelineSpec().perception
    return _OWN_EYES if blind else asked


def workspace_of(frame: Frame, *, with_robot: bool = False) -> Workspace:
    """Return a workspace whose table is the frame's support; with a robot, the robot's workspace if it fits the
    support.
    """
    own = replace(load_workspace(), grid=frame.grid)
    if with_robot and abs(frame.support_z_m - own.support_z_m) < _SAME_TABLE_M:
        return own
    # A workspace must have a bin; this one is out of the way.
    nowhere = replace(load_workspace().bin, center=(0.0, 0.0, -100.0))
    low, high = frame.grid.origin, frame.grid.upper
    (x, y, _), (dx, dy, _) = (0.5 * (high + low)).tolist(), (high - low).tolist()
    table = Box("table", (x, y, frame.support_z_m - 0.05), (dx + 0.4, dy + 0.4, 0.10))
    return replace(load_workspace(), table=table, bin=nowhere, grid=frame.grid)


_LARGEST_M, _SMALLEST_M = 0.33, 0.015
"""Limits of the median length of things on a table, metres: twice the largest median of the shipped problems (theirs
are .07 to .16 m), and a fifth of the smallest, since much of a thing may be out of sight.
"""
_USUAL_M = 0.12
_FACTORS = (4, 5, 10, 1000)
_FEWEST = 3


def size_doubts(scene: SegmentedScene) -> tuple[str, ...]:
    """Return a message if most things in sight are far too large or too small to be picked by hand."""
    sizes = [_length_m(o.points) for o in scene.objects if len(o.points) > 20]
    if len(sizes) < _FEWEST:
        return ()
    median = float(np.median(sizes))
    if _SMALLEST_M < median < _LARGEST_M:
        return ()
    large = median > _LARGEST_M
    fit = sorted(_FACTORS, key=lambda f: abs(np.log((median / f if large else median * f) / _USUAL_M)))[:2]
    bound, how = ("over", "smaller") if large else ("under", "larger")
    factors = " or ".join(map(str, sorted(fit)))
    return (
        f"Half of the objects seem to be {bound} {100 * median:.1f} cm long. The depth's unit is probably wrong: they "
        f"would be of usual size with a depth_scale {how} by a factor of {factors}.",
    )


def _length_m(points: np.ndarray) -> float:
    """Return the longer side of the visible part of a thing, metres."""
    low, high = np.percentile(points, [5, 95], axis=0)
    return float((high - low).max())
