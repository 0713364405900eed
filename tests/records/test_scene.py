"""A scene by another name: which object is the target may be told afterwards."""

import numpy as np
import pytest

from torc.perception.segmentation import PerceptionConfig, segment
from torc.testing.synthetic import random_clutter, synthetic_observation


@pytest.fixture
def scene(rng):
    observation = synthetic_observation(random_clutter(rng, 5))
    return segment(observation, observation.label_image, PerceptionConfig())


def test_the_named_object_and_the_target_change_ids(scene):
    named = scene.ids[-1]
    other = scene.with_target(named)
    np.testing.assert_array_equal(other.label_image == 0, scene.label_image == named)
    np.testing.assert_array_equal(other.label_image == named, scene.label_image == 0)
    np.testing.assert_array_equal(other.object(0).points, scene.object(named).points)
    assert list(other.ids) == sorted(other.ids)
    assert other.target_id == 0
    again = other.with_target(named)
    np.testing.assert_array_equal(again.label_image, scene.label_image)


def test_what_is_not_in_sight_is_not_named(scene):
    with pytest.raises(KeyError):
        scene.with_target(63)
