"""What is always there is no object."""

from dataclasses import replace

import numpy as np
import pytest

from torc.perception.from_masks import FromMasks, Masks, without_fixed
from torc.perception.protocol import Wanted
from torc.perception.segmentation import PerceptionConfig
from torc.testing.contexts import box
from torc.testing.synthetic import synthetic_capture
from torc.workspace.description import Box
from torc.workspace.workspace_files import load_workspace

PAPER = load_workspace()
WALL = box(1, 0.70, 0.0, (0.02, 0.5, 0.2))
BOOK = box(2, 0.68, 0.1, (0.02, 0.1, 0.15))
"""It leans against the wall, flat."""
CAPTURE = synthetic_capture((WALL, BOOK))
SEEN, TRUE = CAPTURE.observation, CAPTURE.label_image


def walled(x_m: float = 0.0):
    """The workspace that knows of the wall, or has it that much farther off."""
    middle = PAPER.support_z_m + WALL.size[2] / 2
    return replace(PAPER, obstacles=(Box("wall", (0.70 + x_m, 0.0, middle), WALL.size),))


def kept(workspace, observation=SEEN) -> set[int]:
    label = without_fixed(TRUE, observation, workspace, PerceptionConfig())
    assert set(np.unique(label[label != TRUE])) <= {-1}
    return set(np.unique(label[label >= 0]).tolist())


def test_a_wall_is_no_object_and_what_leans_against_it_is_one():
    assert kept(PAPER) == {1, 2}
    assert kept(walled()) == {2}


def test_a_wall_elsewhere_than_the_workspace_says_is_an_object():
    assert kept(walled(-0.004)) == {2}
    assert kept(walled(0.02)) == {1, 2}


def test_rough_depth_shows_walls_that_are_farther_off(rng):
    noise_m = rng.normal(0.0, 0.008, SEEN.depth_m.shape).astype(np.float32)
    rough = replace(SEEN, depth_m=np.where(SEEN.depth_m > 0, SEEN.depth_m + noise_m, 0).astype(np.float32))
    assert kept(walled(0.012)) == {1, 2}
    assert kept(walled(0.012), rough) == {2}


def test_obstacles_are_unknown_where_the_pose_is_made_up():
    assert kept(walled(), replace(SEEN, pose_estimated=True)) == {1, 2}


def test_a_mask_without_a_reading_stays():
    assert kept(walled(), replace(SEEN, depth_m=np.zeros_like(SEEN.depth_m))) == {1, 2}


class TrueMasks(FromMasks):
    """Finds the true masks."""

    def find(self, observation, wanted):
        return Masks(TRUE, np.array([0.5, 0.6, 0.7], np.float32))


@pytest.mark.parametrize(("workspace", "sureness"), [(PAPER, [0.6, 0.7]), (walled(), [0.7])])
def test_perception_reports_none(workspace, sureness):
    scene = TrueMasks(workspace=workspace).perceive(SEEN, Wanted(""), None)
    assert [k.sureness for k in scene.known] == [np.float32(s) for s in sureness]
