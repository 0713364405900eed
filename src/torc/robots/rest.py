"""A robot whose parts are in each other where it waits was described wrongly: no grasp and no motion would be valid."""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from torc.errors import InputError
from torc.robots.description import RobotDescription
from torc.robots.kinematics import sphere_centers


def check_rest(robot: RobotDescription, path: Path) -> None:
    """Raises InputError if parts that are checked against each other touch at rest, the gripper open.

    Args:
        robot: as described.
        path: its file, for the message.
    """
    width_m = np.array([robot.gripper.max_width_m])
    centers = sphere_centers(robot, robot.arm.rest_qpos[None], width_m)[0]
    spheres = np.column_stack([centers, robot.spheres.radii])
    of_link = [spheres[robot.spheres.link == i] for i in range(len(robot.link_names))]
    for i in robot.static_links:
        if _touch(of_link[i], robot.static_spheres):
            raise InputError(
                f"{path}: at rest_qpos_rad what '{robot.link_names[i]}' moves touches the robot's fixed parts. If it "
                "always does, name its body in self_collision.never_with_static."
            )
    for i, j in robot.self_pairs.tolist():
        if _touch(of_link[i], of_link[j]):
            raise InputError(
                f"{path}: at rest_qpos_rad what '{robot.link_names[i]}' and '{robot.link_names[j]}' move touch each "
                "other. If they always do, give self_collision.pairs without the two."
            )


def _touch(a: Float[np.ndarray, "n 4"], b: Float[np.ndarray, "m 4"]) -> bool:
    """Whether any sphere (x, y, z, radius) of one overlaps one of the other."""
    distance = np.linalg.norm(a[:, None, :3] - b[None, :, :3], axis=2)
    return bool((distance < a[:, None, 3] + b[None, :, 3]).any())
