"""`torc lab check --move`: a joint that does anything but what it is commanded fails by its name."""

import re
from types import SimpleNamespace

import numpy as np
import pytest

from lab_helpers.behind_twins import Miswired, ObedientArm
from test_supervisor import WIDE
from torc_lab import checking_motions
from torc_lab.checking_motions import TURN_RAD, check_motions, turn_fault
from torc_lab.checks import limits_of
from torc_lab.ros.arm import RosArm, RosArmConfig
from torc_lab.twin.ros import RosTwin

NAMES = tuple("abcdefg")


def miswired(joint, gain=1.0, instead=None):
    turns = np.eye(7)
    turns[joint, joint] = gain
    if instead is not None:
        turns[[joint, instead]] = turns[[instead, joint]]
    return turns


@pytest.mark.parametrize(
    ("turns", "words"),
    [
        (np.eye(7), ""),
        (miswired(2, -1), r"turned the wrong way: by -0.0\d+ rad instead of \+0.080"),
        (miswired(2, 0), "did not move"),
        (miswired(2, 0.5), r"turned by \+0.0\d+ rad instead of"),
        (miswired(2, 1.15), r"turned by \+0.09\d rad"),
        (miswired(2, 57.3), "turned by"),
        (miswired(2, instead=5), r"did not move; instead moved joint 6 \(f\) by \+0.0"),
        (np.eye(7) + 0.2 * np.eye(7)[:, [4]] * np.eye(7)[2], r"along with it joint 5 \(e\)"),
    ],
)
def test_every_kind_of_wrong_wiring_is_named(turns, words, rng):
    moved = turns @ (TURN_RAD * np.eye(7)[2]) + rng.normal(0, 2e-4, 7)
    fault = turn_fault(moved, 2, TURN_RAD, NAMES)
    if not words:
        assert fault == ""
    else:
        assert re.search(words, fault)
    # The other way round, too.
    assert bool(turn_fault(-moved, 2, -TURN_RAD, NAMES)) == bool(words)


def found(robot, turns, monkeypatch):
    """What the check says of an arm behind ROS."""
    pytest.importorskip("websockets")
    monkeypatch.setattr(checking_motions, "_TURN_S", 0.6)
    limits = limits_of(robot, *WIDE, 1.0, 0.01)
    monkeypatch.setattr(checking_motions, "limits", lambda lab: limits)
    monkeypatch.setattr(checking_motions, "is_calibrated", lambda lab: False)
    behind = Miswired(ObedientArm(robot.arm.rest_qpos), turns)
    with RosTwin(behind, robot.arm.joint_names, 2) as twin:
        arm = RosArm(RosArmConfig(twin.url, 2, twin.action, tuple(twin.joint_names)))
        asked = []
        try:
            findings = list(check_motions(SimpleNamespace(robot=robot), arm, lambda q: not asked.append(q)))
        finally:
            arm.close()
    return findings, asked


@pytest.mark.long
def test_a_right_arm_passes_and_its_person_knows_what_to_see(robot, monkeypatch):
    findings, asked = found(robot, np.eye(7), monkeypatch)
    assert [f.good for f in findings] == [True] * 7
    assert len(asked) == 7
    assert "The fingertips should go" in asked[0]
    assert any(word in asked[0] for word in ("left", "right", "forward", "back", "up", "down"))


@pytest.mark.long
@pytest.mark.parametrize(
    ("turns", "words"),
    [
        (miswired(1, -1), "wrong way"),
        (miswired(1, 0), "did not move"),
        (miswired(1, 0.6), "instead of"),
        (miswired(1, instead=3), "instead moved joint 4"),
    ],
)
def test_a_wrong_arm_ends_the_check_at_that_joint(robot, monkeypatch, turns, words):
    findings, asked = found(robot, turns, monkeypatch)
    assert [f.good for f in findings] == [True, False, False]
    assert f"joint 2 ({robot.arm.joint_names[1]})" in findings[1].text
    assert words in findings[1].text
    assert len(asked) == 2
