"""Whether the physics takes an object, and whether it stands where it is put."""

from dataclasses import dataclass

import numpy as np

from torc.geometry.transforms import rotation_from_wxyz
from torc.objects.models import ObjectModel
from torc.problems.problem import ObjectPlacement, Problem
from torc.sim.settling import run
from torc.sim.world import World, build_world
from torc.workspace.files import load_workspace

_STEADY_RAD, _STEADY_M = float(np.deg2rad(8.0)), 0.02


@dataclass(frozen=True)
class ObjectCheck:
    """What an object did within a second after it was set on the table: how far its z axis leans from the vertical, and
    how far it went along the table.
    """

    tilt_rad: float
    moved_m: float

    @property
    def stands(self) -> bool:
        """It neither fell over nor rolled away."""
        return self.tilt_rad < _STEADY_RAD and self.moved_m < _STEADY_M


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


def check_object(model: ObjectModel) -> ObjectCheck:
    """Sets the object on the table and watches it for a second. Raises InputError if MuJoCo does not accept it, and
    PhysicsError if the simulation broke.
    """
    world = world_with(model)
    before = world.positions[0]
    run(world, 1.0)
    up = rotation_from_wxyz(world.wxyz[0])[2, 2]
    moved = float(np.linalg.norm(world.positions[0, :2] - before[:2]))
    return ObjectCheck(float(np.arccos(np.clip(up, -1.0, 1.0))), moved)
