"""A robot of real devices: what it feels, and sees in the hand, is all that is known."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from test_supervisor import motion
from tests.helpers.fake_robot import FakeArm, FakeGripper
from torc.records import PickPlan, PickResult, Trajectory
from torc.robots.protocols import KnowsObjects, Robot
from torc.testing.synthetic import synthetic_observation
from torc_lab.robot import LabRobot

REST = np.zeros(3)
STOPS = [0.0, 0.3, 0.4, 0.3, 0.6, 0.0]
"""Where the first joint is after each motion of a pick."""


class FakeCamera:
    def capture(self):
        return synthetic_observation(())


def plan(object_id):
    motions = []
    for a, b in pairwise(STOPS):
        begin = motion(REST, by=b - a)
        path = begin.qpos + np.array([a, 0, 0])
        motions.append(Trajectory(begin.times_s, path, begin.qvel))
    return PickPlan(object_id, 0, np.eye(4), 0.04, *motions, grasps_tried=1)


def robot_of(description, width_m=0.05):
    return LabRobot(description, FakeCamera(), FakeArm(REST.copy()), FakeGripper(width_m))


def test_a_pick_is_told_as_it_was_felt(robot):
    lab = robot_of(robot)
    assert isinstance(lab, Robot)
    np.testing.assert_array_equal(lab.capture().observation.qpos, REST)
    outcome = lab.execute(plan(3))
    assert (outcome.result, outcome.held_id, outcome.delivered) == (PickResult.REMOVED, 3, True)
    assert outcome.as_felt.result is PickResult.REMOVED
    assert not outcome.wrong_object
    assert lab.execute(replace(plan(3), is_target=True)).result is PickResult.RETRIEVED
    missed = robot_of(robot, None).execute(plan(3))
    assert (missed.result, missed.held_id) == (PickResult.MISSED, None)


def test_what_is_in_the_hand_is_looked_at_where_the_arm_holds_it(robot):
    lab, seen = robot_of(robot), []

    def is_target(observation, width_m):
        seen.append((observation.qpos.copy(), width_m))
        return True

    assert lab.execute(plan(3), is_target=is_target).result is PickResult.RETRIEVED
    np.testing.assert_allclose(seen[0][0], [STOPS[3], 0, 0], atol=1e-9)
    assert seen[0][1] == pytest.approx(0.05)


def test_nobody_tells_it_the_truth(robot):
    assert not isinstance(robot_of(robot), KnowsObjects)
