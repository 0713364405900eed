"""Which points an arm reaches."""

import numpy as np

from torc.robots.ik import reached
from torc.robots.loading import load_robot


def test_where_the_fingertips_are_they_reach():
    robot = load_robot("ur5e_2f85")
    base = robot.arm.T_world_base[:3, 3]
    points = base + np.array([[0.4, 0.1, 0.2], [0.5, 0.0, 0.1], [3.0, 0.0, 0.2]])
    assert reached(robot, points).tolist() == [True, True, False]


def test_reach_is_bounded_by_the_sphere_around_the_base():
    robot = load_robot("panda_hand")
    far = robot.arm.T_world_base[:3, 3] + 1.5 * np.eye(3)
    assert not reached(robot, far).any()
