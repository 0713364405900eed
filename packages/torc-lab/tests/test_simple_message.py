"""A Motoman controller without ROS: its messages byte for byte, and its arm over the wire."""

import socket
import struct
import threading
import time
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest

from lab_helpers.behind_twins import ObedientArm
from test_supervisor import WIDE, motion, supervised
from tests.helpers.marks import long
from torc_lab.checks import limits_of
from torc_lab.protocols import ArmDriver, LabError, RobotStoppedError
from torc_lab.simple_message.arm import MotomanArm, MotomanConfig
from torc_lab.simple_message.channel import Channel
from torc_lab.simple_message.messages import (
    Comm,
    Command,
    Feedback,
    Frame,
    Kind,
    MotionReply,
    Result,
    RobotStatus,
    TrajectoryPoint,
    byte_order,
    feedback_of,
    motion_ctrl,
)
from torc_lab.twin.motoman import READY, MotomanTwin

# Made by hand from SimpleMessage.h of motoman_driver 1.9.12: length, type 13, topic, no reply; then powered, no e-stop,
# error code 0, no error, in motion, play, motion possible.
STATUS_BIG = bytes.fromhex(
    "00000028 0000000d 00000001 00000000 00000001 00000000 00000000 00000000 00000001 00000002 00000001"
)
STATUS_LITTLE = bytes.fromhex(
    "28000000 0d000000 01000000 00000000 01000000 00000000 00000000 00000000 01000000 02000000 01000000"
)
# Type 2001, request: group 1, sequence 7, STOP_MOTION (200111 = 0x30daf), ten zeros.
STOP_BIG = bytes.fromhex("00000040 000007d1 00000002 00000000 00000001 00000007 00030daf") + bytes(40)
STOP_LITTLE = bytes.fromhex("40000000 d1070000 02000000 00000000 01000000 07000000 af0d0300") + bytes(40)
# Type 14, request: group 1, sequence 3, fields 7, 1.5 s; joint 1 at .5 rad and 2 at -1, joint 1 at .25 rad/s.
POINT_BIG = (
    bytes.fromhex("00000094 0000000e 00000002 00000000 00000001 00000003 00000007 3fc00000 3f000000 bf800000")
    + bytes(32)
    + bytes.fromhex("3e800000")
    + bytes(36 + 40)
)


@pytest.mark.parametrize(
    ("order", "status", "stop"), [("big", STATUS_BIG, STOP_BIG), ("little", STATUS_LITTLE, STOP_LITTLE)]
)
def test_golden_frames(order, status, stop):
    moving = RobotStatus(1, 0, 0, 0, 1, 2, 1)
    assert Frame(Kind.ROBOT_STATUS, Comm.TOPIC, moving.pack(order)).pack(order) == status
    assert byte_order(status[:4]) == order
    assert RobotStatus.unpack(Frame.unpack(status[4:], order).body, order) == moving
    ctrl = motion_ctrl(1, 7, Command.STOP_MOTION, order)
    assert Frame(Kind.MOTION_CTRL, Comm.REQUEST, ctrl).pack(order) == stop


def test_a_golden_point():
    point = TrajectoryPoint(1, 3, 1.5, np.array([0.5, -1.0]), np.array([0.25, 0.0]))
    frame = Frame(Kind.JOINT_TRAJ_PT_FULL, Comm.REQUEST, point.pack("big")).pack("big")
    assert frame == POINT_BIG
    assert len(frame) == 4 + 12 + 136
    back = TrajectoryPoint.unpack(frame[16:], "big")
    assert (back.group, back.sequence, back.time_s) == (1, 3, 1.5)
    np.testing.assert_array_equal(back.qpos[:3], [0.5, -1.0, 0.0])


@pytest.mark.parametrize("order", ["big", "little"])
def test_feedback_of_one_group_and_of_several(order):
    one, two = Feedback(0, np.arange(10.0)), Feedback(1, -np.arange(10.0))
    body = struct.pack((">" if order == "big" else "<") + "i", 2)
    body += b"".join([one.pack(order), two.pack(order), bytes(132), bytes(132)])
    found = feedback_of(Frame(Kind.JOINT_FEEDBACK_EX, Comm.TOPIC, body), order)
    assert [f.group for f in found] == [0, 1]
    np.testing.assert_array_equal(found[1].qpos, two.qpos)
    assert len(one.pack(order)) == 132
    reply = MotionReply(1, 2, Command.STOP_MOTION, Result.INVALID, 3011)
    assert MotionReply.unpack(reply.pack(order), order) == reply
    assert "does not start" in reply.reason


def test_whatever_comes_instead_of_messages_is_an_error_and_nothing_else(rng):
    """Ten thousand wrong messages: each is refused in words, or is what it says."""
    frames = [STATUS_BIG, STOP_BIG, POINT_BIG]
    for _ in range(10_000):
        data = bytearray(frames[rng.integers(3)])
        for _ in range(int(rng.integers(1, 5))):
            data[rng.integers(len(data))] = rng.integers(256)
        data = bytes(data[: int(rng.integers(4, len(data) + 1))])
        with suppress(LabError):
            read_all(data)


