"""The hard checks against the gripper's description, point by point in numpy."""

import numpy as np
import pytest
from grasping_scenes import TABLE_Z, standing_box
from hand_reference import corners, in_grasp_frame, in_open_palm, in_swept_fingers, tip_shift

from torc.grasping.candidate_checks import BETWEEN, FINGERS, PALM, Fault, check_candidates
from torc.grasping.clouds import build_clouds
from torc.grasping.config import CheckConfig, GraspConfig
from torc.grasping.generators.common import RawCandidates
from torc.testing.views import view_of, view_of_clutter

CONFIG = GraspConfig()


def candidates_of(planner, view, seed=0):
    found = planner.candidates(view.scene, view.volume, np.random.default_rng(seed))
    return found, build_clouds(view.scene, view.volume, TABLE_Z, CONFIG.clouds)


def some(grasps, seed, n):
    """Index, pose, width and object of n of the grasps."""
    for i in np.random.default_rng(seed).permutation(len(grasps))[:n]:
        yield i, grasps.Ts_world_tcp[i], grasps.widths_m[i], int(grasps.object_ids[i])


def between(points, gripper, half_x):
    inside = (np.abs(points[:, 0]) < half_x) & (np.abs(points[:, 1]) < gripper.pad_width_m / 2)
    return inside & (points[:, 2] <= 0) & (points[:, 2] > -gripper.pad_height_m)


@pytest.mark.parametrize("seed", [3, 8])
def test_every_kept_candidate_passes_the_checks_by_brute_force(seed, planner, gripper):
    view = view_of_clutter(seed, 9)
    found, clouds = candidates_of(planner, view)
    seen = {c.id: c.seen for c in clouds.objects}
    checks = CONFIG.checks
    for _, T, width, own in some(found.grasps, 1, 60):
        points = in_grasp_frame(T, seen[own])
        outside_jaws = np.abs(points[:, 0]) > width / 2 + checks.own_slack_m
        assert not np.any(in_swept_fingers(gripper, points, width, -0.0005) & outside_jaws)
        opening = gripper.max_width_m
        for box in (*gripper.finger_boxes(opening), *gripper.palm_boxes(opening)):
            shift = tip_shift(gripper, opening, width)
            lowest = (corners(box, shift) @ T[:3, :3].T + T[:3, 3])[:, 2].min()
            # Bounding boxes of leaning links reach lower than the links.
            assert lowest > TABLE_Z + checks.table_margin_m - 0.025
        for box in gripper.finger_boxes(width):
            lowest = (corners(box) @ T[:3, :3].T + T[:3, 3])[:, 2].min()
            assert lowest > TABLE_Z + checks.table_margin_m - 1e-6
        assert between(points, gripper, width / 2 + checks.own_slack_m).sum() >= checks.min_points_between


def test_free_candidates_touch_nothing_and_blocked_ones_name_what_they_touch(planner, gripper, pile):
    found, clouds = candidates_of(planner, pile)
    checks = CONFIG.checks
    for i, T, width, own in some(found.grasps, 2, 40):
        other = clouds.cells.tags != own
        points = in_grasp_frame(T, clouds.cells.points[other])
        touched = in_swept_fingers(gripper, points, width, checks.finger_margin_m - 0.0005)
        touched &= np.abs(points[:, 0]) >= width / 2
        caught = between(points, gripper, width / 2)
        if not found.blocked[i]:
            assert not np.any(touched)
            assert caught.sum() <= checks.max_foreign_between
        named = {k for k in range(64) if int(found.blockers[i]) >> k & 1}
        assert set(clouds.cells.tags[other][touched | caught].tolist()) <= named
        near = in_swept_fingers(gripper, points, width, 0.0055) | in_open_palm(gripper, points, width, 0.0055)
        assert named <= set(clouds.cells.tags[other][near | caught].tolist())
        assert own not in named


def from_above(x, y, z):
    """Straight down, closing along y."""
    T = np.eye(4)
    T[:3, :3] = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]])
    T[:3, 3] = x, y, z
    return T


@pytest.fixture(scope="module")
def block():
    view = view_of(
        standing_box(0, 0.6, 0.0, (0.05, 0.04, 0.10)), standing_box(1, 0.6, 0.075, (0.05, 0.04, 0.10))
    )
    return build_clouds(view.scene, view.volume, TABLE_Z, CONFIG.clouds)


def check(clouds, hand, T, width):
    raw = RawCandidates(T[None, :3, :3].copy(), T[None, :3, 3].copy(), np.array([width]))
    return check_candidates(raw, clouds.objects[0], clouds.cells, hand, TABLE_Z, CheckConfig())


def test_faults_have_their_causes(block, hand):
    top = TABLE_Z + 0.10
    assert check(block, hand, from_above(0.6, 0.0, top - 0.03), 0.04).fault[0] == Fault.NONE
    assert check(block, hand, from_above(0.6, 0.0, TABLE_Z + 0.004), 0.04).fault[0] == Fault.TABLE
    assert check(block, hand, from_above(0.6, 0.03, top - 0.03), 0.04).fault[0] == Fault.OWN_IN_FINGERS
    assert check(block, hand, from_above(0.6, 0.0, top - 0.085), 0.04).fault[0] == Fault.OWN_IN_PALM
    assert check(block, hand, from_above(0.6, 0.0, top + 0.01), 0.04).fault[0] == Fault.TOO_FEW_POINTS


def test_a_neighbour_in_the_fingers_way_blocks_and_is_named(block, hand):
    found = check(block, hand, from_above(0.6, 0.0, TABLE_Z + 0.07), 0.04)
    assert found.blockers[0] == 1 << 1
    assert found.foreign[0, FINGERS] > 0
    assert found.foreign[0, PALM] == found.foreign[0, BETWEEN] == 0
    assert found.blocked[0]


def test_a_neighbour_between_the_pads_blocks_and_is_named(hand):
    view = view_of(
        standing_box(0, 0.6, 0.0, (0.05, 0.03, 0.10)), standing_box(1, 0.6, 0.035, (0.05, 0.03, 0.10))
    )
    clouds = build_clouds(view.scene, view.volume, TABLE_Z, CONFIG.clouds)
    found = check(clouds, hand, from_above(0.6, 0.0175, TABLE_Z + 0.07), 0.065)
    assert found.fault[0] == Fault.NONE
    assert found.foreign[0, BETWEEN] > 3
    assert found.blockers[0] == 2
    assert found.blocked[0]
