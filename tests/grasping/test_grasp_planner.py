"""Laws of the whole planner."""

from dataclasses import replace

import numpy as np
import pytest
from grasping_scenes import TABLE_Z, standing_box
from scipy.spatial.transform import Rotation

from tools.grasp_model.hand_score import HandScore
from tools.grippers import write_slides
from torc.errors import InputError
from torc.geometry.transforms import make_pose
from torc.grasping.config import CandidateConfig, GraspConfig, SelectionConfig
from torc.grasping.features import FEATURE_NAMES
from torc.grasping.geometric_planner import GeometricGraspPlanner
from torc.grasping.selection import chosen, thinned
from torc.records import TARGET_ID
from torc.robots.loading import load_robot
from torc.testing.synthetic import SyntheticSphere
from torc.testing.views import view_of


def plan(planner, view, seed=0):
    return planner.plan(view.scene, view.volume, np.random.default_rng(seed))


def arrays(grasps):
    return {k: v for k, v in vars(grasps).items() if isinstance(v, np.ndarray)}


def test_the_same_generator_state_gives_the_same_grasps(planner, pile):
    a, b, c = plan(planner, pile, 4), plan(planner, pile, 4), plan(planner, pile, 5)
    for name, value in arrays(a).items():
        assert np.array_equal(value, arrays(b)[name]), name
    assert not np.array_equal(a.Ts_world_tcp, c.Ts_world_tcp)


def test_grasps_are_grouped_by_object_the_best_first(planner, pile):
    grasps = plan(planner, pile)
    assert set(grasps.object_ids.tolist()) <= set(pile.scene.ids)
    for i in pile.scene.ids:
        rows = np.flatnonzero(grasps.object_ids == i)
        assert len(rows) <= planner.config.selection.max_per_object
        assert np.array_equal(rows, np.arange(rows[0], rows[0] + len(rows)))
        assert np.all(np.diff(grasps.scores[rows]) <= 0)
        assert grasps.of(i)[0] == rows[0]
    assert np.all((grasps.scores >= 0) & (grasps.scores <= 1))
    assert set(np.unique(grasps.generators)) <= set(range(len(grasps.generator_names)))


def test_all_fields_fit_together(planner, gripper, pile):
    g = plan(planner, pile)
    assert np.allclose(
        np.swapaxes(g.Ts_world_tcp[:, :3, :3], 1, 2) @ g.Ts_world_tcp[:, :3, :3], np.eye(3), atol=1e-9
    )
    assert np.allclose(g.Ts_world_tcp[:, 3], [0, 0, 0, 1])
    assert np.all((g.widths_m >= 0) & (g.widths_m <= gripper.max_width_m))
    between = g.contacts[:, 1] - g.contacts[:, 0]
    assert np.allclose(between, g.widths_m[:, None] * g.Ts_world_tcp[:, :3, 0])
    behind = np.einsum(
        "ij,ij->i", g.Ts_world_tcp[:, :3, 3] - g.contacts.mean(axis=1), g.Ts_world_tcp[:, :3, 2]
    )
    assert np.all((behind > -1e-9) & (behind < gripper.pad_height_m + 1e-9))


@pytest.mark.parametrize("yaw", [0.0, 0.3, -0.6])
def test_the_best_grasp_of_a_lone_box_closes_across_its_faces(planner, yaw):
    shape = standing_box(0, 0.65, -0.12, (0.05, 0.07, 0.12), yaw)
    g = plan(planner, view_of(shape))
    R, tip = g.Ts_world_tcp[0, :3, :3], g.Ts_world_tcp[0, :3, 3]
    c, s = np.cos(yaw), np.sin(yaw)
    axes = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1.0]])
    cosines = np.abs(axes @ R[:, 0])
    face = int(np.argmax(cosines))
    assert cosines[face] > np.cos(np.deg2rad(4))
    assert abs((tip - np.array(shape.center)) @ axes[face]) < 0.005
    assert g.widths_m[0] == pytest.approx(shape.size[face], abs=0.005)
    assert g.scores[0] > 0.8


