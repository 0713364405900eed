"""How long and thick a cloud is: whatever way it lies, whatever flies off; of a part no more than of the whole."""

import numpy as np
import pytest

from torc.geometry.extent import extent
from torc.geometry.transforms import rotation_about


def box(length_m, width_m, height_m):
    return np.stack(
        np.meshgrid(*(np.linspace(0, s, 9) for s in (length_m, width_m, height_m))), axis=-1
    ).reshape(-1, 3)


@pytest.mark.parametrize(
    "sides", [(0.3, 0.1, 0.05), (0.2, 0.02, 0.02), (0.2, 0.15, 0.01), (0.05, 0.05, 0.05)]
)
def test_a_box_is_as_long_and_thick_as_its_diagonals_whatever_way_it_lies(sides, rng):
    for _ in range(10):
        axis = rng.standard_normal(3)
        turned = box(*sides) @ rotation_about(axis / np.linalg.norm(axis), rng.uniform(0, 6)).T
        length_m, thickness_m = extent(turned + rng.standard_normal(3))
        assert length_m == pytest.approx(np.linalg.norm(sides), rel=0.02)
        assert thickness_m == pytest.approx(np.linalg.norm(sides[1:]), rel=0.18)  # a cube has no axis


def test_a_part_is_no_larger_than_the_whole(rng):
    for _ in range(30):
        cloud = box(*rng.uniform(0.01, 0.3, 3))
        part = cloud[cloud @ rng.standard_normal(3) > rng.uniform(-0.1, 0.2)]
        assert (np.array(extent(part)) <= 1.25 * np.array(extent(cloud))).all()


def test_few_flying_points_do_not_count_when_told_so(rng):
    cloud = rng.uniform(0, 0.1, (4000, 3))
    cloud[rng.choice(4000, 20, replace=False)] += 1.0
    assert extent(cloud).length_m > 1.0
    assert 0.12 < extent(cloud, 0.02).length_m < 0.18


def test_no_point_has_no_extent():
    assert extent(np.zeros((0, 3))) == (0.0, 0.0)
    assert extent(np.ones((1, 3)), 0.02) == (0.0, 0.0)
