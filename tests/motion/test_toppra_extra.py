"""The toppra library is an alternative that nobody needs."""

import sys

import numpy as np
import pytest

from torc.errors import MissingDependencyError
from torc.motion.config import TimingConfig
from torc.motion.geometry import rounded_path
from torc.motion.timing import time_path
from torc.records import PickPlan

BACKEND = "torc.motion.toppra_profile"


@pytest.fixture
def without_toppra(monkeypatch):
    """Every import of the library fails, as if it were not installed."""
    monkeypatch.setitem(sys.modules, "toppra", None)
    monkeypatch.delitem(sys.modules, BACKEND, raising=False)


def test_picks_are_planned_without_it(planner, request_for, without_toppra):
    plan = planner.plan_pick(request_for(0)[0], np.random.default_rng(0))
    assert isinstance(plan, PickPlan)
    assert BACKEND not in sys.modules


def test_asking_for_it_names_the_extra(robot, without_toppra):
    path = robot.arm.rest_qpos + 0.1 * np.eye(2, robot.arm.dof)
    (part,) = rounded_path(path, np.zeros(2))
    with pytest.raises(MissingDependencyError, match=r"scripts/setup toppra"):
        time_path(part, robot.arm, TimingConfig(backend="toppra"))
