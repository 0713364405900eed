"""Grasp planning goes around what the fingers felt."""

from dataclasses import replace

import numpy as np
import pytest
from grasping_scenes import TABLE_Z, standing_box

from torc.geometry.transforms import invert, transform_points
from torc.grasping.candidate_checks import Fault, check_candidates
from torc.grasping.clouds import build_clouds
from torc.grasping.config import CandidateConfig, CheckConfig, CloudConfig
from torc.grasping.generators import GeneratorInput, RawCandidates, propose_slices
from torc.grasping.hand import reach_at
from torc.testing.views import view_of

SIZE = (0.075, 0.06, 0.10)
"""Along the view, across, up."""
CENTER_X, TOP = 0.65, TABLE_Z + SIZE[2]


def patch(x, y=0.0):
    """As of a fingertip that came down just inside the top of the box, across the view."""
    xs, ys = np.meshgrid(x + np.arange(-0.004, 0.0041, 0.003), y + np.arange(-0.011, 0.0111, 0.003))
    return np.stack([xs, ys, np.full_like(xs, TOP - 0.002)], axis=-1).reshape(-1, 3).astype(np.float32)


def felt(view, points):
    (thing,) = view.scene.objects
    return replace(view.scene, objects=(replace(thing, felt=points),))


@pytest.fixture(scope="module")
def front():
    """A low slice of a box, whose depth nobody can tell: all but its front is cut away from what is seen."""
    view = view_of(standing_box(0, CENTER_X, 0.0, SIZE))
    (thing,) = view.scene.objects
    seen = thing.points[:, 0] < CENTER_X - SIZE[0] / 2 + 0.012
    cut = replace(thing, points=thing.points[seen], normals=thing.normals[seen], pixels=thing.pixels[seen])
    return replace(view, scene=replace(view.scene, objects=(cut,)))


def test_a_felt_back_is_as_deep_as_that(front):
    def depth(scene):
        (cloud,) = build_clouds(scene, front.volume, TABLE_Z, CloudConfig()).objects
        return cloud.completion.size_m[0]

    back = CENTER_X + SIZE[0] / 2
    assert depth(felt(front, patch(back + 0.01))) == pytest.approx(SIZE[0] + 0.014, abs=0.006)
    assert depth(felt(front, patch(CENTER_X - 0.02))) == depth(front.scene)


def test_no_finger_comes_where_something_was_felt(front, planner, hand):
    touched = patch(CENTER_X + SIZE[0] / 2 - 0.005)

    def hits(scene):
        found = planner.candidates(scene, front.volume, np.random.default_rng(3)).grasps
        n = 0
        for T, width in zip(found.Ts_world_tcp, found.widths_m):
            p = transform_points(invert(T), touched.astype(float))
            x, y = np.abs(p[:, 0]) - hand.max_width_m / 2, np.abs(p[:, 1])
            inner = (x > 0) & (x < hand.finger_x) & (y < hand.finger_y)
            end = -reach_at(hand.reach_m, width)
            n += np.any(inner & (p[:, 2] < end) & (p[:, 2] > end - hand.finger_z))
        return n, len(found)

    before, after = hits(front.scene), hits(felt(front, touched))
    assert before[0] > 0
    assert after[0] == 0
    assert after[1] > 0


def test_a_grasp_with_a_finger_there_is_at_fault(front, hand):
    closing, approach = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, -1.0])
    R = np.stack([closing, np.cross(approach, closing), approach], axis=1)
    tip, width = np.array([CENTER_X - SIZE[0] / 2 + 0.03, 0.0, TOP - 0.03]), 0.06
    finger = tip[0] + hand.max_width_m / 2 + 0.006

    def fault(scene):
        clouds = build_clouds(scene, front.volume, TABLE_Z, CloudConfig())
        raw = RawCandidates(R[None], tip[None], np.array([width]))
        found = check_candidates(raw, clouds.objects[0], clouds.cells, hand, TABLE_Z, CheckConfig())
        return found.fault[0]

    assert fault(front.scene) == Fault.NONE
    assert fault(felt(front, patch(finger))) == Fault.OWN_IN_FINGERS
    assert fault(felt(front, patch(finger, y=0.04))) == Fault.NONE


def test_no_slice_takes_a_part_in_which_something_was_felt(hand):
    """Of a thing too wide for the gripper, with a gap in what is seen of it, the parts are grasped one by one."""
    view = view_of(standing_box(0, CENTER_X, 0.0, (0.05, 0.12, 0.10)))
    (thing,) = view.scene.objects
    seen = np.abs(thing.points[:, 1]) > 0.035
    parted = replace(thing, points=thing.points[seen], normals=thing.normals[seen], pixels=thing.pixels[seen])

    def sides(touched):
        scene = replace(view.scene, objects=(replace(parted, felt=touched),))
        clouds = build_clouds(scene, view.volume, TABLE_Z, CloudConfig())
        given = GeneratorInput(clouds.objects[0], hand, clouds.forward, TABLE_Z, 0.005, 6, CandidateConfig())
        found = propose_slices(given, np.random.default_rng(1))
        across = (np.abs(found.Rs[:, 1, 0]) > 0.98) & (found.Rs[:, 2, 2] < -0.98)
        return set(np.sign(found.tips[across, 1]))

    assert sides(np.zeros((0, 3), np.float32)) == {-1.0, 1.0}
    xs = np.concatenate([patch(x, 0.05) for x in np.arange(CENTER_X - 0.03, CENTER_X + 0.03, 0.006)])
    assert sides(xs) == {-1.0}
