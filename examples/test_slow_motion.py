"""The example motion planner keeps to the rules, and is as slow as it says."""

import numpy as np
import pytest

from slow_motion import SlowMotion
from torc import load_robot, load_workspace
from torc.testing.motion_conformance import check_motion_planner, requests


def test_it_conforms():
    check_motion_planner(SlowMotion)


def test_it_takes_as_much_longer_as_asked():
    planner = SlowMotion(load_robot(), load_workspace(), speed=0.25)
    (request, *_) = requests()
    slow, quick = (p.plan_pick(request, np.random.default_rng(0)) for p in (planner, planner.shipped))
    assert slow.lift.duration_s == pytest.approx(4 * quick.lift.duration_s)
    assert slow.lift.qpos == pytest.approx(quick.lift.qpos)
