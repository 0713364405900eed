"""Our dialect of rosbridge, held to an exchange with the real one.

Recorded from rosbridge_suite's branch ros1 (rosbridge_websocket) with Debian's rosmaster, rospy and actionlib 1.14: a
SimpleActionServer of FollowJointTrajectory, five publishers on /joint_states. docs/laboratory.md has the commands.
"""

import json
import threading
from pathlib import Path

import numpy as np
import pytest

from test_supervisor import motion
from torc_lab.ros.arm import RosArm, RosArmConfig
from torc_lab.twin.ros import RosTwin

pytest.importorskip("websockets", reason="websockets is not installed")
RECORDED = json.loads((Path(__file__).parent / "recorded_rosbridge_ros1.json").read_text(encoding="utf-8"))
ACTION = "/sda10f/sda10f_r2_controller/joint_trajectory_action"


class Recording:
    """A server that expects what was sent, message by message, and answers what was answered."""

    def __init__(self):
        from websockets.sync.server import serve

        self.unlike = []
        self._server = serve(self._serve, "127.0.0.1", 0, compression=None, ping_interval=None)
        self._thread = threading.Thread(target=self._server.serve_forever)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._server.shutdown()
        self._thread.join()

    @property
    def url(self):
        return f"ws://127.0.0.1:{self._server.socket.getsockname()[1]}"

    def _serve(self, connection):
        for direction, message in RECORDED["messages"]:
            if direction == "in":
                connection.send(json.dumps(message))
                continue
            heard = json.loads(connection.recv())
            if heard != message:
                self.unlike.append((heard, message))
        connection.recv()


def ended(arm):
    for _ in range(1000):
        if (how := arm.ended()) is not None:
            return how
        threading.Event().wait(0.01)
    raise AssertionError("the goal did not end")


def test_the_same_calls_send_the_same_messages_and_the_answers_mean_what_happened(robot):
    names = tuple(robot.arm.joint_names)
    start = np.array(RECORDED["start"])
    with Recording() as server:
        config = RosArmConfig(server.url, 1, ACTION, names, status_topic="/robot_status", status="industrial")
        arm = RosArm(config)
        arm._began = 1000
        np.testing.assert_allclose(arm.status().qpos, start)
        assert arm.status().stopped == ""
        assert arm.other_joints()["torso_joint_b1"] == 0.0
        assert arm.other_joints()["arm_left_joint_1_s"] == 0.0
        arm.prove_cancel()  # recorded: preempted, with error code 0
        assert arm.ended() == "preempted"
        arm._send(motion(start, by=0.05, duration_s=0.5, n=5))
        assert ended(arm) == ""
        goal = RECORDED["messages"][-2][1]["msg"]["goal"]["trajectory"]["points"][0]["positions"]
        arm._send(motion(np.array(goal), by=0.05, duration_s=0.5, n=5))
        assert ended(arm) == "aborted: start"
        arm.close()
    assert server.unlike == []


def shape(message):
    """The keys of a message, all the way down."""
    if isinstance(message, dict):
        return {key: shape(value) for key, value in message.items() if key != "seq"}
    return list if isinstance(message, list) else type(message)


def test_the_twin_speaks_as_the_real_one_does(robot):
    """Every message of the twin has the form of a recorded one, less what nobody reads."""
    real = {m["topic"]: shape(m["msg"]) for d, m in RECORDED["messages"] if d == "in"}
    said = []

    class Still:
        qpos, contact_n = robot.arm.rest_qpos, 0.0

        def goal(self, qpos):
            pass

    with RosTwin(Still(), robot.arm.joint_names, 1, ACTION) as twin:
        twin._say = lambda connection, message: said.append(message)
        for topic in ("/joint_states", "/robot_status"):
            said += [{"topic": topic, "msg": m} for m in twin._messages(topic)]
        goal = next(m["msg"] for d, m in RECORDED["messages"] if d == "out" and m["op"] == "publish")
        twin._begin(None, goal["goal_id"]["id"], goal["goal"])
        twin.halt(e_stopped=1)
    assert {m["topic"] for m in said} == set(real)
    for message in said:
        form, like = shape(message["msg"]), real[message["topic"]]
        assert_within(form, like)


def assert_within(form, like):
    for key, value in form.items():
        assert key in like, key
        if isinstance(value, dict):
            assert_within(value, like[key])
        else:
            assert value == like[key], key
