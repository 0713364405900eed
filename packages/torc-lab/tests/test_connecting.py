"""Connecting moves nothing: no connection is opened on which a motion could start, and old motion is cleared first."""

import threading
import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from lab_helpers.behind_twins import ObedientArm
from test_supervisor import motion, supervised
from torc_lab.checking import check_lab
from torc_lab.exclusive import ControllerLock
from torc_lab.protocols import LabError, RobotStoppedError
from torc_lab.ros.arm import RosArm, RosArmConfig
from torc_lab.simple_message.arm import MotomanArm, MotomanConfig
from torc_lab.simple_message.channel import Channel
from torc_lab.simple_message.messages import Command, Kind
from torc_lab.twin.motoman import READY, MotomanTwin
from torc_lab.twin.ros import RosTwin


@pytest.fixture
def twin(robot):
    with MotomanTwin(ObedientArm(robot.arm.rest_qpos), robot.arm.max_speed) as there:
        there.state = READY
        yield there


def connected(twin):
    motion_port, state_port = twin.ports
    return MotomanArm(MotomanConfig("127.0.0.1", 1, motion_port, state_port), 7)


def cut_in_mid_motion(twin, robot):
    """A client sends a motion and dies; the queue has most of a second left."""
    arm = connected(twin)
    arm.start(motion(robot.arm.rest_qpos, by=0.4, duration_s=2.0, n=101))
    time.sleep(0.4)
    twin.cut()
    # Its threads notice that; `close` must not stop the controller for it.
    time.sleep(0.1)
    arm.close()
    return twin.arm.qpos.copy()


def commands(twin):
    return [
        int(np.frombuffer(f.body, ">i4", 3)[2]) if f.kind == Kind.MOTION_CTRL else int(f.kind)
        for f in twin.heard
    ]


def test_the_twin_keeps_its_queue_and_plays_it_for_the_next_client(twin, robot):
    where = cut_in_mid_motion(twin, robot)
    time.sleep(0.2)
    np.testing.assert_array_equal(twin.arm.qpos, where)
    next_one = Channel("127.0.0.1", twin.ports[0], order="big")
    time.sleep(0.9)
    next_one.close()
    assert twin.arm.qpos[0] - where[0] > 0.1


def test_a_new_connection_moves_nothing_and_its_first_frame_is_a_stop(twin, robot):
    where = cut_in_mid_motion(twin, robot)
    clients, heard = twin.clients, len(twin.heard)
    arm = connected(twin)
    time.sleep(0.5)
    assert arm.status().qpos[0] == pytest.approx(where[0], abs=1e-6)
    arm.stop()  # nothing of ours moves
    assert (twin.clients, len(twin.heard)) == (clients, heard)
    np.testing.assert_array_equal(twin.arm.qpos, where)
    arm.enable()
    assert commands(twin)[heard:] == [Command.STOP_MOTION, Command.START_TRAJ_MODE]
    time.sleep(0.9)
    assert abs(twin.arm.qpos[0] - where[0]) < 0.02
    arm.close()


def test_closing_leaves_nothing_in_the_queue(twin, robot):
    arm = connected(twin)
    arm.start(motion(robot.arm.rest_qpos, by=0.4, duration_s=2.0, n=101))
    time.sleep(0.3)
    arm.close()
    where = twin.arm.qpos.copy()
    with pytest.raises(LabError):
        arm.status()
    Channel("127.0.0.1", twin.ports[0], order="big").close()
    time.sleep(0.3)
    np.testing.assert_array_equal(twin.arm.qpos, where)


def test_one_torc_at_a_time_moves_a_controller(twin, robot):
    first, second = connected(twin), connected(twin)
    assert supervised(first, robot).follow(motion(robot.arm.rest_qpos)).reached
    assert second.status().qpos.shape == (7,)  # it may look
    with pytest.raises(LabError, match=r"Another torc \(process \d+\) moves the arm .* end that one first"):
        second.start(motion(twin.arm.qpos))
    assert twin.clients == 1
    first.close()
    assert supervised(second, robot).follow(motion(twin.arm.qpos)).reached
    second.close()


