"""Perception from given labels: a simulator's truth or an annotated data set."""

import numpy as np
from jaxtyping import Int16

from torc.errors import InputError
from torc.perception.protocol import Wanted
from torc.perception.segmentation import PerceptionConfig, segment
from torc.records import Observation, SegmentedScene
from torc.registry.kinds import PerceptionTraits


class LabelPerception(PerceptionTraits):
    """Takes the masks from a given label image (the paper's privileged perception)."""

    needs_labels = True

    def __init__(self, config: PerceptionConfig | None = None) -> None:
        self.config = PerceptionConfig() if config is None else config

    def perceive(
        self,
        observation: Observation,
        wanted: Wanted | None = None,
        before: SegmentedScene | None = None,
        label_image: Int16[np.ndarray, "h w"] | None = None,
    ) -> SegmentedScene:
        """Return the objects under the labels, whatever is wanted. Raises InputError without labels."""
        if label_image is None:
            raise InputError(
                "This snapshot has no label image. Give one (object id per pixel, -1 for the background), or use a "
                "perception that finds the masks itself."
            )
        return segment(observation, label_image, self.config)
