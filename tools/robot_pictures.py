"""The shipped robots in one picture, at rest and above the table: docs/img/robots.jpg.

python -m tools.robot_pictures docs/img/robots.jpg
"""

import sys
from pathlib import Path

import numpy as np
from jaxtyping import UInt8
from PIL import Image

from torc.geometry.transforms import invert, look_at, make_pose, rotation_about
from torc.problems.problem import load_problem
from torc.robots.description import RobotDescription
from torc.robots.ik import solve_ik
from torc.robots.loading import load_robot
from torc.robots.names import DEFAULT_ROBOT, robot_names
from torc.sim.rendering import CameraRenderer
from torc.sim.simulated_world import build_world
from torc.sim.spec import WorldConfig
from torc.workspace.description import CameraMount
from torc.workspace.workspace_files import load_workspace

_SIZE = 380, 380
_SHARPER = 2
_EYE, _AT, _FOV = (2.2, -1.85, 1.95), (0.33, -0.33, 1.08), 0.66
_ABOVE = (0.60, -0.10, 1.22)
"""Where the fingertips are in the lower pictures."""


def pictures(robot: RobotDescription) -> list[UInt8[np.ndarray, "h w 3"]]:
    """At rest, and with the hand above the table, pointing down and forward."""
    workspace = load_workspace()
    world = build_world(
        load_problem("validation-structured-02"), robot, workspace, WorldConfig(shadow_size=2048)
    )
    T = make_pose(rotation_about([0, 1, 0], np.pi - 0.5) @ rotation_about([0, 0, 1], np.pi / 2), _ABOVE)
    above = solve_ik(robot.arm, (T @ invert(robot.gripper.T_tool0_tcp(0.06)))[None]).of(0)[0]
    mount = CameraMount(look_at(_EYE, _AT), _SHARPER * _SIZE[0], _SHARPER * _SIZE[1], _FOV)
    found = []
    with CameraRenderer(world, mount) as renderer:
        for qpos in (robot.arm.rest_qpos, above):
            for name, value in zip(robot.arm.joint_names, qpos, strict=True):
                world.data.joint(name).qpos[0] = value
            world.update_kinematics()
            large = Image.fromarray(renderer.render_color())
            found.append(np.asarray(large.resize(_SIZE, Image.Resampling.BOX)))
    return found


if __name__ == "__main__":
    names = sorted(robot_names(), key=lambda name: name != DEFAULT_ROBOT)
    columns = [np.concatenate(pictures(load_robot(name)), axis=0) for name in names]
    Image.fromarray(np.concatenate(columns, axis=1)).save(Path(sys.argv[1]), quality=80, optimize=True)