def read_all(data):
    """As every message that it may be."""
    order = byte_order(data[:4])
    frame = Frame.unpack(data[4:], order)
    for read in (RobotStatus.unpack, TrajectoryPoint.unpack, MotionReply.unpack):
        with suppress(LabError):
            read(frame.body, order)
    feedback_of(frame, order)


@pytest.fixture(params=["big", *long("little")])
def twin(request, robot):
    with MotomanTwin(ObedientArm(robot.arm.rest_qpos), robot.arm.max_speed, order=request.param) as there:
        yield there


@pytest.fixture
def arm(twin):
    motion_port, state_port = twin.ports
    driver = MotomanArm(MotomanConfig("127.0.0.1", 1, motion_port, state_port), 7)
    yield driver
    driver.close()


def test_a_trajectory_goes_point_by_point(arm, twin, robot):
    assert isinstance(arm, ArmDriver)
    with pytest.raises(LabError, match="servos are off"):
        arm.start(motion(robot.arm.rest_qpos))
    arm.enable()
    deadline = time.monotonic() + 2
    while arm.status().stopped and time.monotonic() < deadline:
        time.sleep(0.01)
    goal = robot.arm.rest_qpos + 0.1 * np.eye(7)[0]
    # Longer than what the controller takes in ahead: it is busy in between.
    assert supervised(arm, robot).follow(motion(robot.arm.rest_qpos, duration_s=1.0)).reached
    np.testing.assert_allclose(twin.arm.qpos, goal, atol=1e-6)
    points = [f for f in twin.heard if f.kind == Kind.JOINT_TRAJ_PT_FULL]
    assert len(points) > 31
    assert supervised(arm, robot).follow(motion(goal, joint=3)).reached


def ready(arm, robot):
    arm.enable()
    deadline = time.monotonic() + 2
    while arm.status().stopped and time.monotonic() < deadline:
        time.sleep(0.01)
    return supervised(arm, robot)


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (lambda twin: twin.halt(e_stopped=1), "e-stop"),
        (lambda twin: twin.halt(mode=1), r"teach mode|play mode"),
        (lambda twin: twin.halt(in_error=1, error_code=4321), "alarm"),
        (lambda twin: twin.cut(), "lost"),
        (lambda twin: setattr(twin, "silent", True), r"said nothing|timed out"),
    ],
)
def test_faults_in_mid_motion_stop_the_arm(arm, twin, robot, fault, words):
    watched = ready(arm, robot)
    timer = threading.Timer(0.2, fault, (twin,))
    timer.start()
    with pytest.raises(LabError, match=words):
        watched.follow(motion(robot.arm.rest_qpos, duration_s=4.0))
    timer.join()
    time.sleep(0.1)  # what was sent before arrives
    where = twin.arm.qpos.copy()
    if words != "lost":  # a controller that was cut off carries out what it has: its own matter
        time.sleep(0.1)
        np.testing.assert_array_equal(twin.arm.qpos, where)
        assert np.abs(where - robot.arm.rest_qpos).max() < 0.09
    heard = len(twin.heard)
    time.sleep(0.1)
    assert len(twin.heard) == heard
    assert watched.halted


def test_what_the_controller_refuses_is_told_in_words(arm, robot):
    arm.enable()
    with pytest.raises(LabError, match="does not start where the arm is"):
        arm.start(motion(robot.arm.rest_qpos + 0.01))
    watched = ready(arm, robot)
    fast = limits_of(robot, *WIDE, 9.0, 0.01, tcp_speed_m_s=99.0)
    watched.limits = replace(fast, max_acceleration=np.full(7, 1e3))
    with pytest.raises(RobotStoppedError, match="too fast"):
        watched.follow(motion(robot.arm.rest_qpos, by=1.5, duration_s=0.5, n=101))


def test_a_group_that_there_is_not_and_a_server_of_something_else(twin):
    motion_port, state_port = twin.ports
    # On a busy machine the twin may have closed the connection before that is noticed.
    with pytest.raises(LabError, match=r"does not tell its state|is lost"):
        MotomanArm(MotomanConfig("127.0.0.1", 3, motion_port, state_port, 0.2), 7)
    with pytest.raises(LabError, match="cannot be reached"):
        MotomanArm(MotomanConfig("127.0.0.1", 1, state_port=9), 7)
    with socket.create_server(("127.0.0.1", 0)) as other:

        def serve():
            connection, _ = other.accept()
            connection.sendall(b"SSH-2.0-OpenSSH_9.2\r\n")
            time.sleep(0.3)
            connection.close()

        threading.Thread(target=serve, daemon=True).start()
        with pytest.raises(LabError, match="no length of a message"):
            Channel("127.0.0.1", other.getsockname()[1]).receive()


def test_what_is_unknown_does_not_let_it_move():
    assert READY.stopped == ""
    for name in ("drives_powered", "e_stopped", "in_error", "mode", "motion_possible"):
        assert RobotStatus(**{**vars(READY), name: -1}).stopped