def test_a_controller_that_somebody_else_moves_refuses_us_in_words(twin, robot):
    other = Channel("127.0.0.1", twin.ports[0], order="big")
    time.sleep(0.05)
    with twin._lock:
        twin._began = time.monotonic()
        twin._points = [SimpleNamespace(time_s=t, qpos=robot.arm.rest_qpos) for t in (0.0, 60.0)]
    arm = connected(twin)
    with pytest.raises(LabError, match="Does another client move this controller"):
        arm.enable()
    other.close()
    arm.close()


def test_a_controller_that_cannot_be_locked_is_not_moved(monkeypatch):
    monkeypatch.setattr("torc_lab.exclusive.try_lock", lambda file: None)
    with pytest.raises(LabError, match="cannot be locked"):
        ControllerLock("10.0.0.3:50240")


def test_a_lock_is_free_again_when_its_holder_is_gone():
    lock = ControllerLock("10.0.0.1:50240 a/b")
    with pytest.raises(LabError, match="Another torc"):
        ControllerLock("10.0.0.1:50240 a/b")
    ControllerLock("10.0.0.2:50240").release()
    lock.release()
    lock.release()
    ControllerLock("10.0.0.1:50240 a/b").release()


@pytest.mark.long
@pytest.mark.parametrize(
    "name", ["sda10f-simple-message", "sda10f-ros1", "ur5e-ros2", "ur5e-rtde", "panda-ros2"]
)
def test_a_check_opens_nothing_that_could_move(rehearsed, name):
    if name == "ur5e-rtde":
        pytest.importorskip("rtde_control", reason="ur_rtde is not installed")
    problem = {"sda": "structured", "ur5": "ur5e-structured", "pan": "panda-structured"}[name[:3]]
    with rehearsed(name, f"validation-{problem}-02") as (there, lab):
        where = there.world.qpos.copy()
        clients, heard = getattr(there.arm, "clients", 0), len(there.arm.heard)
        written = list(getattr(there.gripper, "written", []))
        findings = list(check_lab(lab))
        assert {f.device for f in findings} == {"arm", "gripper", "camera"}
        assert there.arm.heard[heard:] == []
        assert getattr(there.arm, "clients", 0) == clients
        assert getattr(there.gripper, "written", []) == written
        assert np.abs(there.world.qpos - where).max() < 1e-3


@pytest.mark.long
def test_an_arm_that_somebody_else_moves_on_is_not_said_to_rest(robot):
    """Another client's goal preempts ours: the arm goes on, and not by us."""
    pytest.importorskip("websockets")
    for ros in (1, 2):
        with RosTwin(ObedientArm(robot.arm.rest_qpos), robot.arm.joint_names, ros) as twin:
            config = RosArmConfig(twin.url, ros, twin.action, tuple(twin.joint_names))
            arm, other = RosArm(config), RosArm(replace(config, url=twin.url + "/"))
            arm.prove_cancel()
            other._proven = True
            other._take_arm()

            def preempt(other=other, twin=twin):
                other.start(motion(twin.arm.qpos, by=-1.0, duration_s=3.0, n=301))

            watched = supervised(arm, robot)
            watched.config = replace(watched.config, rest_s=0.3)
            timer = threading.Timer(0.3, preempt)
            timer.start()
            with pytest.raises(RobotStoppedError, match=r"still moves, and not by torc"):
                watched.follow(motion(robot.arm.rest_qpos, duration_s=1.0))
            with pytest.raises(RobotStoppedError, match="still moves"):
                watched.resume()
            assert watched.halted
            other.stop()
            deadline = time.monotonic() + 5
            while twin._goal is not None and time.monotonic() < deadline:
                time.sleep(0.02)
            watched.resume()
            timer.join()
            arm.close()
            other.close()
