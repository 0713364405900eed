"""A robot at rest beside its table, from outside."""

import mujoco
import numpy as np
from jaxtyping import UInt8

from torc.geometry.transforms import look_at
from torc.objects.library import load_object
from torc.problems.problem import ObjectPlacement, Problem
from torc.robots.description import RobotDescription
from torc.sim.rendering import CameraRenderer
from torc.sim.simulated_world import build_world
from torc.sim.spec import COLLISION_GROUP, VISUAL_GROUP
from torc.workspace.description import CameraMount, Workspace

_EYE_M, _FOV_RAD = (1.6, -2.0, 1.3), 0.85
"""Where the camera stands, from the middle between the table and the robot's base."""
_SIZE_PX = (960, 720)
_ON_THE_TABLE = "mug_red"


def robot_portrait(robot: RobotDescription, workspace: Workspace) -> UInt8[np.ndarray, "h w 3"]:
    """The robot as the simulator has it, and a mug on the table for its size. A robot without anything visible shows
    what collides. Raises InputError if the simulator does not accept the two together.
    """
    x, y, _ = workspace.table.center
    model = load_object(_ON_THE_TABLE)
    center = (x, y, workspace.support_z_m + model.size_m[2] / 2)
    mug = ObjectPlacement("thing", model.name, center, (1.0, 0.0, 0.0, 0.0))
    world = build_world(Problem(robot.name, "structured", "", "thing", (mug,)), robot, workspace)
    _show_what_collides(world.model, robot)
    middle = (np.array(center) + robot.arm.T_world_base[:3, 3]) / 2
    mount = CameraMount(look_at(middle + np.array(_EYE_M), middle), *_SIZE_PX, _FOV_RAD)
    with CameraRenderer(world, mount) as renderer:
        return renderer.render_color()


def _show_what_collides(model: mujoco.MjModel, robot: RobotDescription) -> None:
    roots = {model.body(name).id for name in robot.root_body_names}
    own = np.isin(model.body_rootid[model.geom_bodyid], list(roots))
    if not (own & (model.geom_group < COLLISION_GROUP)).any():
        model.geom_group[own & (model.geom_group == COLLISION_GROUP)] = VISUAL_GROUP
