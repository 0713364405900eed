"""The voxels that objects fill, against each voxel asked by itself."""

import numpy as np

from torc.geometry.transforms import invert, transform_points
from torc.problems.problem import load_problem
from torc.sim.settling import UNSEEN
from torc.sim.simulated_world import Presence, build_world
from torc.sim.visibility import filled_voxels
from torc.workspace.workspace_files import load_workspace


def test_a_voxel_is_filled_where_its_middle_is_within_some_object():
    problem, workspace = load_problem("structured-04"), load_workspace()
    world = build_world(problem, None, workspace, UNSEEN)
    full = filled_voxels(world)
    rng = np.random.default_rng(0)
    at = np.concatenate([np.argwhere(full)[::97], rng.integers(0, workspace.grid.shape, (400, 3))])
    centers = workspace.grid.origin + workspace.grid.voxel_size_m * (at + 0.5)
    by_hand = np.zeros(len(at), dtype=bool)
    for placement, model in zip(problem.ordered(), world.models):
        points = transform_points(invert(placement.T_world_object), centers)
        for piece in model.pieces:
            by_hand |= piece.contains(points)
    np.testing.assert_array_equal(full[tuple(at.T)], by_hand)
    world.park(3, Presence.DELIVERED)
    assert filled_voxels(world).sum() < full.sum()
