"""An arm that ROS drives, by rosbridge: both dialects, and what goes wrong."""

import json
import threading
import time
from contextlib import suppress

import numpy as np
import pytest

from lab_helpers.behind_twins import ObedientArm
from test_supervisor import QUICK, motion, supervised
from torc.errors import InputError
from torc_lab.checks import thinned
from torc_lab.protocols import ArmDriver, LabError
from torc_lab.ros.arm import RosArm, RosArmConfig
from torc_lab.ros.messages import (
    JointStates,
    duration,
    goal_message,
    is_moving,
    result_of,
    robot_status_fault,
    ur_safety_fault,
)
from torc_lab.twin.ros import RosTwin

pytest.importorskip("websockets", reason="websockets is not installed")


@pytest.fixture(params=[1, 2])
def twin(request, robot):
    with RosTwin(ObedientArm(robot.arm.rest_qpos), robot.arm.joint_names, request.param) as there:
        yield there


def config(twin, **changed):
    known = {
        "url": twin.url,
        "ros": twin.ros,
        "action": twin.action,
        "joint_names": tuple(twin.joint_names),
        "status_topic": "/robot_status",
        "status": "industrial",
        "timeout_s": 2.0,
    }
    return RosArmConfig(**{**known, **changed})


@pytest.fixture
def arm(twin):
    driver = RosArm(config(twin))
    yield driver
    driver.close()


def test_a_trajectory_goes_to_its_end_after_cancelling_was_proven(arm, twin, robot):
    assert isinstance(arm, ArmDriver)
    goal = robot.arm.rest_qpos + 0.1 * np.eye(7)[0]
    assert supervised(arm, robot).follow(motion(robot.arm.rest_qpos)).reached
    np.testing.assert_allclose(twin.arm.qpos, goal, atol=1e-9)
    ops = [f"{h['op']} {h.get('topic', '')}" for h in twin.heard if "advertise" not in h["op"]]
    begin, cancel = (
        ("send_action_goal ", "cancel_action_goal ")
        if twin.ros == 2
        else (f"publish {twin.action}/goal", f"publish {twin.action}/cancel")
    )
    assert ops == [begin, cancel, begin]
    assert supervised(arm, robot).follow(motion(goal, joint=3)).reached
    assert len([h for h in twin.heard if "advertise" not in h["op"]]) == 4


def test_an_arm_that_cannot_be_stopped_is_not_moved(arm, twin, robot, monkeypatch):
    twin.cancels = False
    monkeypatch.setattr("torc_lab.ros.arm._PROOF_S", 1.0)
    monkeypatch.setattr("torc_lab.ros.arm._CANCELLED_WITHIN_S", 0.2)
    with pytest.raises(
        LabError, match={1: "controller running", 2: "send_action_goals_in_new_thread"}[twin.ros]
    ):
        supervised(arm, robot).follow(motion(robot.arm.rest_qpos))
    np.testing.assert_array_equal(twin.arm.qpos, robot.arm.rest_qpos)


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (lambda twin: twin.halt(e_stopped=1), r"e-stop|was stopped|no motion is possible"),
        (lambda twin: twin.cut(), "lost"),
        pytest.param(lambda twin: setattr(twin, "silent", True), "said nothing", marks=pytest.mark.long),
    ],
)
def test_faults_in_mid_motion_stop_the_arm_and_nothing_is_sent_after(arm, twin, robot, fault, words):
    arm.prove_cancel()
    watched = supervised(arm, robot)
    timer = threading.Timer(0.2, fault, (twin,))
    timer.start()
    with pytest.raises(LabError, match=words):
        watched.follow(motion(robot.arm.rest_qpos, duration_s=4.0))
    timer.join()
    time.sleep(0.1)  # what was sent before arrives
    heard = len(twin.heard)
    if words != "lost":  # a goal whose client is gone goes on: rosbridge does not cancel it
        where = twin.arm.qpos.copy()
        time.sleep(0.1)
        np.testing.assert_array_equal(twin.arm.qpos, where)
    time.sleep(0.1)
    assert len(twin.heard) == heard
    assert watched.halted


