"""A UR by the real ur_rtde, over its real wires, against a twin of the controller; and what goes wrong."""

import threading
import time

import numpy as np
import pytest

from lab_helpers.behind_twins import ObedientArm
from test_supervisor import supervised
from torc.errors import InputError
from torc.robots.loading import load_robot
from torc.robots.protocols import ContactGuard
from torc_lab.checks import turning
from torc_lab.protocols import ArmDriver, LabError
from torc_lab.twin.ur import UrTwin
from torc_lab.ur.arm import UrArm, UrConfig, set_points, ur_fault

pytest.importorskip("rtde_control", reason="ur_rtde is not installed")
SERVO_J, SERVO_STOP = 11, 16


@pytest.fixture(scope="module")
def six_joints():
    return load_robot("ur5e_2f85")


@pytest.fixture
def twin(six_joints):
    with UrTwin(ObedientArm(six_joints.arm.rest_qpos)) as there:
        yield there


@pytest.fixture
def arm(twin):
    driver = UrArm(UrConfig(twin.host))
    yield driver
    driver.close()


@pytest.fixture
def watched(arm, six_joints):
    return supervised(arm, six_joints)


def servo_points(twin):
    return np.array([heard[1:7] for heard in twin.heard if heard[0] == SERVO_J])


def test_a_motion_is_streamed_point_by_point_as_it_was_checked(arm, twin, watched):
    home = twin.arm.qpos.copy()
    assert isinstance(arm, ArmDriver)
    assert not twin.heard  # nothing is uploaded before the first motion
    assert watched.follow(turning(home, 0.1)).reached
    np.testing.assert_allclose(twin.arm.qpos, home + 0.1 * np.eye(6)[0], atol=1e-6)
    kinds = [heard[0] for heard in twin.heard]
    assert kinds[0] == "script"
    assert set(kinds[1:-1]) == {SERVO_J}
    assert kinds[-1] == SERVO_STOP
    sent = servo_points(twin)
    planned = set_points(turning(home, 0.1), 125)
    np.testing.assert_allclose(sent[: len(planned)], planned, atol=1e-6)
    assert len(sent) >= 125
    assert twin.heard[1][9:] == (1 / 125, 0.1, 300.0)  # of servoJ: time, look-ahead, gain
    assert watched.follow(turning(arm.status().qpos, -0.05)).reached


def test_one_torc_at_a_time_moves_it(arm, twin):
    second = UrArm(UrConfig(twin.host))
    arm.start(turning(twin.arm.qpos.copy(), 0.1))
    with pytest.raises(LabError, match="Another torc"):
        second.start(turning(twin.arm.qpos.copy(), 0.1))
    assert second.status().qpos.shape == (6,)
    second.close()


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (lambda twin: twin.halt(e_stopped=1), r"e-stop|program was stopped"),
        pytest.param(
            lambda twin: twin.halt(in_error=1), r"protective stop|program was stopped", marks=pytest.mark.long
        ),
        pytest.param(lambda twin: twin.halt(mode=1), "program was stopped", marks=pytest.mark.long),
        pytest.param(
            lambda twin: twin.state.update(slider=0.5), "speed slider is at 50", marks=pytest.mark.long
        ),
        (lambda twin: twin.cut(), "lost"),
        (lambda twin: twin.halt(mode=1) or time.sleep(0.03) or twin.cut(), "lost"),  # not both wires at once
        (lambda twin: setattr(twin, "silent", True), r"said nothing|lost"),
        (
            lambda twin: twin.arm.goal(twin.arm.qpos + 0.4) or setattr(twin.arm, "goal", lambda q: None),
            "off its path",
        ),
    ],
)
def test_faults_in_mid_motion_stop_the_arm_and_nothing_is_sent_after(arm, twin, watched, fault, words):
    home = twin.arm.qpos.copy()
    timer = threading.Timer(0.4, fault, (twin,))
    timer.start()
    with pytest.raises(LabError, match=words):
        watched.follow(turning(home, 0.3, duration_s=2.0))
    timer.join()
    time.sleep(0.6)  # what was sent before arrives
    heard, where = len(servo_points(twin)), twin.arm.qpos.copy()
    time.sleep(0.4)
    assert len(servo_points(twin)) == heard
    np.testing.assert_array_equal(twin.arm.qpos, where)
    assert watched.halted
    if words == "lost":
        with pytest.raises(LabError):
            watched.resume()


