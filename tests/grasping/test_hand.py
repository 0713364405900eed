"""The kernel form of a gripper against its description."""

from dataclasses import replace

import numpy as np
import pytest
from hand_reference import tip_shift

from torc.errors import InputError
from torc.grasping.hand import FINGER_Z, OPEN, PAD_Y, PAD_Z, hand_geometry, reach_at


def test_sizes_are_those_of_the_description(gripper, hand):
    assert hand.sizes[OPEN] == gripper.max_width_m
    assert hand.sizes[PAD_Y] == pytest.approx(gripper.pad_width_m / 2)
    assert hand.sizes[PAD_Z] == pytest.approx(gripper.pad_height_m)
    assert hand.sizes[FINGER_Z] >= hand.sizes[PAD_Z] - 1e-9


@pytest.mark.parametrize("width", [0.0, 0.0137, 0.04, 0.0791, 0.085])
def test_reach_is_the_fingertips_lead_over_the_open_gripper(gripper, hand, width):
    assert reach_at(hand.reach_m, width) == pytest.approx(
        -tip_shift(gripper, gripper.max_width_m, width), abs=1e-5
    )


def test_links_that_lean_outwards_leave_the_space_between_the_fingers_free(gripper, hand):
    # A tall thing between the fingers: bounding boxes of the links would reject it.
    inside = np.zeros(3)
    inside[0], inside[2] = 0.030, -0.048
    boxes = [(np.abs(inside - b[:3]) <= b[3:]).all() for b in hand.palm]
    assert not any(boxes)
    coarse = [
        (np.abs(inside - b.center) <= b.half_size).all() for b in gripper.palm_boxes(gripper.max_width_m)
    ]
    assert any(coarse)


def test_a_gripper_without_a_finger_on_either_side_is_refused(gripper):
    table = gripper.finger_boxes_table.copy()
    table[:, 0, 0, 0] += 0.2
    with pytest.raises(InputError, match="one finger"):
        hand_geometry(replace(gripper, finger_boxes_table=table))
