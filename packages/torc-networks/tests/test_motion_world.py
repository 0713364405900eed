"""The world that a motion server is told, and torc's own planner that plans in it."""

import numpy as np
import pytest

from torc.collision.collision_world import FREE, SURFACE, UNKNOWN
from torc.collision.contacts import robot_arrays
from torc.errors import InputError
from torc.motion.space import free_space
from torc.testing.motion_conformance import requests
from torc_networks.motion.world import attached_spheres, voxel_esdf, world_fields


@pytest.fixture
def sampling(own_parts):
    """The handler of torc's own planner."""
    return own_parts.plan


@pytest.mark.parametrize("share", [0.02, 0.3, 0.8])
def test_the_distances_against_every_pair_of_voxels(rng, share):
    shape, size = (5, 7, 4), 0.02
    occupied = rng.random(shape) < share
    occupied[0, 0, 0], occupied[-1, -1, -1] = True, False
    found = voxel_esdf(occupied, size)
    index = np.argwhere(np.ones(shape, bool))
    for here in index:
        others = index[occupied[tuple(index.T)] != occupied[tuple(here)]]
        gap = (np.linalg.norm(others - here, axis=1).min() - 0.5) * size
        assert found[tuple(here)] == pytest.approx(-gap if occupied[tuple(here)] else gap, abs=1e-7)


def test_the_sign_is_that_of_curobo_from_0_8_on():
    """Negative inside, positive outside; the surface between two voxels."""
    row = np.zeros((6, 1, 1), bool)
    row[2:5] = True
    np.testing.assert_allclose(
        voxel_esdf(row, 0.1).ravel(), [0.15, 0.05, -0.05, -0.15, -0.05, 0.05], atol=1e-7
    )


def test_a_world_that_is_all_free_or_all_full_has_the_largest_distance():
    assert (voxel_esdf(np.zeros((2, 3, 4), bool), 0.1) == 10).all()
    assert (voxel_esdf(np.ones((2, 3, 4), bool), 0.1) == -10).all()


def test_unknown_voxels_are_obstacles_and_carved_ones_are_none(robot):
    arm, world = robot.arm, requests()[0].world
    arrays = robot_arrays(robot)
    space = free_space(arrays, world, 0.05, (arm.lower, arm.upper), arm.max_speed)
    esdf = world_fields(space)["esdf"]
    assert (world.kind == UNKNOWN).any()
    np.testing.assert_array_equal(esdf < 0, (world.kind == SURFACE) | (world.kind == UNKNOWN))
    lighter = world.without_object(1)
    assert (lighter.kind == FREE).sum() > (world.kind == FREE).sum()
    space = free_space(arrays, lighter, 0.05, (arm.lower, arm.upper), arm.max_speed)
    np.testing.assert_array_equal(world_fields(space)["esdf"] < 0, lighter.kind != FREE)


def test_what_is_held_is_told_as_spheres(robot):
    arm, world = robot.arm, requests()[0].world
    arrays = robot_arrays(robot)
    spheres = np.array([[0.0, 0.01, 0.2, 0.03], [0.02, 0.0, 0.25, 0.02]])
    held = free_space(arrays, world, 0.05, (arm.lower, arm.upper), arm.max_speed, spheres)
    np.testing.assert_array_equal(attached_spheres(held.robot), spheres)
    assert attached_spheres(arrays).shape == (0, 4)


def _request(robot, **changed):
    world = {"esdf": np.ones((2, 2, 2)), "voxel_size": 0.1, "pose": np.array([0, 0, 0, 1.0, 0, 0, 0])}
    world |= {"boxes": np.zeros((0, 6)), "padding": np.zeros((3, 2)), "self_padding": 0.0}
    q = robot.arm.rest_qpos
    move = {"start": q, "goals": q[None] + 0.1, "joint_names": list(robot.arm.joint_names), "seed": 1}
    return move | world | {"width": 0.05, "attached": np.zeros((0, 4))} | changed


def test_torcs_own_server_plans_in_the_world_that_it_is_told(robot, sampling):
    assert "positions" in sampling(_request(robot))
    wall = {"esdf": -np.ones((2, 2, 2)), "voxel_size": 5.0}
    assert "failure" in sampling(_request(robot, **wall))
    assert "failure" in sampling(_request(robot, boxes=np.array([[-9.0, -9, -9, 9, 9, 9]])))


@pytest.mark.parametrize(
    "wrong",
    [
        {"joint_names": ["a"]},
        {"start": np.zeros(6)},
        {"goals": np.zeros((0, 7))},
        {"goals": np.full((1, 7), np.nan)},
        {"width": 3.0},
        {"width": "wide"},
        {"pose": np.array([0, 0, 0, 0.0, 1, 0, 0])},
        {"esdf": np.ones((0, 2, 2))},
        {"voxel_size": 0.0},
        {"seed": -1},
    ],
    ids=str,
)
def test_torcs_own_server_refuses_bad_requests(robot, sampling, wrong):
    with pytest.raises(InputError):
        sampling(_request(robot, **wrong))
