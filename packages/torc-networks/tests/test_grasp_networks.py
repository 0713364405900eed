"""Grasps by a server: each is where the network wants it, and none that torc's own checks refuse comes through."""

import numpy as np
import pytest

from torc.errors import NetworkError
from torc.geometry.transforms import invert, make_pose
from torc.testing.views import view_of
from torc_networks.grasping.frames import PANDA_TIP_M, along_axes, fingertips
from torc_networks.grasping.planners import (
    ContactGraspNetConfig,
    ContactGraspNetPlanner,
    GraspGenXConfig,
    GraspGenXPlanner,
)

NAN = float("nan")
DOWN = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]])
"""Closing along world y, approaching straight down."""


class GenX:
    """Tells poses of the fingertips as GraspGenX would: of the base."""

    def __init__(self, gripper, server_of, table_z):
        self.gripper, self.server_of, self.table_z = gripper, server_of, table_z

    def planner(self, Ts, widths, confidences, **settings):
        base = along_axes(np.asarray(Ts), -fingertips(self.gripper, np.asarray(widths)))
        answer = {
            "grasps": base,
            "confidences": confidences,
            "num_grasps": len(base),
            "timing": {"infer_ms": 3.0},
        }
        return self.asking(
            lambda asked: answer if self._is_first(asked) else {"grasps": np.zeros((0, 4, 4))}, **settings
        )

    def asking(self, answer, **settings):
        config = GraspGenXConfig(server=self.server_of(infer=answer), **settings)
        return GraspGenXPlanner(self.gripper, self.table_z, config)

    def _is_first(self, asked):
        return asked["point_cloud"][:, 1].mean() < 0


class Cgn:
    """The same as Contact-GraspNet would: of a Franka hand, in the camera frame, with widths."""

    def __init__(self, gripper, server_of, table_z):
        self.gripper, self.server_of, self.table_z = gripper, server_of, table_z

    def planner(self, Ts, widths, confidences, **settings):
        def answer(asked):
            hand = along_axes(
                invert(asked["T_world_camera"]) @ Ts, np.tile([0, 0, -PANDA_TIP_M], (len(Ts), 1))
            )
            ids = np.zeros(len(Ts), np.int64)
            return {
                "grasps": hand,
                "confidences": confidences,
                "widths": np.asarray(widths, float),
                "object_ids": ids,
            }

        return self.asking(answer, **settings)

    def asking(self, answer, **settings):
        config = ContactGraspNetConfig(server=self.server_of(grasps=answer), **settings)
        return ContactGraspNetPlanner(self.gripper, self.table_z, config)


@pytest.fixture(params=[GenX, Cgn])
def network(request, gripper, server_of, table_z):
    return request.param(gripper, server_of, table_z)


def _plan(planner, view, seed=0):
    return planner.plan(view.scene, view.volume, np.random.default_rng(seed))


def _above(height, y=-0.10, x=0.62):
    """Straight down onto the first box, the tips so high above the table (at 1.05 m)."""
    return make_pose(DOWN, [x, y, 1.05 + height])


def test_a_good_grasp_comes_through_where_the_network_wants_it(network, view):
    T = _above(0.07)
    found = _plan(network.planner([T], [0.05], [0.8]), view)
    assert len(found) == 1
    np.testing.assert_allclose(found.Ts_world_tcp[0, :3, :3], DOWN, atol=1e-6)
    np.testing.assert_allclose(found.Ts_world_tcp[0, :3, 3], T[:3, 3], atol=1.5e-3)
    assert found.object_ids.tolist() == [0]
    assert found.widths_m[0] == pytest.approx(0.05, abs=4e-3)
    assert found.generator_names == network.planner([T], [0.05], [0.8]).generator_names
    between = found.contacts[0, 1] - found.contacts[0, 0]
    np.testing.assert_allclose(between, found.widths_m[0] * DOWN[:, 0], atol=1e-6)


def test_scores_are_torcs_own_or_the_networks(network, view):
    across = _above(0.07)
    across[:3, :3] = DOWN @ np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    Ts, widths = [_above(0.07), across], [0.05, 0.05]
    by_torc = _plan(network.planner(Ts, widths, [0.11, 0.22]), view)
    by_network = _plan(network.planner(Ts, widths, [0.11, 0.22], score="network"), view)
    assert by_network.scores.tolist() == [0.22, 0.11]
    np.testing.assert_allclose(by_network.Ts_world_tcp[0, :3, :3], across[:3, :3], atol=1e-6)
    assert not set(by_torc.scores) & {0.11, 0.22}
    assert by_torc.scores.min() > 0.5