def test_the_best_grasp_of_a_ball_passes_its_middle(planner):
    ball = SyntheticSphere(0, (0.65, -0.12, TABLE_Z + 0.035), 0.035)
    g = plan(planner, view_of(ball))
    R, tip = g.Ts_world_tcp[0, :3, :3], g.Ts_world_tcp[0, :3, 3]
    to_center = np.array(ball.center) - tip
    assert abs(to_center @ R[:, 0]) < 0.006
    assert abs(to_center @ R[:, 1]) < 0.012
    assert g.widths_m[0] == pytest.approx(0.07, abs=0.006)


def test_candidates_are_what_plan_chooses_from(planner, gripper, pile):
    found = planner.candidates(pile.scene, pile.volume, np.random.default_rng(4))
    g = plan(planner, pile, 4)
    assert found.features.shape == (len(found.grasps), len(FEATURE_NAMES))
    assert found.features.dtype == np.float32
    assert np.all(np.isfinite(found.features))
    assert found.proposed >= len(found.grasps) > len(g)
    offered = {t.tobytes(): s for t, s in zip(found.grasps.Ts_world_tcp, found.grasps.scores)}
    assert all(offered[t.tobytes()] == s for t, s in zip(g.Ts_world_tcp, g.scores))
    assert np.all(found.blockers[found.blocked] != 0)


def test_what_is_drawn_for_one_object_does_not_depend_on_the_others(planner, pile):
    everything = planner.candidates(pile.scene, pile.volume, np.random.default_rng(4))
    alone = replace(pile.scene, objects=tuple(o for o in pile.scene.objects if o.id == 3))
    single = planner.candidates(alone, pile.volume, np.random.default_rng(4))
    mine = everything.grasps.object_ids == 3
    assert np.array_equal(single.grasps.Ts_world_tcp, everything.grasps.Ts_world_tcp[mine])


def test_the_target_is_searched_for_grasps_harder_than_anything_else(gripper):
    for object_id, factor in ((TARGET_ID, 3), (TARGET_ID + 1, 1)):
        view = view_of(standing_box(object_id, 0.65, -0.12, (0.05, 0.07, 0.12)))
        proposed = []
        for effort in (1, 8):
            config = GraspConfig(candidates=CandidateConfig(target_effort=effort))
            planner = GeometricGraspPlanner(gripper, TABLE_Z, config, HandScore())
            proposed.append(planner.candidates(view.scene, view.volume, np.random.default_rng(0)).proposed)
        assert proposed[1] == proposed[0] if factor == 1 else proposed[1] > factor * proposed[0]


def test_wedged_objects_keep_blocked_grasps_that_name_the_neighbours(planner):
    row = [standing_box(i, 0.65, -0.24 + 0.062 * i, (0.06, 0.06, 0.14)) for i in range(3)]
    view = view_of(*row)
    found = planner.candidates(view.scene, view.volume, np.random.default_rng(0))
    mine = (found.grasps.object_ids == 1) & (np.abs(found.grasps.Ts_world_tcp[:, 1, 0]) > 0.98)
    assert mine.sum() > 3
    assert np.all(found.blocked[mine])
    assert set(found.blockers[mine].tolist()) <= {0b001, 0b100, 0b101}
    g = plan(planner, view)
    assert np.any((g.object_ids == 1) & (np.abs(g.Ts_world_tcp[:, 1, 0]) > 0.98))


def test_of_the_blocked_candidates_only_so_many_are_kept(gripper, pile):
    few = replace(GraspConfig().candidates, max_blocked=5)
    small = GeometricGraspPlanner(gripper, TABLE_Z, GraspConfig(candidates=few), HandScore())
    found = small.candidates(pile.scene, pile.volume, np.random.default_rng(0))
    per_object = np.bincount(found.grasps.object_ids[found.blocked])
    assert per_object.max() == 5
    everything = GeometricGraspPlanner(gripper, TABLE_Z, scorer=HandScore()).candidates(
        pile.scene, pile.volume, np.random.default_rng(0)
    )
    free = everything.grasps.Ts_world_tcp[~everything.blocked]
    assert np.array_equal(found.grasps.Ts_world_tcp[~found.blocked], free)


def test_small_and_hidden_objects_get_none(planner):
    view = view_of(
        SyntheticSphere(2, (0.8, 0.0, TABLE_Z + 0.008), 0.008), standing_box(0, 0.6, -0.2, (0.05, 0.05, 0.1))
    )
    g = plan(planner, view)
    assert set(g.object_ids.tolist()) == {0}


