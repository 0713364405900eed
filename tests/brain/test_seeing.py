"""What is found in a snapshot, and what is told of it."""

from dataclasses import replace

import numpy as np
import pytest

from torc.brain.seeing import measured, see
from torc.errors import InputError
from torc.perception.stereo import made_up_pair
from torc.specs.conditions import PipelineSpec
from torc.testing.contexts import box
from torc.testing.synthetic import synthetic_observation

SEEN = synthetic_observation((box(0, 0.62, 0.0, (0.06, 0.06, 0.1)), box(1, 0.6, -0.2, (0.05, 0.05, 0.12))))
EYES = PipelineSpec(perception="embedded")


def test_objects_and_support_are_found():
    sight = see(SEEN, EYES)
    assert len(sight.scene.objects) == 2
    assert sight.support_z_m == pytest.approx(1.05, abs=0.002)
    facts = sight.facts()
    assert facts["objects"] == "2"
    assert facts["support"] == "at z = 1.050 m"
    assert facts["camera"].startswith("at (")
    assert "trouble" not in facts


def test_torcs_own_network_is_the_default_since_a_snapshot_has_no_labels():
    default, own = see(SEEN, PipelineSpec()).scene, see(SEEN, EYES).scene
    np.testing.assert_array_equal(default.label_image, own.label_image)


def test_an_estimated_pose_is_told():
    low = SEEN.T_world_camera.copy()
    low[2, 3] -= 1.05
    sight = see(replace(SEEN, T_world_camera=low, pose_estimated=True), EYES)
    assert "0.330 m above the support (estimated" in sight.facts()["camera"]
    assert "support" not in sight.facts()


def test_trouble_is_told_not_raised():
    sight = see(synthetic_observation(()), EYES)
    assert sight.scene is None
    assert "nothing stands on the support" in sight.facts()["no masks"]


def test_a_picture_in_which_no_mask_was_found_says_so():
    sight = see(SEEN, EYES)
    assert replace(sight, scene=replace(sight.scene, objects=())).facts()["objects"].startswith("none")


def test_depth_is_cleaned_and_made_of_a_pair():
    holes = SEEN.depth_m.copy()
    holes[:9] = np.nan
    assert (measured(replace(SEEN, depth_m=holes), EYES).depth_m[:9] == 0).all()
    pair = made_up_pair(SEEN.depth_m, float(SEEN.K[0, 0]))
    blind = replace(SEEN, depth_m=0 * SEEN.depth_m, pair=pair)
    assert (measured(blind, PipelineSpec(depth="sgbm")).depth_m > 0).mean() > 0.5
    with pytest.raises(InputError, match="add --depth sgbm"):
        measured(blind, EYES)
    with pytest.raises(InputError, match="depth is empty"):
        measured(replace(blind, pair=None), EYES)