@pytest.mark.parametrize(
    "bad",
    [
        _above(-0.01),
        _above(0.002),
        _above(0.07, y=-0.14),
        _above(0.07, y=0.4),
        _above(0.13),
        _above(0.02, x=0.62) @ make_pose(None, [0.03, 0, 0]),
        make_pose(DOWN @ np.diag([1.0, -1, -1]), [0.62, -0.10, 1.12]),
        make_pose(np.eye(3), [0.62, -0.10, 1.05]),
        make_pose(DOWN, [50.0, 0.0, 0.0]),
    ],
    ids=[
        "below the table",
        "on it",
        "a finger in the box",
        "nothing between",
        "above it",
        "shifted",
        "upwards",
        "flat",
        "far",
    ],
)
def test_a_grasp_that_cannot_be_is_left_out_and_the_others_stay(network, view, bad):
    found = _plan(network.planner([bad, _above(0.07)], [0.05, 0.05], [0.99, 0.5]), view)
    assert len(found) == 1
    np.testing.assert_allclose(found.Ts_world_tcp[0, :3, 3], _above(0.07)[:3, 3], atol=2e-3)


def test_none_of_many_random_poses_breaks_a_rule(network, view, rays, gripper, table_z):
    """Each grasp that comes through, looked at by itself: boxes of the open gripper against the points it was given."""
    Ts = rays(300)
    Ts[:, :3, 3] = np.random.default_rng(1).uniform([0.56, -0.16, 1.05], [0.68, -0.04, 1.18], (300, 3))
    Ts = np.concatenate([Ts, [_above(h) for h in (0.03, 0.05, 0.07)]])
    found = _plan(network.planner(Ts, np.full(len(Ts), 0.05), np.full(len(Ts), 0.5)), view)
    assert 3 <= len(found) < 60
    own = view.scene.object(0).points.astype(float)
    open_m = gripper.max_width_m
    for T, width in zip(found.Ts_world_tcp, found.widths_m):
        opened = T @ invert(gripper.T_tool0_tcp(width)) @ gripper.T_tool0_tcp(open_m)
        local = (own - opened[:3, 3]) @ opened[:3, :3]
        # Boxes beside the middle hold links that lean, and much air.
        palm = [b for b in gripper.palm_boxes(open_m) if abs(b.center[0]) < 1e-6]
        for b in (*gripper.finger_boxes(open_m), *palm):
            inside = (np.abs(local - b.center) < b.half_size - 3e-3).all(axis=1)
            assert not inside.any()
            corners = (
                np.array(np.meshgrid(*zip(b.center - b.half_size, b.center + b.half_size))).reshape(3, -1).T
            )
            assert (corners @ opened[:3, :3].T + opened[:3, 3])[:, 2].min() > table_z
        closed = (own - T[:3, 3]) @ T[:3, :3]
        between = (
            (np.abs(closed[:, 0]) < width / 2 + 4e-3) & (np.abs(closed[:, 1]) < 0.012) & (closed[:, 2] < 0)
        )
        assert between.sum() >= 6


def test_a_width_that_is_told_counts_and_hides_nothing(gripper, server_of, table_z, view):
    cgn = Cgn(gripper, server_of, table_z)
    found = _plan(cgn.planner([_above(0.07)], [0.058], [0.8]), view)
    assert found.widths_m.tolist() == [0.058]
    # A width of a metre, or none at all, does not let fingers into the object.
    for width in (1.0, 0.0):
        beside = [_above(0.07, y=-0.14), _above(0.07, y=-0.065)]
        assert len(_plan(cgn.planner(beside, [width, width], [0.8, 0.8]), view)) == 0


def test_where_no_width_is_told_it_is_measured(gripper, server_of, table_z, view):
    told = Cgn(gripper, server_of, table_z).planner([_above(0.07)], [NAN], [0.8])
    assert _plan(told, view).widths_m[0] == pytest.approx(0.05, abs=4e-3)


def test_without_grasps_there_are_none(network, view):
    found = _plan(network.planner(np.zeros((0, 4, 4)), np.zeros(0), np.zeros(0)), view)
    assert len(found) == 0
    assert found.Ts_world_tcp.shape == (0, 4, 4)


def test_where_nothing_is_in_sight_nobody_is_asked(network):
    def never(asked):
        raise AssertionError("asked about an empty table")

    assert len(_plan(network.asking(never), view_of())) == 0


def test_only_the_most_confident_are_examined(network, view):
    Ts = [_above(0.03), _above(0.05), _above(0.07)]
    found = _plan(network.planner(Ts, np.full(3, 0.05), [0.3, 0.9, 0.2], max_grasps=1), view)
    np.testing.assert_allclose(found.Ts_world_tcp[:, 2, 3], [1.10], atol=2e-3)


