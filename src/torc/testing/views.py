"""One snapshot of analytic shapes with everything made from it."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from torc.collision.collision_world import CollisionWorld, build_collision_world
from torc.occlusion.volume import FIXED_CAMERA, empty_volume, update_volume
from torc.records import OcclusionVolume, SegmentedScene
from torc.testing.contexts import perceive
from torc.testing.synthetic import Shape, random_clutter
from torc.workspace.description import Workspace
from torc.workspace.workspace_files import load_workspace


@dataclass(frozen=True)
class View:
    """The fixed camera's view of shapes on the table: the scene with given masks, the volume after one snapshot."""

    shapes: tuple[Shape, ...]
    workspace: Workspace
    scene: SegmentedScene
    volume: OcclusionVolume

    @cached_property
    def world(self) -> CollisionWorld:
        """The obstacles."""
        return build_collision_world(self.volume, self.workspace)


def view_of(*shapes: Shape, workspace: Workspace | None = None) -> View:
    """Take one snapshot of shapes."""
    workspace = load_workspace() if workspace is None else workspace
    scene = perceive(shapes, workspace.camera)
    volume = update_volume(empty_volume(workspace.grid), scene, FIXED_CAMERA)
    return View(shapes, workspace, scene, volume)


def view_of_clutter(seed: int, n: int, workspace: Workspace | None = None) -> View:
    """Take one snapshot of n random shapes, some on top of others."""
    return view_of(*random_clutter(np.random.default_rng(seed), n), workspace=workspace)