def test_an_empty_table_gives_an_empty_set(planner):
    view = view_of()
    g = plan(planner, view)
    assert len(g) == 0
    assert g.Ts_world_tcp.shape == (0, 4, 4)
    found = planner.candidates(view.scene, view.volume, np.random.default_rng(0))
    assert found.features.shape == (0, len(FEATURE_NAMES))


def test_any_scorer_decides_the_order(gripper, pile):
    class Backwards:
        def score(self, features):
            return 1 - HandScore().score(features)

    config = GraspConfig(selection=SelectionConfig(max_per_object=4))
    best = GeometricGraspPlanner(gripper, TABLE_Z, config, HandScore())
    worst = GeometricGraspPlanner(gripper, TABLE_Z, config, Backwards())
    assert plan(best, pile).scores.mean() > 1 - plan(worst, pile).scores.mean()


def test_a_support_height_that_is_no_number_is_refused(gripper):
    with pytest.raises(InputError, match="support"):
        GeometricGraspPlanner(gripper, float("nan"))


def test_a_wide_hand_expects_deeper_objects_and_the_shipped_one_what_it_was_trained_with(tmp_path):
    wide, default = load_robot(str(write_slides(tmp_path, 0.14))), load_robot()
    depths = [
        GeometricGraspPlanner(robot.gripper, TABLE_Z).config.clouds.max_hidden_depth_m
        for robot in (default, wide)
    ]
    assert depths[0] == GraspConfig().clouds.max_hidden_depth_m
    assert 0.10 < depths[1] < 0.14


CONFIG = SelectionConfig(max_per_object=12, min_blocked_share=0.25)


@pytest.fixture
def grasps(rng):
    n = 400
    Rs = [Rotation.from_euler("xyz", rng.uniform(-0.6, 0.6, 3)).as_matrix() for _ in range(n)]
    poses = [make_pose(R, rng.uniform(0, 0.05, 3)) for R in Rs]
    return rng.random(n), rng.random(n) < 0.4, np.array(poses)


def alike(a, b):
    cosines = np.einsum("ij,ij->j", a[:3], b[:3])
    close = np.linalg.norm(a[:3, 3] - b[:3, 3]) <= CONFIG.position_m
    return close and min(abs(cosines[0]), cosines[2]) > np.cos(CONFIG.angle_rad)


def test_no_two_of_a_kind_are_alike_and_every_dropped_one_has_a_better_one(grasps):
    scores, blocked, Ts = grasps
    config = SelectionConfig(max_per_object=1000)
    kept = thinned(scores, blocked, Ts, config)
    for kind in (False, True):
        same = [i for i in kept if blocked[i] == kind]
        assert not any(alike(Ts[a], Ts[b]) for a in same for b in same if a != b)
        for i in np.flatnonzero(blocked == kind):
            if i not in same:
                assert any(alike(Ts[i], Ts[k]) and scores[k] >= scores[i] for k in same)


def test_the_best_of_each_kind_is_always_chosen_and_the_order_falls(grasps):
    scores, blocked, Ts = grasps
    best = chosen(thinned(scores, blocked, Ts, CONFIG), scores, blocked, CONFIG)
    assert len(best) == 12
    assert np.all(np.diff(scores[best]) <= 0)
    assert np.count_nonzero(blocked[best]) == 3
    for kind in (False, True):
        index = np.flatnonzero(blocked == kind)
        assert index[np.argmax(scores[index])] in best


@pytest.mark.parametrize("kind", [False, True])
def test_unused_places_go_to_the_other_kind(grasps, kind):
    scores, _, Ts = grasps
    blocked = np.full(len(scores), kind)
    assert len(chosen(thinned(scores, blocked, Ts, CONFIG), scores, blocked, CONFIG)) == 12


def test_half_a_turn_about_the_approach_is_the_same_grasp(rng):
    R = Rotation.from_euler("xyz", (0.1, 2.9, 0.3)).as_matrix()
    Ts = np.array([make_pose(R, np.zeros(3)), make_pose(R @ np.diag([-1.0, -1.0, 1.0]), np.zeros(3))])
    kept = thinned(np.array([0.4, 0.5]), np.zeros(2, dtype=bool), Ts, CONFIG)
    assert kept.tolist() == [1]
