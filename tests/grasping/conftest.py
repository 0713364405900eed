"""Fixtures of the grasping tests; and lets them share helpers (importlib leaves their folder off the path)."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from grasping_scenes import TABLE_Z, clutter

from torc.grasping.hand import hand_geometry
from torc.grasping.planner import GeometricGraspPlanner
from torc.grasping.scoring import HandScore
from torc.robots.description import load_robot


@pytest.fixture(scope="session")
def robot():
    return load_robot()


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
    return clutter(3, 11)
