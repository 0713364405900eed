"""A cluttered scene, its collision world, and the robot."""

import numpy as np
import pytest

from torc.collision.world import CollisionWorld, build_collision_world
from torc.geometry.transforms import invert, make_pose
from torc.occlusion.volume import OcclusionConfig, empty_volume, update_volume
from torc.perception.privileged import LabelPerception
from torc.records import OcclusionVolume
from torc.robots.description import RobotDescription, load_robot
from torc.robots.ik import solve_ik
from torc.scenes.workspace import Workspace
from torc.testing.synthetic import random_clutter, synthetic_observation


@pytest.fixture(scope="session")
def robot() -> RobotDescription:
    return load_robot()


@pytest.fixture(scope="session")
def workspace() -> Workspace:
    return Workspace()


@pytest.fixture(scope="session")
def volume(workspace: Workspace) -> OcclusionVolume:
    shapes = random_clutter(np.random.default_rng(4), 10)
    scene = LabelPerception().perceive(synthetic_observation(shapes, workspace.camera))
    return update_volume(empty_volume(workspace.grid), scene, OcclusionConfig(out_of_view_is_free=True))


@pytest.fixture(scope="session")
def world(volume: OcclusionVolume, workspace: Workspace) -> CollisionWorld:
    return build_collision_world(volume, workspace)


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
    rng = np.random.default_rng(6)
    out: list[np.ndarray] = []
    while len(out) < 200:
        tilt, yaw = rng.uniform(0, 1.2), rng.uniform(-1, 1)
        z = np.array([np.sin(tilt) * np.cos(yaw), np.sin(tilt) * np.sin(yaw), -np.cos(tilt)])
        x = np.cross(z, rng.normal(size=3))
        x /= np.linalg.norm(x)
        T = make_pose(
            np.stack([x, np.cross(z, x), z], axis=1), rng.uniform([0.5, -0.35, 1.06], [0.75, 0.1, 1.25])
        )
        solutions = solve_ik(robot.arm, (T @ invert(robot.gripper.T_tool0_tcp(0.05)))[None])
        if solutions.count[0]:
            out.append(solutions.of(0)[int(rng.integers(solutions.count[0]))])
    return np.array(out)
