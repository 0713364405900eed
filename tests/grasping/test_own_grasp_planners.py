"""Grasp planners of somebody else's: what is made of good ones, and what is said of bad ones."""

from dataclasses import replace

import numpy as np
import pytest

from torc.errors import GraspPlannerError, InputError, UnknownNameError
from torc.grasping.geometric_planner import GeometricGraspPlanner
from torc.grasping.protocol import ask_grasp_planner, grasp_faults
from torc.pipeline.building import make_stage
from torc.registry.context import BuildContext
from torc.robots.loading import load_robot
from torc.specs.conditions import Conditions
from torc.testing import contexts
from torc.testing.conformance import NonConformanceError
from torc.testing.grasp_conformance import CASES, check_grasp_planner

GRIPPER, TABLE_Z = load_robot().gripper, 1.05
CONTEXT = contexts.open_context()


class Stated:
    """Returns what it was given."""

    result = CONTEXT.grasps

    def plan(self, scene, volume, rng):
        return self.result


class Wants:
    def __init__(self, support_z_m):
        self.support_z_m = support_z_m

    plan = Stated.plan


class Needs:
    def __init__(self, network):
        pass

    plan = Stated.plan


class Mute:
    pass


class Crashing:
    def plan(self, scene, volume, rng):
        raise RuntimeError("no GPU")


def make_grasp_planner(name, gripper, support_z_m):
    return make_stage(
        Conditions(grasps=name), "grasps", BuildContext(gripper=gripper, support_z_m=support_z_m)
    )


def _asked(result):
    planner = Stated()
    planner.result = result
    return ask_grasp_planner(planner, CONTEXT.scene, CONTEXT.volume, np.random.default_rng(0))


def test_names_and_classes_make_grasp_planners():
    assert isinstance(make_grasp_planner("geometric", GRIPPER, TABLE_Z), GeometricGraspPlanner)
    assert make_grasp_planner(f"{__name__}:Wants", GRIPPER, TABLE_Z).support_z_m == TABLE_Z
    assert isinstance(make_grasp_planner(f"{__name__}:Stated", GRIPPER, TABLE_Z), Stated)
    with pytest.raises(UnknownNameError, match="Did you mean 'geometric'"):
        make_grasp_planner("geometrc", GRIPPER, TABLE_Z)
    for name, told in (("Mute", "needs a method `plan"), ("Needs", "network")):
        with pytest.raises(InputError, match=told):
            make_grasp_planner(f"{__name__}:{name}", GRIPPER, TABLE_Z)


@pytest.mark.usefixtures("any_arrays")
def test_good_grasps_pass_as_they_are_and_in_arrays_that_kernels_take():
    assert _asked(CONTEXT.grasps).object_ids.tolist() == CONTEXT.grasps.object_ids.tolist()
    odd = replace(
        CONTEXT.grasps,
        Ts_world_tcp=np.asfortranarray(CONTEXT.grasps.Ts_world_tcp.astype(np.float32)),
        object_ids=CONTEXT.grasps.object_ids.astype(np.int64),
        generators=CONTEXT.grasps.generators.astype(int),
    )
    taken = _asked(odd)
    assert taken.Ts_world_tcp.dtype == float
    assert taken.Ts_world_tcp.flags.c_contiguous
    assert (taken.object_ids.dtype, taken.generators.dtype) == (np.int16, np.uint8)
    assert taken.Ts_world_tcp == pytest.approx(CONTEXT.grasps.Ts_world_tcp, abs=1e-6)


def _turned(Ts):
    return np.concatenate([2 * Ts[:, :3], Ts[:, 3:]], axis=1)


GOOD = CONTEXT.grasps


@pytest.mark.usefixtures("any_arrays")
@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"object_ids": np.full(len(GOOD), 9, np.int16)}, "objects \\[9\\]"),
        ({"scores": GOOD.scores + 1}, "probabilities"),
        ({"scores": GOOD.scores.tolist()}, "scores must be an array"),
        ({"widths_m": -GOOD.widths_m}, "negative"),
        ({"widths_m": GOOD.widths_m[:-1]}, "widths_m must be an array of shape"),
        ({"widths_m": np.full(len(GOOD), np.nan)}, "widths_m must be finite"),
        ({"object_ids": GOOD.object_ids.astype(float)}, "whole numbers"),
        ({"Ts_world_tcp": _turned(GOOD.Ts_world_tcp)}, "rigid"),
        ({"Ts_world_tcp": GOOD.Ts_world_tcp[:, :3]}, "Ts_world_tcp must be an array of shape"),
        ({"contacts": GOOD.contacts[:, 0]}, "contacts must be an array of shape"),
        ({"generators": GOOD.generators + 5}, "indices into generator_names"),
        ({"generator_names": "mine"}, "tuple of names"),
    ],
)
def test_what_is_wrong_with_grasps_is_said(change, told):
    with pytest.raises(GraspPlannerError, match=told) as caught:
        _asked(replace(GOOD, **change))
    assert "Stated" in str(caught.value)


def test_a_planner_that_crashes_or_returns_something_else_is_to_blame():
    with pytest.raises(GraspPlannerError, match="returned None"):
        _asked(None)
    with pytest.raises(GraspPlannerError, match=r"Crashing failed with RuntimeError: no GPU"):
        ask_grasp_planner(Crashing(), CONTEXT.scene, CONTEXT.volume, np.random.default_rng(0))


def test_no_grasps_at_all_are_grasps():
    none = GeometricGraspPlanner(GRIPPER, TABLE_Z).plan(
        contexts.empty_context().scene, CONTEXT.volume, np.random.default_rng(0)
    )
    assert list(grasp_faults(none, CONTEXT.scene)) == []


def test_the_shipped_planner_conforms():
    check_grasp_planner(GeometricGraspPlanner, CASES[:2])


def test_the_suite_finds_what_no_run_would_show_at_once():
    def keeps(scene):
        """Grasps that the first case can have: all for its object 1."""
        return replace(GOOD, object_ids=np.full(len(GOOD), 1, np.int16))

    class Unsorted:
        def plan(self, scene, volume, rng):
            return replace(keeps(scene), scores=keeps(scene).scores[::-1].copy())

    class Fickle:
        def plan(self, scene, volume, rng):
            return replace(keeps(scene), widths_m=np.full(len(GOOD), next(numbers) / 1000))

    class Careless:
        def plan(self, scene, volume, rng):
            np.random.random()
            return keeps(scene)

    class Rude:
        def plan(self, scene, volume, rng):
            scene.objects[0].points[0] += 1
            return keeps(scene)

    numbers = iter(range(1, 99))
    faults = (
        (Unsorted, "not sorted"),
        (Fickle, "two different sets"),
        (Careless, "global random"),
        (Rude, "changed"),
    )
    for make, told in (*faults, (Crashing, "RuntimeError")):
        with pytest.raises(NonConformanceError, match=told):
            check_grasp_planner(make, CASES[:1])
