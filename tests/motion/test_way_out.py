"""An arm that stands in contact gets out of it, and never deeper into it."""

from dataclasses import replace

import numpy as np
import pytest

from torc.collision.contacts import robot_arrays
from torc.geometry.transforms import invert, make_pose
from torc.motion.space import free_space, loosened
from torc.motion.timed_motions import way_out
from torc.records import PickPlan
from torc.robots.ik import solve_ik


@pytest.fixture(scope="module")
def space(robot, request_for):
    limits = robot.arm.lower, robot.arm.upper
    world = request_for(0)[0].world
    empty = replace(world, kind=np.zeros_like(world.kind))
    return free_space(robot_arrays(robot), empty, 0.085, limits, robot.arm.max_speed)


@pytest.fixture(scope="module")
def pressed(robot, workspace, space):
    """Configurations with the fingertips at a height above the table, straight down, else free."""

    def at(height_m):
        T = make_pose(np.diag([1.0, -1.0, -1.0]), (0.55, -0.30, workspace.support_z_m + height_m))
        q = solve_ik(robot.arm, (T @ invert(robot.gripper.T_tool0_tcp(0.085)))[None]).of(0)
        return q[~loosened(space, 0.02 + max(0.0, -height_m)).collides(q)]

    return at


@pytest.mark.parametrize("height_m", [0.001, -0.004, -0.012])
def test_the_way_out_ends_free_and_leads_no_deeper(space, pressed, height_m):
    starts = pressed(height_m)[:5]
    assert len(starts)
    for start in starts:
        assert space.collides(start[None])[0]
        out = way_out(space, start, np.random.default_rng(0))
        assert out is not None
        assert not space.collides(out[None])[0]
        line = start + np.linspace(0, 1, 50)[:, None] * (out - start)
        assert not loosened(space, 0.012 - height_m).collides(line).any()
        np.testing.assert_array_equal(out, way_out(space, start, np.random.default_rng(0)))


def test_a_free_start_stays_and_a_deep_one_has_no_way_out(robot, space, pressed):
    rest = robot.arm.rest_qpos
    assert way_out(space, rest, np.random.default_rng(0)) is rest
    assert way_out(space, pressed(-0.08)[0], np.random.default_rng(0)) is None


def test_a_pick_is_planned_from_where_the_arm_presses_on_the_table(planner, request_for, pressed):
    start = pressed(-0.003)[0]
    plan = planner.plan_pick(replace(request_for(0)[0], qpos_start=start), np.random.default_rng(0))
    assert isinstance(plan, PickPlan), plan
    np.testing.assert_allclose(plan.free.qpos[0], start, atol=1e-12)
    assert np.all(np.diff(plan.free.times_s) > 0)
    np.testing.assert_allclose(plan.free.qpos[-1], plan.approach.qpos[0], atol=1e-9)
