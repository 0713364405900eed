"""Nothing reaches an arm unchecked, nothing goes on unwatched, and after a stop nothing moves by itself."""

import io
import signal
import sys
import time

import numpy as np
import pytest

from fake_arm import FakeArmDriver
from torc.interrupts import ended_like_ctrl_c
from torc.records import Trajectory
from torc.robots.protocols import Arm, ContactGuard
from torc_lab.checks import limits_of, turning
from torc_lab.protocols import ArmDriver, LabError, MotionRefusedError, RobotStoppedError
from torc_lab.supervisor import SupervisedArm, SupervisorConfig, off_path_rad

WIDE = np.array([-3.0, -3.0, 0.0]), np.array([3.0, 3.0, 3.0])
QUICK = SupervisorConfig(period_s=0.005, late_s=0.3, rest_s=0.3)
"""The fake is quick, so that tests are."""
PATIENT = SupervisorConfig(period_s=0.005, stale_s=1.5, lag_s=1.5)
"""Twins share the machine with torc here: a busy machine's pauses are not the arm's silence."""


def motion(start, joint=0, by=0.1, duration_s=0.3, n=31):
    """One joint moves from rest to rest."""
    return turning(start, by, joint, duration_s, n)


def supervised(driver, robot, scale=1.0, **options):
    config = QUICK if isinstance(driver, FakeArmDriver) else PATIENT
    return SupervisedArm(driver, robot, limits_of(robot, *WIDE, scale, margin_rad=0.01), config, **options)


@pytest.fixture
def make(robot):
    def arm(driver=None, **options):
        driver = driver or FakeArmDriver(robot.arm.rest_qpos.copy())
        return supervised(driver, robot, **options), driver

    return arm


def test_a_motion_goes_to_its_end(make):
    arm, driver = make()
    assert isinstance(driver, ArmDriver)
    assert isinstance(arm, Arm)
    goal = arm.qpos + 0.1 * np.eye(7)[0]
    result = arm.follow(motion(arm.qpos))
    assert result.reached
    np.testing.assert_allclose(arm.qpos, goal)
    assert len(driver.sent) == 1
    assert driver.stops == 0


