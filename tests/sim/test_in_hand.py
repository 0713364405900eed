"""What the gripper holds is found in a picture, by where the arm is, whatever the depth."""

from dataclasses import replace

import numpy as np
import pytest
from sim_scenes import standing, world_of
from test_robot import ROBOT, plan_for

from torc.geometry.transforms import invert
from torc.perception import in_hand
from torc.perception.in_hand import held_mask
from torc.perception.stereo import SgbmDepth
from torc.records import PickResult
from torc.robots.kinematics import tcp_pose
from torc.sim.robot import SimulatedRobot, SimulatedRobotConfig


@pytest.mark.parametrize(("rough", "least"), [(False, 0.75), (True, 0.6)])
def test_the_held_object_and_nothing_else(rough, least):
    world = world_of(
        standing("target", "carton", 0.62, -0.15), standing("other", "soup_can_red", 0.62, -0.05), robot=ROBOT
    )
    robot = SimulatedRobot(world, SimulatedRobotConfig(pairs=rough))

    def measured(observation):
        return SgbmDepth().measure(observation) if rough else observation

    before = measured(robot.capture().observation)
    agreement = []

    def is_target(observation, width_m):
        seen = measured(observation)
        mask = held_mask(seen, before.depth_m, ROBOT, width_m, rough)
        true = robot.capture().label_image == 0
        agreement.append(np.count_nonzero(mask & true) / np.count_nonzero(mask | true))
        return False

    outcome = robot.execute(plan_for(world, 0), is_target=is_target)
    assert len(agreement) == 1
    assert agreement[0] > least
    assert outcome.result is PickResult.RETRIEVED
    assert outcome.felt.result is PickResult.REMOVED
    # The hand is at rest, far from everything.
    assert not held_mask(measured(robot.capture().observation), before.depth_m, ROBOT, 0.04, rough).any()


def lifted(check):
    """Calls `check` with the snapshot after a lift, the one of before, and the opening."""
    world = world_of(standing("target", "carton", 0.62, -0.15), robot=ROBOT)
    robot = SimulatedRobot(world)
    before = robot.capture().observation
    robot.execute(plan_for(world, 0), is_target=lambda seen, width_m: bool(check(seen, before, width_m)))


def test_a_long_thing_is_seen_to_its_end():
    found = []

    def check(seen, before, width_m):
        T = invert(seen.T_world_camera)
        tcp = tcp_pose(ROBOT, seen.qpos, width_m)[:3, 3]
        x, y, z = T[:3, :3] @ tcp + T[:3, 3]
        # A rod through the tool centre, across the picture, 2 cm high, in front of everything.
        rows, cols = np.mgrid[: seen.depth_m.shape[0], : seen.depth_m.shape[1]]
        right, down = (
            (cols - seen.K[0, 2]) * z / seen.K[0, 0] - x,
            (rows - seen.K[1, 2]) * z / seen.K[1, 1] - y,
        )
        rod = (np.abs(right) < 0.26) & (np.abs(down) < 0.01)
        rod &= seen.depth_m > z - 0.005
        depth = np.where(rod, np.float32(z), seen.depth_m).astype(np.float32)
        mask = held_mask(replace(seen, depth_m=depth), before.depth_m, ROBOT, width_m)
        far = rod & (np.abs(right) > 0.16)
        found.append(np.count_nonzero(mask & far) / np.count_nonzero(far))

    lifted(check)
    assert found[0] > 0.9


def test_where_colour_leaves_nothing_depth_decides(monkeypatch):
    monkeypatch.setattr(in_hand, "grab_cut", lambda rgb, marks, rounds: np.zeros(marks.shape, bool))
    found = []

    def check(seen, before, width_m):
        by_depth, rough = (held_mask(seen, before.depth_m, ROBOT, width_m, r) for r in (False, True))
        found.append(by_depth.any() and np.array_equal(by_depth, rough))

    lifted(check)
    assert found == [True]
