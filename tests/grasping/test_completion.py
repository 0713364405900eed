"""Laws of the guess at the hidden back."""

import numpy as np
import pytest
from grasping_scenes import TABLE_Z, standing_box

from torc.geometry.transforms import look_at
from torc.grasping.clouds import build_clouds, forward_direction
from torc.grasping.completion import hidden_depth, robust_range
from torc.grasping.config import CloudConfig
from torc.testing.synthetic import SyntheticCylinder, SyntheticSphere
from torc.testing.views import view_of


def clouds_of(view):
    return build_clouds(view.scene, view.volume, TABLE_Z, CloudConfig())


@pytest.mark.parametrize(
    ("seen", "width", "height", "depth"),
    [
        (0.02, 0.06, 0.10, 0.06),
        (0.02, 0.12, 0.10, 0.075),
        (0.09, 0.05, 0.10, 0.09),
        (0.005, 0.05, 0.02, 0.03),
        (0.005, 0.05, 0.004, 0.020),
    ],
)
def test_hidden_depth(seen, width, height, depth):
    assert hidden_depth(seen, width, height, CloudConfig()) == pytest.approx(depth)


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5, 6, 200])
def test_a_range_leaves_out_two_points_at_either_end(rng, n):
    values = np.round(rng.normal(size=(n, 4)), 1)  # with equal ones
    ranked, skip = np.sort(values, axis=0), min(2, (n - 1) // 2)
    np.testing.assert_array_equal(robust_range(values), ranked[[skip, n - 1 - skip]])


def test_the_guessed_points_of_a_cylinder_lie_on_its_back():
    can = SyntheticCylinder(0, (0.65, -0.1, TABLE_Z + 0.06), 0.032, 0.12)
    (cloud,) = clouds_of(view_of(can)).objects
    guessed = cloud.points[cloud.visible :]
    assert len(guessed) > 50
    radius = np.hypot(*(guessed[:, :2] - np.array(can.center[:2])).T)
    assert np.median(np.abs(radius[guessed[:, 2] < TABLE_Z + 0.11] - 0.032)) < 0.004
    assert np.allclose(cloud.completion.center, can.center, atol=0.008)
    behind = guessed @ cloud.completion.view - cloud.completion.center @ cloud.completion.view
    assert np.median(behind) > 0.01


def test_normals_of_guessed_points_point_away_from_the_camera():
    (cloud,) = clouds_of(view_of(SyntheticSphere(0, (0.65, -0.1, TABLE_Z + 0.04), 0.04))).objects
    center = np.array([0.65, -0.1, TABLE_Z + 0.04])
    outward = np.einsum("ij,ij->i", cloud.normals, cloud.points - center)
    assert np.mean(outward > 0) > 0.99


def test_no_guessed_point_lies_where_free_space_or_another_object_was_seen():
    view = view_of(
        standing_box(0, 0.62, -0.10, (0.06, 0.08, 0.06)), standing_box(1, 0.69, -0.10, (0.05, 0.20, 0.15))
    )
    for cloud in clouds_of(view).objects:
        guessed = cloud.points[cloud.visible :]
        index = view.volume.grid.index_of(guessed)
        i, j, k = index[view.volume.grid.contains(index)].T
        label = view.volume.surface_label[i, j, k]
        assert not np.any(view.volume.seen[i, j, k] & (label < -1))
        assert not np.any((label >= 0) & (label != cloud.id))


def test_small_objects_are_obstacles_but_get_no_cloud_of_their_own():
    view = view_of(
        SyntheticSphere(4, (0.8, 0.0, TABLE_Z + 0.006), 0.006), standing_box(0, 0.6, 0, (0.05,) * 3)
    )
    clouds = clouds_of(view)
    assert [c.id for c in clouds.objects] == [0]
    assert set(clouds.cells.tags) == {0, 4}


def test_forward_is_horizontal_even_for_a_camera_that_looks_straight_down():
    ahead = forward_direction(look_at((0.1, 0.0, 1.4), (0.6, 0.5, 1.1)))
    assert np.allclose(ahead, np.array([0.5, 0.5, 0.0]) / np.hypot(0.5, 0.5))
    T = np.eye(4)
    T[:3, :3] = np.array([[0.0, -1, 0], [-1, 0, 0], [0, 0, -1]])
    assert np.allclose(forward_direction(T), [1.0, 0.0, 0.0])
