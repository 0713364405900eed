"""The conformance suite for cameras finds what is wrong."""

from dataclasses import replace

import numpy as np
import pytest

from torc.errors import PartError
from torc.perception.checked_scenes import ask_camera
from torc.records import Capture, StereoPair
from torc.testing.camera_conformance import check_camera
from torc.testing.conformance import NonConformanceError
from torc.testing.synthetic import synthetic_observation

SEEN = synthetic_observation(())
GREY = np.zeros(SEEN.depth_m.shape, np.uint8)


class Gives:
    def __init__(self, **changes):
        self.changes = changes

    def capture(self):
        return replace(SEEN, **self.changes)


def test_good_ones_pass_with_a_pair_also_without_depth():
    check_camera(Gives())
    check_camera(Gives(depth_m=0 * SEEN.depth_m, pair=StereoPair(GREY, GREY, 0.1)))


@pytest.mark.usefixtures("any_arrays")
@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"depth_m": 0 * SEEN.depth_m}, "no pixel has a depth"),
        ({"depth_m": 1000 * SEEN.depth_m}, "metres, not millimetres"),
        ({"K": SEEN.K / 4}, "no intrinsics"),
        ({"K": SEEN.K @ np.diag([1, 1, 3.0]) / np.array([[1], [1], [3]])}, "another size"),
        ({"T_world_camera": 2 * np.eye(4)}, "not a rotation"),
        ({"pair": StereoPair(GREY[:-1], GREY[:-1], 0.1)}, "as large as depth_m"),
        ({"pair": StereoPair(GREY, GREY, -0.1)}, "above 0"),
    ],
)
def test_faults_are_named(changes, text):
    with pytest.raises(NonConformanceError, match=text):
        check_camera(Gives(**changes))


class Knows(Gives):
    """Gives labels, too."""

    def __init__(self, label):
        super().__init__()
        self.label = label

    def capture(self):
        return Capture(super().capture(), self.label)


def test_true_labels_may_come_with_a_snapshot_and_are_as_large():
    label = np.zeros(SEEN.depth_m.shape, np.int16)
    check_camera(Knows(label))
    assert ask_camera(Knows(label)).label_image is label
    assert ask_camera(Gives()).label_image is None
    with pytest.raises(PartError, match="label image has another size than depth_m"):
        check_camera(Knows(label[:-1]))


def test_no_observation_is_a_fault_of_the_part():
    class Nothing:
        def capture(self):
            return None

    with pytest.raises(PartError, match="returned None"):
        check_camera(Nothing())
