"""Visible fractions: counted pixel by pixel as the renderer counts them, and the world left as it was."""

import numpy as np
import pytest
from sim_scenes import problem, standing, world_of

from torc.geometry.transforms import invert, transform_points
from torc.problems.problem import load_problem
from torc.sim.gl import gl_backend
from torc.sim.rendering import CameraRenderer
from torc.sim.settling import UNSEEN
from torc.sim.simulated_world import Presence, build_world, save_state
from torc.sim.visibility import filled_voxels, measure_visibility
from torc.workspace.workspace_files import load_workspace

MOUNT = load_workspace().camera


def _counts(world, backend):
    with CameraRenderer(world, MOUNT, backend) as renderer:
        labels = renderer.render().label_image
    return np.bincount(labels[labels >= 0], minlength=world.object_count)


@pytest.fixture(scope="module")
def cluttered():
    return build_world(load_problem("unstructured-01"), None, load_workspace())


def test_pixels_are_those_of_the_picture(cluttered):
    counted = measure_visibility(cluttered, MOUNT)
    assert counted.pixels.tolist() == _counts(cluttered, "rays").tolist()
    if gl_backend() != "rays":
        assert np.abs(counted.pixels - _counts(cluttered, gl_backend())).max() <= 8


def test_what_hides_an_object_is_what_shows_in_its_place(cluttered):
    counted, whole = measure_visibility(cluttered, MOUNT), load_problem("unstructured-01")
    with CameraRenderer(cluttered, MOUNT, "rays") as renderer:
        labels = renderer.render().label_image
    for k in (0, 6):
        with CameraRenderer(
            build_world(problem(whole.ordered()[k]), None, load_workspace()), MOUNT, "rays"
        ) as renderer:
            alone = renderer.render().label_image == 0
        in_front = labels[alone & (labels != k)]
        counts = np.bincount(in_front[in_front >= 0], minlength=cluttered.object_count)
        assert counted.hidden_by[k].tolist() == counts.tolist()
        assert counts.sum() > 100
    # No robot, and nothing else stands between camera and table: all that does not show is behind another object.
    hidden = counted.pixels_alone - counted.pixels
    assert counted.hidden_by.sum(axis=1).tolist() == hidden.tolist()


def test_the_world_is_as_before(cluttered):
    before = save_state(cluttered)
    measure_visibility(cluttered, MOUNT)
    assert np.array_equal(before, save_state(cluttered))


def test_fractions_where_they_are_known():
    world = world_of(
        standing("free", "soup_can_red", 0.60, 0.10),
        standing("front", "cereal_box_yellow", 0.56, -0.20),
        standing("behind", "die_red", 0.64, -0.22),
        standing("gone", "apple_red", 0.80, 0.10),
    )
    world.park(3, Presence.DROPPED)
    seen = measure_visibility(world, MOUNT)
    assert seen.fractions[0] == 1.0
    assert seen.fractions[1] == 1.0
    assert seen.fractions[2] == 0.0
    assert seen.pixels_alone[2] > 50
    assert np.argwhere(seen.hidden_by).tolist() == [[2, 1]]
    assert seen.hidden_by[2, 1] == seen.pixels_alone[2]
    assert seen.fractions[3] == 0.0
    assert seen.pixels_alone[3] == 0
    assert world.presence[3] == Presence.DROPPED


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
