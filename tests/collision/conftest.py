"""A cluttered scene, its collision world, and arm configurations in it."""

import numpy as np
import pytest

from tests.helpers.reaching import reaching_qpos
from torc.collision.collision_world import CollisionWorld
from torc.records import OcclusionVolume
from torc.robots.description import RobotDescription
from torc.testing.views import View, view_of_clutter
from torc.workspace.description import Workspace


@pytest.fixture(scope="session")
def view(workspace: Workspace) -> View:
    return view_of_clutter(4, 10, workspace)


@pytest.fixture(scope="session")
def volume(view: View) -> OcclusionVolume:
    return view.volume


@pytest.fixture(scope="session")
def world(view: View) -> CollisionWorld:
    return view.world


@pytest.fixture(scope="session")
def qpos(robot: RobotDescription) -> np.ndarray:
    """Configurations around the clutter: many touch something, many do not."""
    rng = np.random.default_rng(5)
    return np.clip(
        robot.arm.rest_qpos + rng.normal(0, 0.6, (400, robot.arm.dof)), robot.arm.lower, robot.arm.upper
    )


@pytest.fixture(scope="session")
def grasping(robot: RobotDescription) -> np.ndarray:
    """Configurations with the hand low in the clutter."""
    return reaching_qpos(robot, 200, np.random.default_rng(6))
