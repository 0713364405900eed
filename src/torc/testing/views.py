"""One snapshot of analytic shapes with all that is made of it, and arm configurations among them."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from torc.collision.world import CollisionWorld, build_collision_world
from torc.geometry.transforms import invert, make_pose
from torc.occlusion.volume import FIXED_CAMERA, empty_volume, update_volume
from torc.perception.privileged import LabelPerception
from torc.records import OcclusionVolume, SegmentedScene
from torc.robots.description import RobotDescription
from torc.robots.ik import solve_ik
from torc.scenes.workspace import Workspace
from torc.testing.synthetic import Shape, random_clutter, synthetic_observation


@dataclass(frozen=True)
class View:
    """What the fixed camera makes of shapes on the table.

    Attributes:
        shapes: what is there.
        workspace: table, bin, camera and grid.
        scene: as perceived, masks given.
        volume: after this one snapshot.
    """

    shapes: tuple[Shape, ...]
    workspace: Workspace
    scene: SegmentedScene
    volume: OcclusionVolume

    @cached_property
    def world(self) -> CollisionWorld:
        """What not to touch."""
        return build_collision_world(self.volume, self.workspace)


def view_of(*shapes: Shape, workspace: Workspace | None = None) -> View:
    """One snapshot of shapes."""
    workspace = Workspace() if workspace is None else workspace
    scene = LabelPerception().perceive(synthetic_observation(shapes, workspace.camera))
    volume = update_volume(empty_volume(workspace.grid), scene, FIXED_CAMERA)
    return View(shapes, workspace, scene, volume)


def view_of_clutter(seed: int, n: int, workspace: Workspace | None = None) -> View:
    """One snapshot of n random shapes, some on top of others."""
    return view_of(*random_clutter(np.random.default_rng(seed), n), workspace=workspace)


def reaching_qpos(robot: RobotDescription, n: int, rng: np.random.Generator) -> Float[np.ndarray, "n dof"]:
    """Configurations with the hand low in the clutter, straight down to tilted; not all of them are free."""
    out: list[np.ndarray] = []
    T_tcp_tool0 = invert(robot.gripper.T_tool0_tcp(0.05))
    while len(out) < n:
        tilt, yaw = rng.uniform(0, 1.2), rng.uniform(-1, 1)
        z = np.array([np.sin(tilt) * np.cos(yaw), np.sin(tilt) * np.sin(yaw), -np.cos(tilt)])
        x = np.cross(z, rng.normal(size=3))
        x /= np.linalg.norm(x)
        p = rng.uniform([0.5, -0.35, 1.06], [0.75, 0.1, 1.25])
        solutions = solve_ik(
            robot.arm, (make_pose(np.stack([x, np.cross(z, x), z], axis=1), p) @ T_tcp_tool0)[None]
        )
        if solutions.count[0]:
            out.append(solutions.of(0)[int(rng.integers(solutions.count[0]))])
    return np.array(out)
