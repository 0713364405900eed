"""Whether the physics takes an object, and whether it stands where it is put."""

import numpy as np

from torc.geometry.transforms import rotation_from_wxyz
from torc.objects.models import ObjectModel
from torc.problems.problem import ObjectPlacement, Problem
from torc.sim.settling import run
from torc.sim.world import World, build_world
from torc.workspace.files import load_workspace

_STEADY_RAD, _STEADY_M = float(np.deg2rad(8.0)), 0.02


def world_with(model: ObjectModel, yaw_rad: float = 0.0) -> World:
    """A world with nothing but this object, 1 mm above the middle of the table. Raises InputError if MuJoCo does not
    accept it.
    """
    workspace = load_workspace()
    x, y, _ = workspace.table.center
    at = (x, y, workspace.support_z_m + model.size_m[2] / 2 + 0.001)
    wxyz = (float(np.cos(yaw_rad / 2)), 0.0, 0.0, float(np.sin(yaw_rad / 2)))
    placement = ObjectPlacement(model.name, model.name, at, wxyz)
    problem = Problem(model.name, "structured", "", model.name, (placement,))
    return build_world(problem, None, workspace, load_model=lambda _: model)


def stands(model: ObjectModel) -> bool:
    """Whether the object, set on the table, neither falls over nor rolls away within a second. Raises InputError if
    MuJoCo does not accept it, and PhysicsError.
    """
    world = world_with(model)
    before = world.positions[0]
    run(world, 1.0)
    up = rotation_from_wxyz(world.wxyz[0])[2, 2]
    moved_m = float(np.linalg.norm(world.positions[0, :2] - before[:2]))
    return bool(np.arccos(np.clip(up, -1.0, 1.0)) < _STEADY_RAD and moved_m < _STEADY_M)
