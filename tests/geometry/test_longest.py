"""How long a cloud is: whatever way it lies, and whatever flies off."""

import numpy as np
import pytest

from torc.geometry.extent import longest_m
from torc.geometry.transforms import rotation_about


def test_a_box_is_as_long_as_its_diagonal_whatever_way_it_lies(rng):
    corners = np.array([(x, y, z) for x in (0, 0.3) for y in (0, 0.1) for z in (0, 0.05)])
    for _ in range(20):
        axis = rng.standard_normal(3)
        turned = corners @ rotation_about(axis / np.linalg.norm(axis), rng.uniform(0, 6)).T
        assert longest_m(turned + rng.standard_normal(3)) == pytest.approx(0.3202, rel=0.02)
    assert longest_m(corners) <= 0.3202


def test_few_flying_points_do_not_count_when_told_so(rng):
    cloud = rng.uniform(0, 0.1, (4000, 3))
    cloud[::200] += 1.0
    assert longest_m(cloud) > 1.0
    assert 0.12 < longest_m(cloud, 0.02) < 0.18


def test_no_point_has_no_length():
    assert longest_m(np.zeros((0, 3))) == 0.0
    assert longest_m(np.ones((1, 3)), 0.02) == 0.0
