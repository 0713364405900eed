"""What perception finds in one camera snapshot, or why it finds nothing; how well, where the true masks are known."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Int16

from torc.brain.deciding import eyes_of, refuse_made_up, workspace_of
from torc.errors import InputError
from torc.perception.checked_scenes import ask_depth, ask_perception
from torc.perception.protocol import Wanted
from torc.perception.scoring import MaskScore, score_masks
from torc.pipeline.building import check_settings, make_stage
from torc.pipeline.frames import frame_of
from torc.pipeline.frames.annotated import AnnotatedPicture
from torc.pipeline.frames.level import level_pose
from torc.pipeline.frames.plausibility import clean_depth
from torc.records import BACKGROUND, Capture, Observation, SegmentedScene, as_capture
from torc.registry.context import BuildContext
from torc.registry.kinds import PERCEPTIONS
from torc.specs.conditions import PipelineSpec


@dataclass(frozen=True)
class Sight:
    """A snapshot, and what was found in it.

    Attributes:
        observation: the snapshot, with the depth of the depth stage.
        scene: the objects; None if `trouble` says why there are none.
        support_z_m: height of the support in the world, metres; None if none was seen.
        trouble: why nothing was found; empty otherwise.
        placed: True if the camera's pose is known.
    """

    observation: Observation
    scene: SegmentedScene | None
    support_z_m: float | None
    trouble: str = ""
    placed: bool = True

    def facts(self) -> dict[str, str]:
        """Return lines to print about the snapshot, by name."""
        o, read = self.observation, self.observation.depth_m > 0
        height, width = read.shape
        facts = {"picture": f"{width}x{height} pixels, fx {o.K[0, 0]:.1f}, fy {o.K[1, 1]:.1f}"}
        if read.any():
            median_m = float(np.median(o.depth_m[read]))
            facts["depth"] = f"at {read.mean():.0%} of the pixels, median {median_m:.3f} m"
        else:
            facts["depth"] = "none"
        x, y, z = o.T_world_camera[:3, 3]
        if not self.placed:
            facts["camera"] = "its pose is not known"
        elif o.pose_estimated:
            facts["camera"] = (
                f"{z:.3f} m above the support (estimated; its place in a robot's world is not known)"
            )
        else:
            facts["camera"] = f"at ({x:.3f}, {y:.3f}, {z:.3f}) m in the world"
        if self.support_z_m is not None and not o.pose_estimated:
            facts["support"] = f"at z = {self.support_z_m:.3f} m"
        if self.scene is not None:
            count = len(self.scene.objects)
            facts["objects"] = str(count or "none that rises from the support within the watched region")
        if self.trouble:
            facts["no masks"] = self.trouble
        return facts


def measured(observation: Observation, stages: PipelineSpec) -> Observation:
    """Return the snapshot with the depth of the depth stage, 0 where there is no reading.

    Raises:
        InputError: the snapshot has no depth, or impossible depth.
    """
    check_settings(stages, noisy=False)
    depth = make_stage(stages, "depth")
    refuse_made_up(stages, depth)
    found = ask_depth(depth, observation)
    if found.pair is not None and not (found.depth_m > 0).any():
        raise InputError("The snapshot has no depth, but a stereo pair: add --depth sgbm.")
    return replace(found, depth_m=clean_depth("The snapshot", found.depth_m))


def see(seen: Observation | Capture, stages: PipelineSpec) -> Sight:
    """Find the objects in a snapshot. A picture without a support or without objects is not an error.

    Args:
        seen: the snapshot.
        stages: name depth and perception; for a snapshot without labels the default perception is torc's own.

    Raises:
        InputError, PartError: a part cannot be made, or crashes.
    """
    capture = as_capture(seen)
    observation = measured(capture.observation, stages)
    try:
        frame = frame_of(observation)
    except InputError as error:
        return Sight(observation, None, None, str(error))
    context = BuildContext(workspace=workspace_of(frame))
    part = make_stage(replace(stages, perception=eyes_of(capture, stages)), "perception", context, rough=True)
    return Sight(
        observation,
        ask_perception(part, replace(capture, observation=observation), Wanted(""), None),
        frame.support_z_m,
    )


@dataclass(frozen=True)
class Judged:
    """The objects found in a picture (labels from 0, BACKGROUND for none), and how well they agree with the truth."""

    found: Int16[np.ndarray, "h w"]
    score: MaskScore


def judge(picture: AnnotatedPicture, stages: PipelineSpec) -> Judged:
    """Compare what a perception finds in a picture with the truth.

    Raises:
        InputError: the picture shows no support or nothing on it, or the perception is given the true masks.
    """
    observation = measured(picture.observation, stages)
    if not picture.posed:
        observation = replace(observation, T_world_camera=level_pose(observation), pose_estimated=True)
    context = BuildContext(workspace=workspace_of(frame_of(observation, picture.name)))
    perception = make_stage(stages, "perception", context, rough=True)
    if PERCEPTIONS.traits(perception).needs_labels:
        raise InputError(
            f"--perception {stages.perception} is given the masks: there is nothing to evaluate."
        )
    scene = ask_perception(perception, Capture(observation), Wanted(""), None)
    found = np.where(scene.label_image >= 0, scene.label_image, np.int16(BACKGROUND)).astype(np.int16)
    return Judged(found, score_masks(found, picture.truth))
