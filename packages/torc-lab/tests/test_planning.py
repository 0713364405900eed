"""Plans that leave a laboratory's limits are none."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from test_lab_robot import plan
from test_supervisor import WIDE
from torc.records import PickPlan, PlanFailure, PlanStage
from torc_lab.checks import limits_of
from torc_lab.planning import LimitedMotionPlanner

POINTS = np.zeros((0, 3), np.float32)
REQUEST = SimpleNamespace(scene=SimpleNamespace(object=lambda object_id: SimpleNamespace(points=POINTS)))


class Planner:
    def __init__(self, answer):
        self.answer = answer

    def plan_pick(self, request, rng):
        return self.answer


@pytest.fixture
def of_robot(robot):
    """A plan whose motions begin at the robot's rest pose."""
    drawn = plan(1)

    def moved(motion):
        path = np.tile(robot.arm.rest_qpos, (len(motion.times_s), 1))
        path[:, 0] += 0.1 * motion.qpos[:, 0]
        rates = np.zeros_like(path)
        rates[:, 0] = 0.1 * motion.qvel[:, 0]
        return replace(motion, qpos=path, qvel=rates)

    return replace(
        drawn, **{n: moved(getattr(drawn, n)) for n in ("free", "approach", "lift", "transfer", "home")}
    )


def answer(robot, limits, drawn):
    return LimitedMotionPlanner(Planner(drawn), robot, limits).plan_pick(REQUEST, np.random.default_rng(0))


def test_what_is_within_the_limits_stays_and_speed_is_no_matter(robot, of_robot):
    assert answer(robot, limits_of(robot, *WIDE, 0.01, 0.01), of_robot) is of_robot
    failure = PlanFailure(PlanStage.LIFT, "no way", 3)
    assert answer(robot, limits_of(robot, *WIDE, 1.0, 0.01), failure) is failure


def test_what_leaves_the_box_or_the_joint_limits_is_no_plan(robot, of_robot):
    low = np.array([0.3, -3, 0])
    told = answer(robot, limits_of(robot, low, WIDE[1], 1.0, 0.01), of_robot)
    assert isinstance(told, PlanFailure)
    assert told.stage is PlanStage.FREE
    assert "workspace" in told.reason
    assert told.grasps_tried == of_robot.grasps_tried
    wide = limits_of(robot, *WIDE, 1.0, 0.01)
    first = robot.arm.rest_qpos[0]
    upper = np.where(np.arange(7) == 0, first + 0.045, wide.upper)
    told = answer(robot, replace(wide, upper=upper), of_robot)
    assert isinstance(told, PlanFailure)
    assert told.stage is PlanStage.TRANSFER
    assert not isinstance(told, PickPlan)
