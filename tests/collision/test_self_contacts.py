"""Parts of the robot that its spheres call apart are apart by its whole geometry."""

from dataclasses import replace

import pytest

from tests.helpers.full_geometry import FullGeometry
from torc.collision.contacts import self_contacts
from torc.robots.loading import load_robot
from torc.robots.names import robot_names

NEAR_M = 0.005


@pytest.mark.parametrize("name", robot_names())
def test_parts_called_apart_are_apart(name, world, rng):
    robot = load_robot(name)
    qpos = rng.uniform(robot.arm.lower, robot.arm.upper, (20_000, robot.arm.dof))
    wider = replace(world, config=replace(world.config, self_padding_m=world.config.self_padding_m + NEAR_M))
    width_m = robot.gripper.max_width_m
    free = ~self_contacts(world, robot, qpos, width_m)
    barely = qpos[free & self_contacts(wider, robot, qpos, width_m)]
    assert len(barely) > 10
    geometry = FullGeometry(robot)
    assert not [
        q.round(3).tolist() for q in barely[:400] if geometry.self_contacts(geometry.place(q, width_m))
    ]
