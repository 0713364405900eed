"""torc's own grasp planner behind a server, in the frames of the networks that it stands in for."""

import numpy as np
import pytest

from tests.helpers.marks import long
from torc.errors import InputError
from torc.grasping.geometric_planner import GeometricGraspPlanner
from torc.pipeline.building import make_stage
from torc.registry.context import BuildContext
from torc.specs.conditions import PipelineSpec
from torc.testing.grasp_conformance import CASES, check_case
from torc_networks.grasping.planners import (
    ContactGraspNetConfig,
    ContactGraspNetPlanner,
    GraspGenXConfig,
    GraspGenXPlanner,
)
from torc_networks.serving.handlers import scene_of_points

NAN = float("nan")


def _plan(planner, view, seed=0):
    return planner.plan(view.scene, view.volume, np.random.default_rng(seed))


@pytest.mark.parametrize("case", CASES[:3] + CASES[5:], ids=lambda case: case.name)
@pytest.mark.parametrize("stage", [GraspGenXPlanner, *long(ContactGraspNetPlanner)])
def test_it_conforms_with_torcs_own_planner_behind_the_server(stage, case, gripper, server_of, own_parts):
    server = server_of(infer=own_parts.infer, grasps=own_parts.grasps)
    config = GraspGenXConfig if stage is GraspGenXPlanner else ContactGraspNetConfig

    def make(gripper, support_z_m):
        return stage(gripper, support_z_m, config(server=server))

    check_case(make, case)


@pytest.mark.parametrize("stage", ["graspgenx", "contact-graspnet"])
def test_what_torcs_own_planner_proposes_behind_a_server_comes_back_as_it_was(
    stage, gripper, server_of, table_z, view, monkeypatch, own_parts
):
    """There into the network's frame and back."""
    proposed = []
    plan = GeometricGraspPlanner.plan

    def spied(self, scene, volume, rng):
        found = plan(self, scene, volume, rng)
        if type(self) is GeometricGraspPlanner:
            proposed.append(found)
        return found

    monkeypatch.setattr(GeometricGraspPlanner, "plan", spied)
    server = server_of(infer=own_parts.infer, grasps=own_parts.grasps)
    made = {
        "graspgenx": (GraspGenXPlanner, GraspGenXConfig),
        "contact-graspnet": (ContactGraspNetPlanner, ContactGraspNetConfig),
    }
    planner, config = made[stage]
    found = _plan(planner(gripper, table_z, config(server=server)), view)
    assert len(found) > 10
    Ts = np.concatenate([p.Ts_world_tcp for p in proposed])
    widths = np.concatenate([p.widths_m for p in proposed])
    for T, width in zip(found.Ts_world_tcp, found.widths_m):
        k = np.abs(Ts - T).max(axis=(1, 2)).argmin()
        np.testing.assert_allclose(T, Ts[k], atol=1e-6)
        assert width == pytest.approx(widths[k], abs=1e-6)


@pytest.mark.parametrize(
    "wrong",
    [
        {},
        {"point_cloud": np.zeros((5, 2))},
        {"point_cloud": np.full((5, 3), NAN), "object_ids": np.zeros(5, int)},
        {"point_cloud": np.zeros((5, 3)), "object_ids": np.full(5, 64), "T_world_camera": np.eye(4)},
        {"point_cloud": np.zeros((5, 3)), "object_ids": np.zeros(4, int), "T_world_camera": np.eye(4)},
    ],
    ids=range(5),
)
def test_torcs_own_server_refuses_bad_requests(wrong, own_parts):
    with pytest.raises(InputError):
        own_parts.grasps(wrong)


def test_normals_of_bare_points_are_those_that_were_seen(view):
    o, T = view.scene.object(0), view.scene.observation.T_world_camera
    scene = scene_of_points(o.points, np.zeros(len(o.points), int), T)
    cosines = np.einsum("ij,ij->i", scene.objects[0].normals, o.normals)
    assert np.median(cosines) > 0.99
    assert (cosines > 0).mean() > 0.97
    few = scene_of_points(o.points[:9], np.zeros(9, int), T)
    assert few.ids == ()


def test_they_are_made_by_name_and_settings(gripper, table_z):
    settings = {
        "grasps.num_grasps": 9,
        "grasps.checks.table_margin_m": 0.01,
        "grasps.fingertip_m": [0, 0, 0.2],
    }
    spec = PipelineSpec(grasps="graspgenx", settings=settings)
    made = make_stage(spec, "grasps", BuildContext(gripper=gripper, support_z_m=table_z))
    assert (made.asked.num_grasps, made.config.checks.table_margin_m) == (9, 0.01)
    assert made.asked.fingertip_m == (0, 0, 0.2)
    spec = PipelineSpec(grasps="contact-graspnet", settings={"grasps.score": "network"})
    assert (
        make_stage(spec, "grasps", BuildContext(gripper=gripper, support_z_m=table_z)).asked.score
        == "network"
    )


@pytest.mark.parametrize("wrong", [{"score": "best"}, {"max_points": 0}, {"max_grasps": 0}])
def test_settings_without_sense_are_refused(wrong):
    with pytest.raises(InputError):
        GraspGenXConfig(**wrong)
