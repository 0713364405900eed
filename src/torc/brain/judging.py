"""How well a perception segments pictures whose true masks are known."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Int16

from torc.brain.seeing import measured
from torc.errors import InputError
from torc.perception.asking import ask_perception
from torc.perception.protocol import Wanted
from torc.perception.scoring import MaskScore, score_masks
from torc.pipeline.building import make_stage
from torc.pipeline.frames.annotated import AnnotatedPicture
from torc.pipeline.frames.level import level_pose
from torc.pipeline.frames.support_plane import estimate_support_z_m, grid_around, standing_points
from torc.records import BACKGROUND
from torc.specs.conditions import PipelineSpec
from torc.workspace.description import Workspace
from torc.workspace.files import load_workspace


@dataclass(frozen=True)
class Judged:
    """What was found in a picture: labels from 0 on, BACKGROUND for none; and how well that agrees."""

    found: Int16[np.ndarray, "h w"]
    score: MaskScore


def judge(picture: AnnotatedPicture, stages: PipelineSpec) -> Judged:
    """Compares what a perception finds in a picture with the truth. Raises InputError if the picture shows no support,
    or nothing on it, and for a perception that is given the masks.
    """
    observation = measured(picture.observation, stages)
    if not picture.posed:
        observation = replace(observation, T_world_camera=level_pose(observation))
    support_z_m = estimate_support_z_m(observation) if picture.posed else 0.0
    points = standing_points(observation, support_z_m)
    if len(points) == 0:
        raise InputError(
            f"{picture.name}: nothing stands on the support, which seems to be at z = {support_z_m:.3f} m."
        )
    own = load_workspace()
    table = replace(own.table, center=(0.0, 0.0, support_z_m - own.table.size[2] / 2))
    workspace: Workspace = replace(own, table=table, grid=grid_around(points, support_z_m))
    perception = make_stage(stages, "perception", rough=True, workspace=workspace)
    if getattr(perception, "needs_labels", False):
        raise InputError(
            f"--perception {stages.perception} is given the masks: there is nothing to evaluate."
        )
    scene = ask_perception(perception, observation, Wanted(""), None)
    found = np.where(scene.label_image >= 0, scene.label_image, np.int16(BACKGROUND)).astype(np.int16)
    return Judged(found, score_masks(found, picture.truth))
