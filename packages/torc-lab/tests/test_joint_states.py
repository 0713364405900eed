"""Several publishers on one topic: the newest value of each joint counts, with its own age."""

import numpy as np
import pytest

from torc_lab.protocols import LabError
from torc_lab.ros.messages import JointStates

ARM = ("s", "l", "e")


def message(positions, stamp_s):
    header = {"stamp": {"sec": int(stamp_s), "nanosec": round(stamp_s % 1 * 1e9)}}
    return {"header": header, "name": list(positions), "position": list(positions.values())}


def test_each_joint_has_the_newest_value_and_its_own_age():
    states = JointStates()
    states.take(message({"s": 0.1, "l": 0.2, "e": 0.3}, 100.0), 5.00)
    states.take(message({"finger": 0.7}, 100.2), 5.20)
    states.take(message({"torso": 0.0}, 900.0), 5.21)  # another machine, whose clock is ahead
    qpos, stamp_s = states.of(ARM)
    np.testing.assert_array_equal(qpos, [0.1, 0.2, 0.3])
    assert stamp_s == pytest.approx(5.0)
    assert states.of(["finger"])[1] == pytest.approx(5.2)
    # A silent arm grows old, however lively the others are.
    for k in range(50):
        states.take(message({"finger": 0.7}, 101.0 + k), 6.0 + k)
    assert states.of(ARM)[1] == pytest.approx(5.0)
    assert states.all() == {"s": 0.1, "l": 0.2, "e": 0.3, "finger": 0.7, "torso": 0.0}


def test_two_nodes_that_publish_the_same_joint():
    states = JointStates()
    states.take(message({"s": 0.1, "l": 0.2, "e": 0.3}, 100.0), 5.0)
    states.take(message({"e": 0.4}, 100.1), 5.1)
    np.testing.assert_array_equal(states.of(ARM)[0], [0.1, 0.2, 0.4])
    states.take(message({"s": 0.5, "l": 0.6, "e": 0.7}, 99.0), 5.2)  # late: it is older
    np.testing.assert_array_equal(states.of(ARM)[0], [0.1, 0.2, 0.4])


def test_what_is_missing_or_unreadable_is_named():
    states = JointStates()
    with pytest.raises(LabError, match="No joint states could be read"):
        states.of(ARM)
    for wrong in ({}, None, {"name": ["s"], "position": ["x"]}, {"name": 3, "position": []}):
        states.take(wrong, 1.0)
        with pytest.raises(LabError, match="No joint states could be read: "):
            states.of(["s"])
    states.take({"name": ["wrist"], "position": [0.0]}, 2.0)
    assert not states.knows(["elbow"])
    with pytest.raises(LabError, match="have no 'elbow'; they have wrist"):
        states.of(["elbow"])
    states.take({"name": ["elbow"], "position": [float("nan")]}, 2.0)
    with pytest.raises(LabError, match="not finite"):
        states.of(["elbow"])
    states.take({"name": ["s", "l"], "position": []}, 3.0)  # velocities alone
    assert not states.knows(["s"])