def test_speeds_are_kept_by_stretching(make, robot):
    arm, driver = make(scale=0.2)
    planned = motion(arm.qpos)
    arm.follow(planned)
    sent = driver.sent[0]
    assert sent.duration_s > planned.duration_s
    assert (np.abs(sent.qvel) <= 0.2 * robot.arm.max_speed * (1 + 1e-6)).all()
    np.testing.assert_allclose(sent.qpos, planned.qpos)


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda t, p, v: (t, p + 0.03, v), "starts 0.0300 rad away"),
        (lambda t, p, v: (t, np.where(np.arange(7) == 0, p + np.linspace(0, 9, 31)[:, None], p), v), "outside of"),
        (lambda t, p, v: (t, np.where(np.arange(31)[:, None] == 9, np.nan, p), v), "NaN"),
        (lambda t, p, v: (t[::-1], p, v), "do not rise"),
        (lambda t, p, v: (t, p[:, :6], v[:, :6]), "rows of 7 joints"),
        (lambda t, p, v: (t[:1], p[:1], v[:1]), "rows of 7 joints"),
        (lambda t, p, v: (t, np.where(np.arange(31)[:, None] > 9, p + 0.5, p), v), "cannot be checked"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_trajectory_is_said_and_nothing_is_sent(make, spoil, words, any_arrays):
    arm, driver = make()
    good = motion(arm.qpos)
    with pytest.raises(MotionRefusedError, match=words):
        arm.follow(Trajectory(*spoil(good.times_s, good.qpos, good.qvel)))
    assert driver.sent == []
    assert arm.follow(good).reached


def test_the_tcp_stays_in_the_workspace(robot):
    driver = FakeArmDriver(robot.arm.rest_qpos.copy())
    limits = limits_of(robot, np.array([-3.0, -3, 0]), np.array([3.0, 3, 0.1]), 1.0, 0.0)
    with pytest.raises(MotionRefusedError, match="outside of the workspace"):
        SupervisedArm(driver, robot, limits, QUICK).follow(motion(driver.qpos))
    assert driver.sent == []


def test_it_asks_before_each_motion_and_no_is_an_answer(make):
    asked = []
    arm, driver = make(confirm=lambda what, trajectory: asked.append(what) or len(asked) > 1)
    with pytest.raises(MotionRefusedError, match="not confirmed"):
        arm.follow(motion(arm.qpos))
    assert driver.sent == []
    assert arm.follow(motion(arm.qpos)).reached
    assert "a motion of 0.3 s" in asked[1]


def test_an_arm_that_was_moved_while_somebody_thought_does_not_start(make):
    arm, driver = make()

    def push(what, trajectory):
        driver.qpos = driver.qpos + 0.02
        return True

    arm.confirm = push
    with pytest.raises(MotionRefusedError, match="before the motion was confirmed"):
        arm.follow(motion(arm.qpos))
    assert driver.sent == []


def fault(name):
    def happen(driver):
        if name == "e-stop":
            driver.stopped = "e-stop"
        elif name == "stale":
            driver.silent_since = time.monotonic()
        elif name == "lost":
            driver.lost = "the cable came off"
        elif name == "off the path":
            driver.offset = np.eye(7)[2] * 0.4
        elif name == "cancelled":
            driver.early = "PREEMPTED"
        elif name == "stuck":
            driver.frozen = True

    return happen


@pytest.mark.parametrize(
    ("name", "error", "words"),
    [
        ("e-stop", RobotStoppedError, "e-stop"),
        ("stale", LabError, "said nothing"),
        ("lost", LabError, "cable"),
        ("off the path", RobotStoppedError, "off its path"),
        ("cancelled", RobotStoppedError, "PREEMPTED"),
        ("stuck", RobotStoppedError, "did not finish"),
    ],
)
def test_whatever_goes_wrong_stops_the_arm_and_nothing_is_sent_until_somebody_resumes(
    make, name, error, words
):
    arm, driver = make()
    start = arm.qpos
    driver.at[0.1] = fault(name)
    began = time.monotonic()
    with pytest.raises(error, match=words):
        arm.follow(motion(start))
    assert time.monotonic() - began < 2
    assert driver.stops == 1
    assert arm.halted
    if name == "lost":
        return
    driver.silent_since, driver.offset, driver.frozen = None, 0.0, False
    with pytest.raises(MotionRefusedError, match="then resume"):
        arm.follow(motion(driver.qpos))
    if name == "e-stop":
        with pytest.raises(RobotStoppedError, match="does not move yet"):
            arm.resume()
        driver.stopped = ""
    assert len(driver.sent) == 1
    arm.resume()
    assert arm.follow(motion(driver.qpos)).reached


def test_an_arm_that_cannot_move_is_not_told_to(make):
    arm, driver = make()
    driver.stopped = "teach mode"
    with pytest.raises(MotionRefusedError, match="teach mode"):
        arm.follow(motion(arm.qpos))
    driver.stopped, driver.silent_since = "", time.monotonic() - 1
    with pytest.raises(LabError, match="said nothing"):
        arm.follow(motion(driver.qpos))
    assert driver.sent == []


def test_an_interrupt_stops_the_arm_before_it_comes_through(make):
    arm, driver = make()

    def interrupt(driver):
        raise KeyboardInterrupt

    driver.at[0.1] = interrupt
    with pytest.raises(KeyboardInterrupt):
        arm.follow(motion(arm.qpos))
    assert driver.stops == 1
    rests = driver.qpos.copy()
    time.sleep(0.05)
    np.testing.assert_array_equal(arm.qpos, rests)


@pytest.mark.parametrize("error", [KeyboardInterrupt, LabError("the controller refuses")])
def test_what_goes_wrong_while_a_motion_is_sent_stops_the_arm(make, monkeypatch, error):
    """Some of it may be on its way already."""
    arm, driver = make()
    begin = driver.start

    def start(trajectory):
        begin(trajectory)
        raise error

    monkeypatch.setattr(driver, "start", start)
    with pytest.raises(type(error) if isinstance(error, LabError) else error) as raised:
        arm.follow(motion(arm.qpos))
    assert not isinstance(raised.value, RobotStoppedError)
    assert driver.stops == 1
    assert not driver.status().moving
    assert arm.halted


def test_a_stop_just_before_a_motion_is_sent_is_a_stop(make, monkeypatch):
    """The driver only knows that the controller refused; a person may look at the arm and resume."""
    arm, driver = make()

    def start(trajectory):
        driver.stopped = "e-stop"
        raise LabError("the controller refuses")

    begin = driver.start
    monkeypatch.setattr(driver, "start", start)
    with pytest.raises(RobotStoppedError, match=r"e-stop.*refuses"):
        arm.follow(motion(arm.qpos))
    monkeypatch.setattr(driver, "start", begin)
    driver.stopped = ""
    arm.resume()
    assert arm.follow(motion(driver.qpos)).reached


def test_a_stopped_arm_that_moves_on_is_told_whatever_the_driver_knew(make, monkeypatch):
    arm, driver = make()

    def start(trajectory):
        driver.stopped = "e-stop"
        raise LabError("the controller refuses")

    monkeypatch.setattr(driver, "start", start)
    monkeypatch.setattr(arm, "_stop", lambda: False)
    with pytest.raises(RobotStoppedError, match=r"e-stop.*not by torc"):
        arm.follow(motion(arm.qpos))


def test_a_contact_ends_a_guarded_motion_and_the_arm_backs_off(make, robot):
    start = robot.arm.rest_qpos.copy()
    touch = lambda driver: setattr(driver, "contact_n", 50.0)  # noqa: E731
    for feels, guard, stopped in (
        (True, ContactGuard(), True),
        (False, ContactGuard(), False),
        (True, None, False),
    ):
        arm, driver = make(FakeArmDriver(start.copy(), feels_contact=feels, at={0.15: touch}))
        result = arm.follow(motion(start), guard)
        assert result.stopped_by_contact == stopped
        assert result.reached != stopped
        if stopped:
            driver.contact_n = 0.0
            assert driver.stops == 1
            back = driver.sent[1]
            assert np.abs(back.qpos[-1] - start).max() < np.abs(back.qpos[0] - start).max()


def test_off_the_path_is_counted_at_the_best_time_near_by():
    path = motion(np.zeros(7), by=1.0, duration_s=1.0)
    assert off_path_rad(path, path.qpos[15], 0.5, 0.1) < 1e-9
    assert off_path_rad(path, path.qpos[12], 0.5, 0.2) < 0.01
    assert off_path_rad(path, path.qpos[0], 0.5, 0.1) > 0.2
    assert off_path_rad(path, path.qpos[15] + 0.3, 0.5, 0.1) == pytest.approx(0.3, abs=0.05)


def test_a_motion_is_bent_to_start_exactly_where_the_arm_is(make):
    """Controllers ask for .0001 rad; an arm at rest is not that close to where it was planned to be."""
    arm, driver = make()
    planned = motion(arm.qpos + 0.015)
    assert arm.follow(planned).reached
    assert np.abs(driver.sent[0].qpos[0] - (planned.qpos[0] - 0.015)).max() < 1e-9
    np.testing.assert_allclose(driver.sent[0].qpos[-1], planned.qpos[-1])


def test_a_signal_stops_the_arm_as_ctrl_c_does_and_a_second_one_waits(make):
    arm, driver = make()
    driver.at[0.1] = lambda d: signal.raise_signal(signal.SIGTERM)
    stop, stopped = driver.stop, []

    def impatient():
        signal.raise_signal(signal.SIGHUP if hasattr(signal, "SIGHUP") else signal.SIGINT)
        stop()
        stopped.append(driver.qpos.copy())

    driver.stop = impatient
    streams = sys.stdout, sys.stderr
    sys.stdout = sys.stderr = io.StringIO()  # SIGHUP silences the real ones for good
    try:
        with pytest.raises(KeyboardInterrupt), ended_like_ctrl_c():
            arm.follow(motion(arm.qpos))
    finally:
        sys.stdout, sys.stderr = streams
    assert len(stopped) == 1
    np.testing.assert_array_equal(driver.qpos, stopped[0])


@pytest.mark.parametrize("ahead_s", [0.1, 1.7e9])
def test_a_state_from_the_future_is_a_fault_not_fresh(make, ahead_s):
    """A driver that stamps by time.time() would never be found silent."""
    arm, driver = make()
    driver.silent_since = time.monotonic() + ahead_s
    with pytest.raises(LabError, match=r"in the future.*time\.monotonic"):
        arm.follow(motion(driver.qpos))
    assert driver.sent == []
