"""The course of a pick on an arm and a gripper that obey at once, and whatever may go wrong."""

from itertools import pairwise

import numpy as np
import pytest

from tests.helpers.fake_robot import FakeArm, FakeGripper
from torc.records import PickPlan, PickResult, Trajectory
from torc.robots.execution import ExecutionConfig, Phase, execute_pick, reverse, starting_from
from torc.robots.protocols import ContactGuard

REST, PRE, GRASP, UP, BIN = (
    np.array(q, dtype=float) for q in ([0, 0, 0], [1, 0, 0], [1.1, 0, 0.1], [1.1, 0, 0], [0, 1, 0])
)


def motion(a, b, duration_s=1.0, n=101):
    """Smooth from rest to rest."""
    t = np.linspace(0, duration_s, n)
    s = t / duration_s
    path = 3 * s**2 - 2 * s**3
    rate = 6 * s * (1 - s) / duration_s
    return Trajectory(t, a + path[:, None] * (b - a), rate[:, None] * (b - a))


def plan(is_target=False):
    motions = [motion(a, b) for a, b in pairwise([REST, PRE, GRASP, UP, BIN, REST])]
    return PickPlan(3, 0, np.eye(4), 0.04, *motions, grasps_tried=1, is_target=is_target)


def run(arm, gripper, is_target=False, config=None):
    return execute_pick(arm, gripper, plan(is_target), config)


def phases(trace):
    return [p.phase for p in trace.phases]


@pytest.mark.parametrize(("is_target", "result"), [(True, PickResult.RETRIEVED), (False, PickResult.REMOVED)])
def test_all_goes_well(is_target, result):
    arm, gripper = FakeArm(REST), FakeGripper()
    trace = run(arm, gripper, is_target)
    assert trace.result is result
    assert phases(trace) == [
        Phase.OPEN, Phase.FREE, Phase.APPROACH, Phase.CLOSE, Phase.LIFT, Phase.TRANSFER, Phase.RELEASE, Phase.HOME
    ]  # fmt: skip
    assert trace.held_after_lift
    assert trace.delivered
    assert trace.at_home
    assert gripper.commands == [("open", 0.085), ("close", 50.0), ("open", 0.085)]
    np.testing.assert_allclose(arm.qpos, REST)


def test_guards():
    arm = FakeArm(REST)
    guard = ContactGuard(max_force_n=7.0)
    run(arm, FakeGripper(), config=ExecutionConfig(free_guard=None, approach_guard=guard))
    assert arm.guards == [None, guard, None, None, None]


def test_nothing_between_the_fingers():
    arm, gripper = FakeArm(REST), FakeGripper(object_width_m=None)
    trace = run(arm, gripper)
    assert trace.result is PickResult.MISSED
    # An empty hand never goes back down.
    assert phases(trace)[-4:] == [Phase.LIFT, Phase.TRANSFER, Phase.RELEASE, Phase.HOME]
    assert not trace.held_after_lift
    assert trace.at_home
    np.testing.assert_allclose(arm.qpos, REST)


def test_slips_on_the_way_to_the_bin():
    # Looks at the state: after closing, after the lift twice, then no more before it is gone.
    trace = run(FakeArm(REST), FakeGripper(loses_after=3))
    assert trace.result is PickResult.SLIPPED
    assert trace.held_after_lift
    assert not trace.delivered
    assert phases(trace)[-2:] == [Phase.RELEASE, Phase.HOME]


@pytest.mark.parametrize(("number", "result"), [(0, PickResult.NOT_REACHED), (1, PickResult.STOPPED)])
def test_stopped_before_the_grasp(number, result):
    """The arm goes back the way it came, in reverse order, never closing the gripper."""
    arm, gripper = FakeArm(REST, stop_at={number: 0.5}), FakeGripper()
    trace = run(arm, gripper)
    assert trace.result is result
    assert "touched a box" in trace.detail
    assert phases(trace).count(Phase.RETREAT) == number + 1
    assert [c for c, _ in gripper.commands] == ["open"]
    assert trace.at_home
    np.testing.assert_allclose(arm.qpos, REST)


def test_where_the_approach_touched_something_is_remembered():
    guard = ContactGuard(relief_m=0.003)
    for stop_at, touched in (({}, False), ({0: 0.5}, False), ({1: 0.5}, True), ({2: 0.5}, False)):
        trace = run(
            FakeArm(REST, stop_at=stop_at), FakeGripper(), config=ExecutionConfig(approach_guard=guard)
        )
        assert (trace.touch is not None) == touched
        if trace.touch is not None:
            step = trace.phases[phases(trace).index(Phase.APPROACH)]
            np.testing.assert_allclose(trace.touch.qpos, step.qpos)
            assert trace.touch.relief_m == 0.003
            assert trace.touch.width_m == step.gripper.width_m