@pytest.mark.long
def test_a_person_resumes_after_a_protective_stop_and_the_program_is_uploaded_again(arm, twin, watched):
    home = twin.arm.qpos.copy()
    timer = threading.Timer(0.4, twin.halt, kwargs={"in_error": 1})
    timer.start()
    with pytest.raises(LabError):
        watched.follow(turning(home, 0.3, duration_s=2.0))
    timer.join()
    with pytest.raises(LabError, match="protective stop"):
        watched.resume()
    scripts = twin.heard.count(("script",))
    twin.state["safety_mode"] = 1  # unlocked at the pendant
    time.sleep(0.1)
    watched.resume()
    assert twin.heard.count(("script",)) == scripts
    assert watched.follow(turning(arm.status().qpos, 0.05)).reached
    assert twin.heard.count(("script",)) == scripts + 1


def test_a_robot_that_is_not_in_remote_control_is_not_moved(arm, twin):
    home = twin.arm.qpos.copy()
    twin.halt(mode=1)
    with pytest.raises(LabError, match=r"refuses.*remote control"):
        arm.start(turning(home, 0.1))
    assert not servo_points(twin).size


@pytest.mark.long
def test_the_force_beyond_that_at_the_start_stops_a_guarded_motion(arm, twin, watched):
    assert arm.feels_contact
    twin.force_n = np.array([0.0, 0.0, -12.0])  # the hand's weight
    time.sleep(0.1)
    for force_n, stopped in (([0, 0, -42.0], False), ([0, 0, 33.0], True), (45.0, True)):
        begin = arm.status().qpos
        twin.force_n = np.array([0.0, 0.0, -12.0])
        time.sleep(0.1)
        touch = (
            (twin.arm, "contact_n", force_n)
            if stopped and force_n == 45.0
            else (twin, "force_n", np.array(force_n))
        )
        timer = threading.Timer(0.5, setattr, touch)
        timer.start()
        done = watched.follow(turning(begin, 0.2, duration_s=1.5), ContactGuard(40.0))
        assert done.stopped_by_contact == stopped
        assert done.reached != stopped
        timer.join()
        twin.arm.contact_n, twin.force_n = 0.0, np.array([0.0, 0.0, -12.0])


def test_when_torc_dies_the_robot_rests(twin):
    home = twin.arm.qpos.copy()
    driver = UrArm(UrConfig(twin.host))
    driver.start(turning(home, 0.3, duration_s=2.0))
    time.sleep(0.3)
    driver._process.stdin.close()  # as if this process was killed
    driver._process.wait(3)
    assert twin.heard[-1][0] != SERVO_J
    heard = len(twin.heard)
    time.sleep(0.2)
    assert len(twin.heard) == heard
    driver.close()


def test_set_points_lie_on_the_checked_curve():
    planned = turning(np.zeros(6), 0.3, duration_s=2.0, samples=21)
    points = set_points(planned, 125)
    np.testing.assert_array_equal(points[0], planned.qpos[0])
    np.testing.assert_allclose(points[-1], planned.qpos[-1], atol=1e-12)
    s = np.minimum(np.arange(len(points)) / 125, 2.0) / 2.0
    np.testing.assert_allclose(points[:, 0], 0.3 * (3 * s**2 - 2 * s**3), atol=1e-9)
    assert np.abs(np.diff(points, axis=0)).max() * 125 <= np.abs(planned.qvel).max() * 1.01


def test_what_a_robot_says_of_itself():
    assert ur_fault(7, 1, 1.0) == ur_fault(7, 2, 1.0) == ""
    assert ur_fault(7, 3, 1.0) == "protective stop"
    assert ur_fault(3, 7, 1.0) == "e-stop"
    assert "brakes" in ur_fault(5, 1, 1.0)
    assert "slider" in ur_fault(7, 1, 0.3)
    assert ur_fault(7, 42, 1.0)
    assert ur_fault(42, 1, 1.0)


def test_settings_and_robots_that_cannot_be():
    for wrong in ({"rate_hz": 1000.0}, {"gain": 1.0}, {"lookahead_s": 1.0}, {"timeout_s": 0.0}):
        with pytest.raises(InputError):
            UrConfig("robot", **wrong)
    with pytest.raises(InputError, match="6 joints"):
        UrArm(UrConfig("robot"), dof=7)
    with pytest.raises(LabError, match="cannot be reached"):
        UrArm(UrConfig("127.0.0.1", timeout_s=5.0))


@pytest.mark.long
def test_ur_rtde_that_waits_in_vain_for_its_program_is_no_silence(arm, twin, monkeypatch):
    """It keeps its whole process waiting then; here it is told that it may begin."""
    monkeypatch.setattr(twin, "_run", lambda text: None)
    with pytest.raises(LabError, match=r"refuses.*control script"):
        arm.start(turning(twin.arm.qpos, 0.1))
    assert arm.status().stopped == ""
    assert not servo_points(twin).size
