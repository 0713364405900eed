"""Analytic scenes for the tests of this package."""

from dataclasses import dataclass

import numpy as np

from torc.collision.world import CollisionWorld, build_collision_world
from torc.occlusion.volume import OcclusionConfig, empty_volume, update_volume
from torc.perception.privileged import LabelPerception
from torc.records import OcclusionVolume, SegmentedScene
from torc.scenes.workspace import Workspace
from torc.testing.synthetic import Shape, SyntheticBox, random_clutter, synthetic_observation

WORKSPACE = Workspace()
TABLE_Z = WORKSPACE.support_z_m


@dataclass(frozen=True)
class View:
    """One snapshot of shapes, perceived."""

    shapes: tuple[Shape, ...]
    scene: SegmentedScene
    volume: OcclusionVolume

    @property
    def world(self) -> CollisionWorld:
        return build_collision_world(self.volume, WORKSPACE)


def view_of(*shapes: Shape) -> View:
    scene = LabelPerception().perceive(synthetic_observation(shapes))
    config = OcclusionConfig(out_of_view_is_free=True)
    return View(shapes, scene, update_volume(empty_volume(WORKSPACE.grid), scene, config))


def standing_box(object_id, x, y, size, yaw=0.0, z=TABLE_Z) -> SyntheticBox:
    wxyz = (float(np.cos(yaw / 2)), 0.0, 0.0, float(np.sin(yaw / 2)))
    return SyntheticBox(object_id, (x, y, z + size[2] / 2), size, wxyz)


def clutter(seed: int, n: int) -> View:
    return view_of(*random_clutter(np.random.default_rng(seed), n))
