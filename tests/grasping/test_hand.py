"""The kernel form of a gripper, and the points inside it, against its boxes from the description."""

from dataclasses import replace

import numpy as np
import pytest
from hand_reference import in_open_palm, in_swept_fingers, tip_shift
from scipy.spatial.transform import Rotation

from torc.errors import InputError
from torc.grasping.cells import gather, group, thin_out
from torc.grasping.hand import hand_bounds, hand_geometry, in_fingers, in_palm, reach_at


@pytest.mark.parametrize("width", [0.0, 0.0137, 0.04, 0.0791, 0.085])
def test_reach_is_the_fingertips_lead_over_the_open_gripper(gripper, hand, width):
    assert reach_at(hand.reach_m, width) == pytest.approx(
        -tip_shift(gripper, gripper.max_width_m, width), abs=1e-5
    )


def test_links_that_lean_outwards_leave_the_space_between_the_fingers_free(gripper, hand):
    # A tall thing between the fingers: bounding boxes of the links would reject it.
    inside = np.array([0.030, 0.0, -0.048])
    assert not any((np.abs(inside - b[:3]) <= b[3:]).all() for b in hand.palm)
    coarse = gripper.palm_boxes(gripper.max_width_m)
    assert any((np.abs(inside - b.center) <= b.half_size).all() for b in coarse)


def test_a_gripper_without_a_finger_on_either_side_is_refused(gripper):
    table = gripper.finger_boxes_table.copy()
    table[:, 0, 0, 0] += 0.2
    with pytest.raises(InputError, match="one finger"):
        hand_geometry(replace(gripper, finger_boxes_table=table))


@pytest.mark.parametrize("width", [0.002, 0.03, 0.07])
def test_the_finger_sweep_is_that_of_the_boxes_moved_through_all_openings(gripper, hand, rng, width):
    points = rng.uniform((-0.08, -0.02, -0.08), (0.08, 0.02, 0.01), (4000, 3))
    shift = -reach_at(hand.reach_m, width)
    found = np.array([in_fingers(*p, width, shift, 0.0, 0.0, 0.0, hand) for p in points])
    expected = in_swept_fingers(gripper, points, width, -0.0003, steps=300)
    # The kernel leaves nothing out, and adds at most what the arc's rear leaves free.
    assert not np.any(expected & ~found & (points[:, 2] > shift - hand.finger_z))
    assert np.mean(found & ~in_swept_fingers(gripper, points, width, 0.0015, steps=300)) < 0.05
    assert expected.sum() > 100


@pytest.mark.parametrize("width", [0.0, 0.05])
def test_the_palm_lies_within_its_boxes_and_fills_most_of_them(gripper, hand, rng, width):
    points = rng.uniform((-0.08, -0.04, -0.20), (0.08, 0.04, 0.01), (4000, 3))
    shift = -reach_at(hand.reach_m, width)
    found = np.array([in_palm(*p, shift, 0.0, hand) for p in points])
    # The kernel takes the gripper as symmetric, and leaning links as slender.
    assert not np.any(found & ~in_open_palm(gripper, points, width, 0.0015))
    assert np.mean(found) > 0.6 * np.mean(in_open_palm(gripper, points, width))


def test_the_bounds_hold_every_point_of_the_gripper(gripper, hand, rng):
    low, high = hand_bounds(hand, 0.0)
    points = rng.uniform(-0.25, 0.25, (20_000, 3))
    inside = np.all((points >= low - 1e-9) & (points <= high + 1e-9), axis=1)
    for width in (0.0, 0.04, gripper.max_width_m):
        met = in_swept_fingers(gripper, points, width, -1e-6) | in_open_palm(gripper, points, width, -1e-6)
        assert np.count_nonzero(met) > 20
        assert not np.any(met & ~inside)


def test_thinned_points_are_the_means_of_their_cubes(rng):
    points, normals = rng.uniform(-0.1, 0.1, (3000, 3)), rng.normal(size=(3000, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    thin, thin_normals = thin_out(points, normals, 0.02)
    cubes = np.floor(points / 0.02).astype(int)
    expected = {tuple(c): points[np.all(cubes == c, axis=1)].mean(axis=0) for c in np.unique(cubes, axis=0)}
    assert len(thin) == len(expected)
    for p in thin:
        assert np.allclose(p, expected[tuple(np.floor(p / 0.02).astype(int))])
    assert np.allclose(np.linalg.norm(thin_normals, axis=1), 1.0)


def test_normals_are_not_averaged_across_an_edge():
    points = np.array([[0.001, 0.001, 0.001], [0.002, 0.002, 0.002]])
    normals = np.array([[1.0, 0, 0], [0, 0, 1.0]])
    _, thin_normals = thin_out(points, normals, 0.01)
    assert any(np.allclose(thin_normals[0], n) for n in normals)


def test_grouping_keeps_every_point_with_its_tag_and_bounds_each_cell(rng):
    points, tags = rng.uniform(0, 0.2, (500, 3)), rng.integers(0, 9, 500)
    cells = group(points, tags, 0.03)
    assert sorted(cells.order) == list(range(500))
    assert np.array_equal(cells.points, points[cells.order])
    assert np.array_equal(cells.tags, tags[cells.order])
    for c, (a, b) in enumerate(zip(cells.starts[:-1], cells.starts[1:])):
        assert b > a
        assert np.all(
            np.linalg.norm(cells.points[a:b] - cells.centers[:, c], axis=1) <= cells.radii[c] + 1e-12
        )


@pytest.mark.parametrize("n", [0, 1, 800])
def test_gather_finds_exactly_the_points_in_the_box(rng, n):
    cells = group(rng.uniform(-0.2, 0.2, (n, 3)), np.zeros(n, dtype=np.int64), 0.04)
    R, tip = Rotation.from_euler("xyz", (0.3, -0.8, 2.0)).as_matrix(), np.array([0.03, -0.02, 0.05])
    box = (0.05, 0.03, -0.12, 0.01)
    local, index = np.empty((n, 3)), np.empty(n, dtype=np.int64)
    count = gather(R, tip, box, cells, local, index)
    expected = (cells.points - tip) @ R
    beside = (np.abs(expected[:, 0]) <= 0.05) & (np.abs(expected[:, 1]) <= 0.03)
    inside = beside & (expected[:, 2] >= -0.12) & (expected[:, 2] <= 0.01)
    assert sorted(index[:count]) == np.flatnonzero(inside).tolist()
    assert np.allclose(local[:count], expected[index[:count]])
