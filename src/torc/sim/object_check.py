"""Whether the physics takes an object, and whether it stands where it is put."""

import numpy as np

from torc.geometry.transforms import rotation_from_wxyz
from torc.objects.models import ObjectModel
from torc.problems.problem import ObjectPlacement, Problem
from torc.sim.settling import run
from torc.sim.world import build_world
from torc.workspace.files import load_workspace

_STEADY_RAD, _STEADY_M = float(np.deg2rad(8.0)), 0.02


def stands(model: ObjectModel) -> bool:
    """Whether the object, set 1 mm above the table, neither falls over nor rolls away within a second. Raises
    InputError if MuJoCo does not accept it, and PhysicsError.
    """
    workspace = load_workspace()
    x, y, _ = workspace.table.center
    at = (x, y, workspace.support_z_m + model.size_m[2] / 2 + 0.001)
    placement = ObjectPlacement(model.name, model.name, at, (1.0, 0.0, 0.0, 0.0))
    problem = Problem(model.name, "structured", "", model.name, (placement,))
    world = build_world(problem, None, workspace, load_model=lambda _: model)
    before = world.positions[0]
    run(world, 1.0)
    up = rotation_from_wxyz(world.wxyz[0])[2, 2]
    moved_m = float(np.linalg.norm(world.positions[0, :2] - before[:2]))
    return bool(np.arccos(np.clip(up, -1.0, 1.0)) < _STEADY_RAD and moved_m < _STEADY_M)