def test_a_cancelled_goal_whose_result_says_success_is_no_success():
    assert result_of(2, "", 0, 1) == "preempted"
    assert result_of(5, "", 0, 2) == "cancelled"
    assert result_of(3, "", 0, 1) == result_of(4, "", 0, 2) == ""
    assert result_of(1, "", 0, 1) is None
    assert "error code -5" in result_of(4, "path tolerance", -5, 2)
    assert "no number" in result_of("4", "", 0, 2)


def test_messages(robot):
    assert duration(1.9999999996, 1) == {"secs": 2, "nsecs": 0}
    assert duration(0.25, 2) == {"sec": 0, "nanosec": 250_000_000}
    path = motion(robot.arm.rest_qpos)
    goal = goal_message(path, robot.arm.joint_names, 2)["trajectory"]
    assert goal["joint_names"] == list(robot.arm.joint_names)
    assert len(goal["points"]) == len(path.times_s)
    assert goal["points"][-1]["positions"] == pytest.approx(path.qpos[-1])
    few = thinned(path, 5)
    assert len(few.times_s) == 5
    np.testing.assert_array_equal(few.qpos[[0, -1]], path.qpos[[0, -1]])
    assert ur_safety_fault({"mode": 3}) == "protective stop"
    assert ur_safety_fault({"mode": 1}) == ""
    assert ur_safety_fault("normal")


def test_settings_that_make_no_sense(twin):
    for changed in (
        {"ros": 3},
        {"status": "none"},
        {"status_topic": ""},
        {"most_points": 1},
    ):
        with pytest.raises(InputError):
            config(twin, **changed)
    with pytest.raises(LabError, match="does not tell its state"):
        RosArm(config(twin, joint_names=("wrong",), timeout_s=0.5))
    with pytest.raises(LabError, match="cannot be reached"):
        RosArm(config(twin, url="ws://127.0.0.1:9"))


def garbled(rng, message):
    """The text of a message with some characters changed, maybe cut off."""
    text = list(json.dumps(message))
    for _ in range(int(rng.integers(1, 4))):
        text[rng.integers(len(text))] = chr(int(rng.choice([*range(32, 127), 0, 955])))
    return "".join(text)[: int(rng.integers(1, len(text) + 1)) if rng.random() < 0.2 else None]


def read_joints(message, names):
    states = JointStates()
    states.take(message, 0.0)
    return states.of(names)[0]


def test_ten_thousand_garbled_messages_are_refused_in_words_or_read(twin, rng):
    """Whatever a topic says, nobody crashes on it, and no joint is a number that is none."""
    joints = twin._messages("/joint_states")[0]
    status = twin._messages("/robot_status")[0]
    names = tuple(twin.joint_names)
    for _ in range(5_000):
        for message, read in (
            (joints, lambda m: read_joints(m, names)),
            (status, lambda m: (robot_status_fault(m), is_moving(m))),
        ):
            with suppress(ValueError):  # no JSON: the client ends the connection
                found = json.loads(garbled(rng, message))
                with suppress(LabError):
                    seen = read(found)
                    assert not isinstance(seen, np.ndarray) or np.isfinite(seen).all()


def test_garbled_results_and_states_on_the_wire_stop_the_arm_and_nothing_else_is_sent(twin, robot, rng):
    """Each connection is told some rubbish: the motion ends well or in a LabError, soon, and no other motion begins."""
    say, begun = twin._say, 0
    for _ in range(25):
        twin._say = say
        arm = RosArm(config(twin, start_tolerance_rad=0.05))
        arm._proven = True
        share = rng.choice([0.02, 0.2])

        def rubbish(connection, message, share=share):
            connection.send(garbled(rng, message) if rng.random() < share else json.dumps(message))

        twin._say = rubbish
        began, goals = time.monotonic(), [h for h in twin.heard if "goal" in str(h)]
        here = twin.arm.qpos
        watched = supervised(arm, robot)
        watched.config = QUICK
        with suppress(LabError):
            watched.follow(motion(here, by=0.02))
        assert time.monotonic() - began < 6
        begun = [h for h in twin.heard if "goal" in str(h)][len(goals) :]
        sent = [h for h in begun if "cancel" not in str(h.get("op")) + str(h.get("topic", ""))]
        assert len([h for h in sent if h["op"] != "advertise"]) <= 1
        assert np.abs(twin.arm.qpos - here).max() < 0.021
        arm.close()
