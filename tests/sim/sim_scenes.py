"""Small worlds and motions for the tests of the simulation."""

import numpy as np
from scipy.spatial import ConvexHull

from torc.geometry.transforms import invert, make_pose, rotation_about
from torc.objects.library import load_object
from torc.objects.models import CollisionPiece, ObjectModel, VisualMesh
from torc.problems.problem import ObjectPlacement, Problem
from torc.records import Trajectory
from torc.robots.description import RobotDescription
from torc.robots.ik import solve_ik
from torc.sim.simulated_world import World, build_world
from torc.workspace.workspace_files import load_workspace

UPRIGHT = (1.0, 0.0, 0.0, 0.0)
TABLE_Z = load_workspace().support_z_m


def block(name: str, size: tuple[float, float, float], mass_kg: float) -> ObjectModel:
    """A plain box that is not in the library."""
    piece = CollisionPiece("box", tuple(s / 2 for s in size))
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * np.array(size) / 2
    visual = VisualMesh(corners, ConvexHull(corners).simplices, rgba=(0.2, 0.5, 0.3, 1.0))
    return ObjectModel(name, "block", name, mass_kg, (piece,), (visual,), size)


BLOCKS = {
    "carton": block("carton", (0.05, 0.05, 0.14), 0.25),
    "anvil": block("anvil", (0.12, 0.12, 0.20), 40.0),
}


def find_model(name: str) -> ObjectModel:
    return BLOCKS[name] if name in BLOCKS else load_object(name)


def standing(name: str, model: str, x: float, y: float) -> ObjectPlacement:
    """An object in its natural pose, 1 mm above the table."""
    return ObjectPlacement(name, model, (x, y, TABLE_Z + find_model(model).size_m[2] / 2 + 0.001), UPRIGHT)


def problem(*objects: ObjectPlacement) -> Problem:
    """A problem whose target is the first object."""
    return Problem("test", "structured", "", objects[0].name, tuple(objects))


def world_of(*objects: ObjectPlacement, robot: RobotDescription | None = None) -> World:
    return build_world(problem(*objects), robot, load_workspace(), load_model=find_model)


def row(*models: str) -> tuple[ObjectPlacement, ...]:
    """Objects side by side, 13 cm apart."""
    return tuple(
        standing(f"object_{i}", m, 0.56 + 0.13 * (i % 2), -0.30 + 0.13 * (i // 2))
        for i, m in enumerate(models)
    )


def grasp_pose(position: tuple[float, float, float], pitch_rad: float, yaw_rad: float = 0.0) -> np.ndarray:
    """A TCP that approaches forward (yaw 0) and down by pitch, closing sideways."""
    z = np.array([np.cos(pitch_rad), 0, -np.sin(pitch_rad)])
    x = np.array([0, -1.0, 0])
    R = rotation_about((0, 0, 1), yaw_rad) @ np.stack([x, np.cross(z, x), z], axis=1)
    return make_pose(R, position)


def reach(robot: RobotDescription, T_world_tcp: np.ndarray, width_m: float, near: np.ndarray) -> np.ndarray:
    """The inverse-kinematics solution nearest to a configuration."""
    tool0 = T_world_tcp @ invert(robot.gripper.T_tool0_tcp(width_m))
    found = solve_ik(robot.arm, tool0[None])
    branches = found.qpos[0][: found.count[0]]
    return branches[np.argmin(np.abs(branches - near).max(axis=1))]


def move(start: np.ndarray, goal: np.ndarray, duration_s: float) -> Trajectory:
    """A straight joint motion that starts and ends at rest."""
    t = np.linspace(0.0, duration_s, 41)
    s, rate = (
        (1 - np.cos(np.pi * t / duration_s)) / 2,
        np.pi / duration_s * np.sin(np.pi * t / duration_s) / 2,
    )
    return Trajectory(t, start + s[:, None] * (goal - start), rate[:, None] * (goal - start))


def shift_up(T: np.ndarray, dz: float) -> np.ndarray:
    out = T.copy()
    out[2, 3] += dz
    return out


def retract(T: np.ndarray, distance: float) -> np.ndarray:
    out = T.copy()
    out[:3, 3] -= distance * T[:3, 2]
    return out
