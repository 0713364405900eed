"""Fixtures of the grasping tests; and lets them share helpers (importlib leaves their folder off the path)."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from grasping_scenes import TABLE_Z

from tools.grasp_model.hand_score import HandScore
from torc.grasping.geometric_planner import GeometricGraspPlanner
from torc.grasping.hand import hand_geometry
from torc.testing.views import view_of_clutter


@pytest.fixture(scope="session")
def gripper(robot):
    return robot.gripper


@pytest.fixture(scope="session")
def hand(gripper):
    return hand_geometry(gripper)


@pytest.fixture(scope="session")
def planner(gripper):
    return GeometricGraspPlanner(gripper, TABLE_Z, scorer=HandScore())


@pytest.fixture(scope="session")
def pile():
    """Eleven shapes, some on top of others."""
    return view_of_clutter(3, 11)
