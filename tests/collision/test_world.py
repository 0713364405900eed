"""Who owns which voxel."""

from dataclasses import replace

import numpy as np
import pytest

from torc.collision.collision_world import (
    FREE,
    SURFACE,
    UNKNOWN,
    CollisionConfig,
    build_collision_world,
)
from torc.collision.contacts import blockers, carved, collides
from torc.errors import InputError
from torc.records import BACKGROUND, EMPTY


def test_surface_and_unknown_voxels_keep_their_owners(volume, world):
    owned = volume.surface_label >= 0
    assert np.all(world.kind[owned] == SURFACE)
    np.testing.assert_array_equal(
        world.bits[owned], np.uint64(1) << volume.surface_label[owned].astype(np.uint64)
    )
    hidden = ~volume.seen & (volume.surface_label == EMPTY)
    assert np.all(world.kind[hidden] == UNKNOWN)
    np.testing.assert_array_equal(world.bits[hidden], volume.hidden_by[hidden])
    assert np.all(world.kind[volume.seen & (volume.surface_label == EMPTY)] == FREE)


def test_background_next_to_the_table_is_the_table_and_elsewhere_an_obstacle(volume, workspace):
    label = np.full(volume.grid.shape, EMPTY, dtype=np.int16)
    label[30, 50, 0] = BACKGROUND
    label[30, 50, 20] = BACKGROUND
    bare = replace(
        volume,
        seen=np.ones(label.shape, dtype=bool),
        hidden_by=np.zeros(label.shape, dtype=np.uint64),
        surface_label=label,
    )
    world = build_collision_world(bare, workspace)
    assert world.kind[30, 50, 0] == FREE
    assert world.kind[30, 50, 20] == SURFACE
    assert world.bits[30, 50, 20] == 0


def test_without_object_leaves_the_others_alone(world):
    own = (world.bits & np.uint64(2)) != 0
    assert np.any(own & (world.kind == SURFACE))
    assert np.any(own & (world.kind == UNKNOWN))
    gone = world.without_object(1)
    assert np.all(gone.kind[own] == FREE)
    np.testing.assert_array_equal(gone.kind[~own], world.kind[~own])
    kept = world.without_object(1, unknown=False)
    np.testing.assert_array_equal(kept.kind == UNKNOWN, world.kind == UNKNOWN)
    assert not np.any(own & (kept.kind == SURFACE))


def test_carving_frees_the_place_where_the_robot_is_and_only_there(world, robot, grasping):
    touched = blockers(world, robot, grasping, 0.085, -1)
    only_voxels = np.flatnonzero((touched.bits != 0) & ~touched.static & ~touched.self_collision)
    assert len(only_voxels) > 5
    for i in only_voxels[:5]:
        opened = carved(world, robot, grasping[i], 0.085)
        assert not collides(opened, robot, grasping[i][None], 0.085)[0]
        assert np.all((opened.kind == world.kind) | (opened.kind == FREE))
    owner = int(touched.bits[only_voxels[0]]).bit_length() - 1
    some = carved(world, robot, grasping[only_voxels[0]], 0.085, only_id=owner)
    changed = some.kind != world.kind
    assert np.any(changed)
    assert np.all(world.bits[changed] & (np.uint64(1) << np.uint64(owner)) != 0)


def test_edge_step_must_be_positive():
    with pytest.raises(InputError, match="edge_step_m"):
        CollisionConfig(edge_step_m=0.0)
