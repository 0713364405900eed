"""What the gripper holds is found in a picture, by where the arm is, whatever the depth."""

from dataclasses import replace

import numpy as np
import pytest
from sim_scenes import standing, world_of
from test_robot import ROBOT, plan_for

from torc.perception.in_hand import held_mask
from torc.perception.stereo import SgbmDepth
from torc.records import PickResult
from torc.sim.robot import SimulatedRobot, SimulatedRobotConfig


@pytest.mark.parametrize(("rough", "least"), [(False, 0.75), (True, 0.6)])
def test_the_held_object_and_nothing_else(rough, least):
    world = world_of(
        standing("target", "carton", 0.62, -0.15), standing("other", "soup_can_red", 0.62, -0.05), robot=ROBOT
    )
    robot = SimulatedRobot(world, SimulatedRobotConfig(pairs=rough))

    def measured(observation):
        return SgbmDepth().measure(observation) if rough else observation

    before = measured(robot.capture())
    agreement = []

    def is_target(observation, width_m):
        seen = measured(observation)
        mask = held_mask(replace(seen, label_image=None), before.depth_m, ROBOT, width_m, rough)
        true = observation.label_image == 0
        agreement.append(np.count_nonzero(mask & true) / np.count_nonzero(mask | true))
        return False

    outcome = robot.execute(plan_for(world, 0), is_target=is_target)
    assert len(agreement) == 1
    assert agreement[0] > least
    assert outcome.result is PickResult.RETRIEVED
    assert outcome.felt.result is PickResult.REMOVED
    # The hand is at rest, far from everything.
    assert not held_mask(measured(robot.capture()), before.depth_m, ROBOT, 0.04, rough).any()
