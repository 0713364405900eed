"""What torc makes of masks for anybody who finds some."""

from dataclasses import replace

import numpy as np

from torc.perception.from_masks import FromMasks, Masks
from torc.perception.protocol import Wanted
from torc.pipeline.building import make_stage
from torc.specs.conditions import PipelineSpec
from torc.testing.contexts import box
from torc.testing.perception_conformance import check_perception
from torc.testing.synthetic import synthetic_observation


class Halves(FromMasks):
    """One mask per half of the picture, of what is not far away: no more is needed for a perception of one's own."""

    def find(self, observation, wanted):
        near = (observation.depth_m > 0) & (observation.depth_m < 0.75)
        right = np.arange(near.shape[1]) >= near.shape[1] // 2
        label = np.where(near, right.astype(np.int16), np.int16(-1))
        return Masks(label, np.array([0.5, 0.6], np.float32))


def test_masks_are_enough_for_a_perception():
    check_perception(Halves)


def test_one_of_ones_own_is_made_by_its_name_with_its_settings():
    spec = PipelineSpec(perception=f"{__name__}:Halves", settings={"perception.clouds.min_pixels": 99})
    part = make_stage(spec, "perception", rough=True)
    assert part.config.clouds.min_pixels == 99
    assert part.config.clouds.edge_slope == 4.0
    observation = replace(
        synthetic_observation((box(1, 0.55, -0.20, (0.1, 0.1, 0.2)), box(2, 0.55, 0.0, (0.1, 0.1, 0.2)))),
        label_image=None,
    )
    scene = part.perceive(observation, Wanted("the left half"), None)
    assert len(scene.objects) == 2
    assert scene.target_id is None
    assert sorted(k.sureness for k in scene.known) == [np.float32(0.5), np.float32(0.6)]