def test_stopped_just_before_the_grasp_closes_all_the_same():
    arm = FakeArm(REST, stop_at={1: 0.75})
    trace = run(arm, FakeGripper())
    assert trace.result is PickResult.REMOVED
    assert trace.touch is not None
    lift = arm.followed[2]
    np.testing.assert_allclose(lift.qpos[0], plan().approach.qpos[75])
    np.testing.assert_allclose(lift.qpos[-1], UP)


def test_stopped_on_the_way_to_the_bin_puts_it_back():
    arm, gripper = FakeArm(REST, stop_at={3: 0.3}), FakeGripper()
    trace = run(arm, gripper)
    assert trace.result is PickResult.STOPPED
    assert trace.held_after_lift
    release = phases(trace).index(Phase.RELEASE)
    np.testing.assert_allclose(trace.phases[release].qpos, GRASP, atol=1e-9)
    np.testing.assert_allclose(arm.qpos, REST)


def test_stopped_without_contact_during_the_lift():
    arm, gripper = FakeArm(REST, stop_at={2: 0.4}), FakeGripper()
    trace = run(arm, gripper)
    assert trace.result is PickResult.STOPPED
    assert "did not arrive" in trace.detail
    assert gripper.commands[-1][0] == "open"
    np.testing.assert_allclose(arm.qpos, REST)


class TestReverse:
    def test_from_the_end_to_the_start(self):
        back = reverse(motion(REST, PRE), PRE, slowdown=2.0, ramp_s=0.2)
        assert back is not None
        np.testing.assert_allclose(back.qpos[0], PRE)
        np.testing.assert_allclose(back.qpos[-1], REST)
        np.testing.assert_allclose(back.qvel[[0, -1]], 0.0, atol=1e-12)
        assert back.duration_s == pytest.approx(2.1)
        assert np.all(np.diff(back.times_s) > 0)

    @pytest.mark.parametrize("stop", [0.2, 0.5, 0.97])
    def test_velocities_are_those_of_the_path(self, stop):
        there = motion(REST, PRE, n=2001)
        back = reverse(there, there.qpos[int(stop * 2000)], slowdown=1.5, ramp_s=0.2)
        assert back is not None
        rates = np.gradient(back.qpos, back.times_s, axis=0)
        np.testing.assert_allclose(rates[5:-5], back.qvel[5:-5], atol=0.03)
        assert np.abs(back.qvel[0]).max() == 0.0
        assert np.abs(back.qvel).max() <= np.abs(there.qvel).max() / 1.5 + 1e-9


def test_a_bent_motion_starts_where_the_arm_is_and_ends_where_planned():
    there, here = motion(REST, PRE, n=2001), REST + 0.05
    bent = starting_from(there, here)
    np.testing.assert_allclose(bent.qpos[0], here)
    np.testing.assert_allclose(bent.qpos[-1], PRE)
    np.testing.assert_allclose(bent.qvel[[0, -1]], 0.0, atol=1e-12)
    np.testing.assert_allclose(np.gradient(bent.qpos, bent.times_s, axis=0), bent.qvel, atol=5e-3)


def test_a_blocked_way_back_from_the_transfer_ends_the_pick_with_the_object_held():
    wanted = plan()
    # The transfer (motion 3) stops half-way, and so does the way back along it.
    arm, gripper = FakeArm(wanted.free.qpos[0].copy(), stop_at={3: 0.5, 4: 0.2}), FakeGripper()
    trace = execute_pick(arm, gripper, wanted)
    assert trace.result is PickResult.STOPPED
    assert not trace.at_home
    assert len(arm.followed) == 5  # nothing is commanded from off the path
    assert gripper.commands[-1][0] == "close"


@pytest.mark.parametrize("target", [True, False])
@pytest.mark.parametrize("believed", [True, False])
def test_a_look_at_what_is_held_counts_for_more_than_the_plan(believed, target):
    arm, looked_at = FakeArm(REST), []

    def is_target():
        looked_at.append(arm.qpos.copy())
        return target

    trace = execute_pick(arm, FakeGripper(), plan(believed), is_target=is_target)
    assert trace.result is (PickResult.RETRIEVED if target else PickResult.REMOVED)
    np.testing.assert_allclose(looked_at, [UP])


def test_nobody_looks_at_an_empty_hand():
    def is_target():
        raise AssertionError("There is nothing to look at.")

    trace = execute_pick(FakeArm(REST), FakeGripper(object_width_m=None), plan(), is_target=is_target)
    assert trace.result is PickResult.MISSED