def test_a_grasp_belongs_to_the_object_that_the_server_says(gripper, server_of, table_z, view):
    cgn = Cgn(gripper, server_of, table_z)

    def of_the_other(asked):
        hand = along_axes(invert(asked["T_world_camera"]) @ [_above(0.07)], np.array([[0, 0, -PANDA_TIP_M]]))
        return {"grasps": hand, "confidences": [0.8], "widths": np.array([0.05]), "object_ids": np.array([1])}

    assert len(_plan(cgn.planner([_above(0.07)], [0.05], [0.8]), view)) == 1
    assert len(_plan(cgn.asking(of_the_other), view)) == 0


POSE = make_pose(DOWN, [0.62, -0.1, 1.3])[None]


@pytest.mark.parametrize(
    "answer",
    [
        {},
        {"error": "out of memory"},
        {"grasps": POSE},
        {"grasps": POSE, "confidences": [NAN], "object_ids": np.array([0])},
        {"grasps": POSE, "confidences": [0.5, 0.5], "object_ids": np.array([0])},
        {"grasps": POSE * NAN, "confidences": [0.5], "object_ids": np.array([0])},
        {"grasps": np.ones((1, 4, 4)), "confidences": [0.5], "object_ids": np.array([0])},
        {"grasps": POSE[0], "confidences": [0.5], "object_ids": np.array([0])},
    ],
)
def test_nonsense_is_refused(network, view, answer):
    with pytest.raises(NetworkError):
        _plan(network.asking(answer), view)


@pytest.mark.parametrize("owner", [5, -1, 63])
def test_grasps_of_what_is_not_there_are_refused(gripper, server_of, table_z, view, owner):
    answer = {"grasps": POSE, "confidences": [0.5], "object_ids": np.array([owner])}
    with pytest.raises(NetworkError, match=r"was asked for \[0, 1\]"):
        _plan(Cgn(gripper, server_of, table_z).asking(answer), view)


def test_graspgen_is_asked_in_its_own_words(gripper, server_of, table_z, view, told):
    planner = GenX(gripper, server_of, table_z).asking(
        {"grasps": np.zeros((0, 4, 4))}, num_grasps=50, max_points=400
    )
    _plan(planner, view)
    asked = told["infer"]
    words = {
        "num_grasps": 50,
        "topk_num_grasps": 100,
        "grasp_threshold": -1.0,
        "min_grasps": 40,
        "max_tries": 6,
    }
    assert {k: asked[k] for k in words} == words
    assert asked["remove_outliers"] is True
    assert asked["point_cloud"].dtype == np.float32
    assert 200 < len(asked["point_cloud"]) <= 400
    seen = {tuple(p) for p in view.scene.object(1).points.tolist()}
    assert {tuple(p) for p in asked["point_cloud"].tolist()} <= seen
    assert asked["gripper"]["sweep_volume"]["extents"][0] == pytest.approx(0.085)
    _plan(GenX(gripper, server_of, table_z).asking({"grasps": np.zeros((0, 4, 4))}, describe=False), view)
    assert set(told["infer"]) == {"point_cloud", "remove_outliers", *words}


def test_another_grippers_fingertip_counts_where_the_user_gives_it(gripper, server_of, table_z, view):
    base = _above(0.07) @ make_pose(None, [-0.01, -0.005, -0.2])
    answer = {"grasps": base[None], "confidences": [0.5]}
    planner = GenX(gripper, server_of, table_z).asking(
        lambda asked: answer if asked["point_cloud"][:, 1].mean() < 0 else {"grasps": []},
        fingertip_m=(0.01, 0.005, 0.2),
    )
    np.testing.assert_allclose(_plan(planner, view).Ts_world_tcp[0], _above(0.07), atol=1e-6)


def test_contact_graspnet_gets_the_scene_in_the_camera_frame(gripper, server_of, table_z, view, told):
    _plan(Cgn(gripper, server_of, table_z).asking({"grasps": [], "object_ids": []}), view)
    asked = told["grasps"]
    points, ids = asked["point_cloud"].astype(float), asked["object_ids"]
    assert (points[:, 2] > 0.2).all()
    K, rows_cols = view.scene.observation.K, view.scene.object(0).pixels
    own = points[ids == 0]
    np.testing.assert_allclose(own[:, 0] / own[:, 2] * K[0, 0] + K[0, 2], rows_cols[:, 1], atol=0.05)
    np.testing.assert_allclose(own[:, 1] / own[:, 2] * K[1, 1] + K[1, 2], rows_cols[:, 0], atol=0.05)
    assert set(ids.tolist()) == {-1, 0, 1}
    assert points[ids == -1, 2].max() < 1.8
    np.testing.assert_array_equal(asked["T_world_camera"], view.scene.observation.T_world_camera)
