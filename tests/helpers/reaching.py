"""Arm configurations among what lies on the table."""

import numpy as np
from jaxtyping import Float

from torc.geometry.transforms import invert, make_pose
from torc.robots.description import RobotDescription
from torc.robots.ik import solve_ik


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
