"""How well a perception segments pictures whose true masks are known."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Int16

from torc.brain.deciding import workspace_of
from torc.brain.seeing import measured
from torc.errors import InputError
from torc.perception.checked_scenes import ask_perception
from torc.perception.protocol import Wanted
from torc.perception.scoring import MaskScore, score_masks
from torc.pipeline.building import make_stage
from torc.pipeline.frames import frame_of
from torc.pipeline.frames.annotated import AnnotatedPicture
from torc.pipeline.frames.level import level_pose
from torc.records import BACKGROUND, Capture
from torc.registry.context import BuildContext
from torc.registry.kinds import PERCEPTIONS
from torc.specs.conditions import PipelineSpec


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
