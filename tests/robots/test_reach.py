"""Which points an arm reaches."""

import numpy as np

from torc.robots.loading import load_robot
from torc.robots.reach import APPROACHES, approaches_that_reach


def test_where_the_fingertips_are_they_reach():
    robot = load_robot("ur5e_2f85")
    base = robot.arm.T_world_base[:3, 3]
    points = base + np.array([[0.4, 0.1, 0.2], [0.5, 0.0, 0.1], [3.0, 0.0, 0.2]])
    counts = approaches_that_reach(robot, points)
    assert (counts[:2] == APPROACHES).all()
    assert counts[2] == 0


def test_reach_is_bounded_by_the_sphere_around_the_base():
    robot = load_robot("panda_hand")
    far = robot.arm.T_world_base[:3, 3] + 1.5 * np.eye(3)
    assert not approaches_that_reach(robot, far).any()
