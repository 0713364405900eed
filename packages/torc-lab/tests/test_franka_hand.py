"""A Franka hand over rosbridge: its actions and its fingers' positions, and what goes wrong."""

import numpy as np
import pytest

from lab_helpers.behind_twins import ObedientArm, TimedFingers
from torc.errors import InputError
from torc.robots.protocols import Gripper
from torc_lab.protocols import LabError
from torc_lab.robotiq.gripper import WidthScale
from torc_lab.ros.arm import RosArm, RosArmConfig
from torc_lab.ros.franka_hand import FrankaHand, FrankaHandConfig
from torc_lab.twin.franka import FrankaHandTwin
from torc_lab.twin.ros import RosTwin

pytest.importorskip("websockets", reason="websockets is not installed")
SCALE = WidthScale(max_width_m=0.08)


@pytest.fixture
def there():
    fingers = TimedFingers()
    twin = FrankaHandTwin(fingers, 0.08)
    with RosTwin(ObedientArm(np.zeros(7)), [f"j{i}" for i in range(7)], hand=twin) as bridge:
        hand = FrankaHand(FrankaHandConfig(bridge.url, timeout_s=2.0))
        yield fingers, bridge, hand
        hand.disconnect()


def goals(bridge):
    return [(r["action"], r["action_type"], r["args"]) for r in bridge.heard if r["op"] == "send_action_goal"]


def test_it_opens_to_any_width_and_tells_it(there):
    _, bridge, hand = there
    assert isinstance(hand, Gripper)
    for width_m in (0.08, 0.03, 0.0, 0.05):
        state = hand.open(width_m)
        assert state.width_m == pytest.approx(width_m, abs=0.0005)
        assert not state.holding
    kind = "franka_msgs/action/Move"
    assert goals(bridge)[1] == ("/franka_gripper/move", kind, {"width": 0.03, "speed": 0.1})


def test_what_is_between_its_fingers_is_held_until_it_drops(there):
    fingers, bridge, hand = there
    hand.open(0.08)
    fingers.object_at = SCALE.count(0.042)
    state = hand.close(200.0)
    assert state.holding
    assert state.width_m == pytest.approx(0.042, abs=0.0005)
    action, kind, args = goals(bridge)[-1]
    assert (action, kind) == ("/franka_gripper/grasp", "franka_msgs/action/Grasp")
    assert args["force"] == 70.0  # no more than it can for long
    fingers.object_at = None
    assert not hand.close(50.0).holding
    assert not hand.open(0.08).holding


def test_homing_moves_its_fingers_all_the_way(there):
    _, bridge, hand = there
    hand.activate()
    assert goals(bridge)[-1][:2] == ("/franka_gripper/homing", "franka_msgs/action/Homing")
    assert hand.state.width_m == pytest.approx(0.08, abs=0.0005)


def test_an_action_that_fails_is_no_pick_that_failed(there):
    _, bridge, hand = there
    bridge._hand.fault = 1
    with pytest.raises(LabError, match=r"move: aborted: libfranka"):
        hand.open(0.02)
    bridge._hand.fault = 0
    bridge.silent = True
    with pytest.raises(LabError, match="no message on /franka_gripper/joint_states"):
        hand.open(0.02)
    bridge.cut()
    with pytest.raises(LabError, match="is lost"):
        hand.close(50.0)


def test_wishes_it_cannot_have(there):
    *_, hand = there
    with pytest.raises(InputError, match="opens 0 to"):
        hand.open(0.09)
    with pytest.raises(InputError, match="must be positive"):
        hand.close(0.0)
    with pytest.raises(InputError, match="above 0"):
        FrankaHandConfig("ws://x", speed_m_s=0.0)


def test_a_node_of_another_name_is_named(there):
    _, bridge, _ = there
    # Its joint states are taken for the arm's: seven numbers are no fingers.
    with pytest.raises(LabError, match="not the positions of two fingers"):
        FrankaHand(FrankaHandConfig(bridge.url, name="/panda_gripper", timeout_s=0.5))


@pytest.mark.parametrize(
    ("fault", "words"), [({"e_stopped": 1}, "e-stop"), ({"in_error": 1}, "protective stop"), ({}, "")]
)
def test_a_ur_tells_its_safety_mode(there, fault, words):
    _, bridge, _ = there
    topic = "/io_and_status_controller/safety_mode"
    config = RosArmConfig(
        bridge.url, 2, bridge.action, tuple(bridge.joint_names), "/joint_states", topic, "ur"
    )
    if fault:
        bridge.halt(**fault)
    arm = RosArm(config)
    assert arm.status().stopped == words
    arm.close()
