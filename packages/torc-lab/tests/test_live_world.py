"""The simulator that goes on by itself behind the twins' wires."""

import time

import numpy as np
import pytest

from torc.errors import InputError
from torc.geometry.transforms import invert, make_pose
from torc.problems.problem import load_problem
from torc.robots.ik import solve_ik
from torc_lab.robotiq.registers import Object
from torc_lab.twin.world import LiveWorld


@pytest.fixture(scope="module")
def live(robot, workspace):
    with LiveWorld(load_problem("validation-structured-02"), robot, workspace) as world:
        yield world


def rests_within(live, seconds):
    """What the fingers say once they rest."""
    deadline = time.monotonic() + seconds
    while (found := live.now())[1] is Object.MOVING and time.monotonic() < deadline:
        time.sleep(0.01)
    return found


def labels(live):
    """The simulator's true labels, which no camera of a lab gives."""
    return live.capture().label_image


def test_the_arm_goes_where_it_is_told_and_stays(live, robot):
    goal = robot.arm.rest_qpos + 0.05
    for share in np.linspace(0, 1, 50):
        live.goal(robot.arm.rest_qpos + share * 0.05)
        time.sleep(0.01)
    time.sleep(0.5)
    np.testing.assert_allclose(live.qpos, goal, atol=0.01)


def test_empty_fingers_close_all_the_way_and_open_as_far_as_told(live):
    live.go(255, 255, 128)
    assert live.now()[1] is Object.MOVING
    count, found = rests_within(live, 5)
    assert (found, count) == (Object.AT_POSITION, 230)
    live.go(100, 255, 0)
    count, found = rests_within(live, 5)
    assert found is Object.AT_POSITION
    assert abs(count - 100) <= 3


def test_pictures_show_the_scene_and_nobody_dropped_anything(live):
    first, second = live.capture().observation, live.capture().observation
    assert second.stamp_s >= first.stamp_s
    assert first.rgb.std() > 5
    assert len(np.unique(labels(live))) > 5
    truth = live.truth(after_s=0.0)
    assert truth.in_bin == truth.dropped == ()
    assert not truth.retrieved


def test_a_push_moves_one_object_and_laid_out_again_all_stand_as_before(live):
    before = labels(live)
    pushed = live.disturb()
    time.sleep(0.3)
    moved = labels(live)
    shares = {k: np.mean(moved[before == k] == k) for k in np.unique(before[before >= 0])}
    assert min(shares, key=shares.get) == pushed
    assert shares[pushed] < 0.9
    assert live.disturb(3, 1.5) == 3  # off the table
    live.truth(after_s=1.5)
    with pytest.raises(InputError, match="No such object"):
        live.disturb(3)
    live.reset()
    time.sleep(0.3)
    again = labels(live)
    assert np.mean(again == before) > 0.999
    assert live.truth(after_s=0.0).dropped == ()


@pytest.mark.long
def test_an_arm_that_presses_on_the_table_feels_it(live, robot, workspace):
    assert live.contact_n == 0.0  # from now on it is felt
    down = make_pose(np.diag([1.0, -1, -1]), [0.55, -0.4, workspace.support_z_m - 0.02])
    goal = solve_ik(robot.arm, (down @ invert(robot.gripper.T_tool0_tcp(0.0)))[None]).of(0)[0]
    start, hardest = live.qpos, 0.0
    for share in np.linspace(0, 1, 150):
        live.goal(start + share * (goal - start))
        time.sleep(0.01)
        hardest = max(hardest, live.contact_n)
    assert hardest > 20
    for share in np.linspace(0, 1, 100):
        live.goal(goal + share * (robot.arm.rest_qpos - goal))
        time.sleep(0.01)
    time.sleep(0.3)
    assert live.contact_n < 5
