"""The compiled checks say what plain loops over spheres and voxels say."""

from dataclasses import replace

import numpy as np
import pytest

from torc.collision.collision_world import SURFACE, UNKNOWN, CollisionWorld, world_from_voxels
from torc.collision.contacts import (
    attached_contacts,
    blockers,
    collides,
    robot_arrays,
    self_contacts,
    static_contacts,
    with_attached,
)
from torc.errors import InputError
from torc.geometry.transforms import invert, make_pose
from torc.motion.config import MotionConfig
from torc.motion.mover import Mover
from torc.robots.description import RobotDescription
from torc.robots.ik import solve_ik
from torc.robots.kinematics import link_poses, sphere_centers

DOF = 7
STICK = np.array([[x, 0.0, 0.16, 0.015] for x in np.linspace(-0.35, 0.35, 25)])
"""Attached spheres that reach far to both sides of the hand."""


def _voxel_gaps(world: CollisionWorld, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """[point, voxel] distance to each occupied cube; kinds and bits of those."""
    index = np.argwhere(world.kind > 0)
    low = world.grid.origin + world.grid.voxel_size_m * index
    gap = np.maximum(low - points[:, None], points[:, None] - low - world.grid.voxel_size_m)
    distance = np.linalg.norm(np.maximum(gap, 0.0), axis=2)
    at = tuple(index.T)
    return distance, world.kind[at], world.bits[at]


def _brute_force(world: CollisionWorld, robot: RobotDescription, q: np.ndarray, width_m: float, own: int):
    """(bits, static, self collision) of one configuration."""
    c, spheres = world.config, robot.spheres
    centers = sphere_centers(robot, q[None], np.array([width_m]))[0]
    arm = spheres.link < DOF
    radius = spheres.radii + np.where(arm, c.padding_m, c.gripper_padding_m)
    distance, kind, bits = _voxel_gaps(world, centers)
    touched = distance < radius[:, None]
    ours = (bits & (np.uint64(1) << np.uint64(own))) != 0 if own >= 0 else np.zeros(len(bits), dtype=bool)
    touched &= ~(ours & (kind == UNKNOWN))
    touched &= ~(ours & (kind == SURFACE) & ~arm[:, None])
    any_touched = touched.any(axis=0)
    static = bool(np.any(any_touched & (bits == 0)))
    low, high = world.boxes[:, :3], world.boxes[:, 3:]
    gap = np.linalg.norm(np.maximum(np.maximum(low - centers[:, None], centers[:, None] - high), 0.0), axis=2)
    padding = np.where(arm, c.padding_m, c.gripper_static_padding_m)
    static |= bool(np.any(gap < (spheres.radii + padding)[:, None]))
    between = np.linalg.norm(centers[:, None] - centers, axis=2) - spheres.radii[:, None] - spheres.radii
    own_pairs = any(
        np.any(between[np.ix_(spheres.link == a, spheres.link == b)] < c.self_padding_m)
        for a, b in robot.self_pairs
    )
    fixed = np.linalg.norm(centers[:, None] - robot.static_spheres[:, :3], axis=2)
    fixed -= spheres.radii[:, None] + robot.static_spheres[:, 3]
    own_fixed = np.any(fixed[np.isin(spheres.link, robot.static_links)] < c.self_padding_m)
    return np.bitwise_or.reduce(bits[any_touched], initial=np.uint64(0)), static, bool(own_pairs or own_fixed)


@pytest.mark.parametrize("own", [-1, 1, 3])
def test_blockers_agree_with_brute_force(world, robot, qpos, own, grasping):
    rng = np.random.default_rng(own + 10)
    some = np.vstack([qpos[:12], grasping[:24]])
    width = rng.uniform(0.0, 0.085, len(some))
    found = blockers(world, robot, some, width, own)
    expected = [_brute_force(world, robot, q, w, own) for q, w in zip(some, width)]
    np.testing.assert_array_equal(found.bits, np.array([b for b, _, _ in expected], dtype=np.uint64))
    np.testing.assert_array_equal(found.static, [s for _, s, _ in expected])
    np.testing.assert_array_equal(found.self_collision, [s for _, _, s in expected])
    assert 10 < np.count_nonzero(found.bits) < len(some)
    np.testing.assert_array_equal(collides(world, robot, some, width, own), ~found.free)


def test_unknown_voxels_hidden_by_nothing_are_static(world, robot, grasping):
    q = grasping[:80]
    nobody = _with_voxels(world, world.kind, np.zeros_like(world.bits))
    before, after = blockers(world, robot, q, 0.085, -1), blockers(nobody, robot, q, 0.085, -1)
    assert not after.bits.any()
    np.testing.assert_array_equal(after.static, before.static | (before.bits != 0))


def test_more_voxels_never_block_less(world, robot, qpos, grasping):
    rng = np.random.default_rng(1)
    q = np.vstack([qpos, grasping])
    before = blockers(world, robot, q, 0.06, 2)
    extra = (rng.random(world.kind.shape) < 0.02) & (world.kind == 0)
    kind, bits = world.kind.copy(), world.bits.copy()
    kind[extra], bits[extra] = SURFACE, np.uint64(1) << np.uint64(40)
    fuller = _with_voxels(world, kind, bits)
    after = blockers(fuller, robot, q, 0.06, 2)
    assert np.all(before.bits & ~after.bits == 0)
    assert np.all(after.static >= before.static)
    assert np.count_nonzero(after.bits & (np.uint64(1) << np.uint64(40))) > 20


def test_own_surface_counts_for_the_arm_but_not_for_the_gripper(world, robot, qpos, grasping):
    q = np.vstack([qpos, grasping])
    bit = np.uint64(1) << np.uint64(3)
    # Surface voxels scattered, an unknown one beside each: arm links touch one, the other, or both.
    surface = np.random.default_rng(9).random(world.kind.shape) < 0.002
    kind = np.where(np.roll(surface, (2, 1, 1), axis=(0, 1, 2)), UNKNOWN, 0).astype(np.uint8)
    kind[surface] = SURFACE
    everything = _with_voxels(world, kind, np.where(kind > 0, bit, np.uint64(0)))
    touched = blockers(everything, robot, q, 0.085, 3).bits == bit
    arm = np.stack([_arm_near_surface(everything, robot, x) for x in q])
    np.testing.assert_array_equal(touched, arm)
    assert 5 < np.count_nonzero(touched) < len(q) - 5
    assert np.any((blockers(everything, robot, q, 0.085, -1).bits == bit) & ~touched)


def test_fingertips_may_come_close_to_the_table(world, robot, workspace):
    free = world
    for k in range(12):
        free = free.without_object(k)
    static = {}
    for height in (0.005, -0.003):
        T = make_pose(np.diag([1.0, -1.0, -1.0]), (0.62, -0.2, workspace.support_z_m + height))
        q = solve_ik(robot.arm, (T @ invert(robot.gripper.T_tool0_tcp(0.05)))[None]).of(0)
        static[height] = blockers(free, robot, q, 0.05, -1).static
    assert not static[0.005].all()
    assert static[-0.003].all()


def test_nan_is_never_free(world, robot):
    q = np.full((1, DOF), np.nan)
    assert collides(world, robot, q, 0.05)[0]
    assert blockers(world, robot, q, 0.05, 0).static[0]


def test_attached_spheres_collide_like_the_gripper(world, robot, grasping):
    q = grasping
    q = q[~collides(world, robot, q, 0.05)]
    held = np.array([[0.0, 0.0, 0.22, 0.04], [0.02, 0.0, 0.26, 0.03]])
    tool0 = link_poses(robot.arm, q)[:, -1]
    expected = []
    for T in tool0:
        centers = held[:, :3] @ T[:3, :3].T + T[:3, 3]
        voxel = np.any(_voxel_gaps(world, centers)[0] < held[:, 3:])
        gap = np.maximum(
            np.maximum(world.boxes[:, :3] - centers[:, None], centers[:, None] - world.boxes[:, 3:]), 0
        )
        room = held[:, 3:] + world.config.attached_static_padding_m
        expected.append(voxel or np.any(np.linalg.norm(gap, axis=2) < room))
    np.testing.assert_array_equal(collides(world, robot, q, 0.05, attached=held), expected)
    assert 0 < np.count_nonzero(expected) < len(q)


def test_attached_spheres_touch_the_robot_where_they_overlap_it(world, robot, qpos):
    bare = self_contacts(world, robot, qpos, 0.05)
    found = self_contacts(world, robot, qpos, 0.05, attached=STICK)
    tool0, spheres = link_poses(robot.arm, qpos)[:, -1], robot.spheres
    others = spheres.link < DOF - 1
    expected = []
    for q, T in zip(qpos, tool0):
        held = STICK[:, :3] @ T[:3, :3].T + T[:3, 3]
        own = sphere_centers(robot, q[None], np.array([0.05]))[0][others]
        centers = np.vstack([own, robot.static_spheres[:, :3]])
        radii = np.append(spheres.radii[others], robot.static_spheres[:, 3])
        gap = np.linalg.norm(held[:, None] - centers, axis=2) - STICK[:, 3:] - radii
        expected.append(bool(np.any(gap < world.config.self_padding_m)))
    np.testing.assert_array_equal(found, bare | expected)
    assert 20 < np.count_nonzero(found & ~bare) < len(qpos) - 20
    assert np.all(collides(world, robot, qpos, 0.05, attached=STICK) >= found)


def test_some_attached_spheres_touch_something_fixed_where_all_together_do(world, robot, qpos):
    arrays = robot_arrays(robot)
    free = qpos[~static_contacts(world, robot, qpos, 0.05)]
    together = static_contacts(world, with_attached(arrays, STICK), free, 0.05)
    found = np.array([attached_contacts(world, robot, q, 0.05, STICK) for q in free])
    np.testing.assert_array_equal(found.any(axis=1), together)
    assert np.any(together & ~found.all(axis=1))
    for q, touching in zip(free, found):
        assert not static_contacts(world, with_attached(arrays, STICK[~touching]), q[None], 0.05)[0]


@pytest.mark.parametrize("scattered", [False, True])
@pytest.mark.parametrize("attached", [None, STICK], ids=["bare", "stick"])
def test_edges_collide_where_fine_samples_do(world, robot, qpos, grasping, scattered, attached):
    rng = np.random.default_rng(6)
    if scattered:
        # Obstacles as thin as one voxel: what is skipped too far is missed.
        kind = (rng.random(world.kind.shape) < 0.001).astype(np.uint8)
        world = _with_voxels(world, kind, np.where(kind > 0, np.uint64(1), np.uint64(0)))
    q = np.vstack([qpos, grasping])
    q = q[~collides(world, robot, q, 0.085, attached=attached)]
    a, b = q[rng.integers(len(q), size=150)], q[rng.integers(len(q), size=150)]
    b = a + rng.uniform(0.05, 1.0, (150, 1)) * (b - a)
    found = Mover(robot, MotionConfig()).space(world, 0.085, attached).edges_collide(a, b)
    lines = a[:, None] + np.linspace(0, 1, 400)[:, None] * (b - a)[:, None]
    fine = np.array([collides(world, robot, line, 0.085, attached=attached).any() for line in lines])
    # Nothing is invented, and what is missed only grazes: with paddings smaller by half a step nothing touches.
    assert not np.any(found & ~fine)
    c = world.config
    slack = 0.5 * c.edge_step_m
    looser = replace(
        world,
        config=replace(
            c,
            padding_m=c.padding_m - slack,
            gripper_padding_m=c.gripper_padding_m - slack,
            gripper_static_padding_m=c.gripper_static_padding_m - slack,
            attached_padding_m=c.attached_padding_m - slack,
            self_padding_m=c.self_padding_m - 2 * slack,
        ),
    )
    for line in lines[~found]:
        assert not collides(looser, robot, line, 0.085, attached=attached).any()
    assert 20 < np.count_nonzero(found) < 280


def test_static_contacts_leave_voxels_out(world, robot, qpos):
    found = blockers(world, robot, qpos, 0.085, -1)
    hits = static_contacts(world, robot, qpos, 0.085)
    assert np.all(hits <= (found.static | found.self_collision))
    assert np.any((found.bits != 0) & ~hits)


@pytest.mark.usefixtures("any_arrays")
def test_bad_shapes_are_refused(world, robot):
    arrays = robot_arrays(robot)
    with pytest.raises(InputError, match="shape"):
        collides(world, arrays, np.zeros((3, 6)), 0.05)


def _with_voxels(world: CollisionWorld, kind: np.ndarray, bits: np.ndarray) -> CollisionWorld:
    return world_from_voxels(world.grid, kind, bits, world.boxes, world.box_names, world.config)


def _arm_near_surface(world: CollisionWorld, robot: RobotDescription, q: np.ndarray) -> bool:
    centers = sphere_centers(robot, q[None], np.array([0.085]))[0]
    arm = robot.spheres.link < DOF
    distance, kind, _ = _voxel_gaps(world, centers[arm])
    return bool(
        np.any(distance[:, kind == SURFACE] < (robot.spheres.radii[arm] + world.config.padding_m)[:, None])
    )
