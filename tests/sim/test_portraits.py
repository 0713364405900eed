"""A portrait shows the whole object, large, and is the same every time."""

from dataclasses import replace

import numpy as np
import pytest

from torc.geometry.transforms import project
from torc.objects.library import load_object, object_names
from torc.objects.models import CollisionPiece
from torc.sim.portraits import portrait, portrait_camera, stands
from torc.workspace.workspace_files import load_workspace

TABLE = np.array(load_workspace().table.center)


@pytest.mark.parametrize("size", [(300, 250), (120, 300)])
def test_the_camera_sees_all_of_every_object_and_it_is_large(size):
    width, height = size
    for name in object_names()[::5]:
        model = load_object(name)
        center = np.array([*TABLE[:2], load_workspace().support_z_m + model.size_m[2] / 2])
        points = np.concatenate([mesh.vertices for mesh in model.visuals]) + center
        mount = portrait_camera(model, width, height)
        cols, rows, depth = project(points, mount.K, mount.T_world_camera)
        assert depth.min() > 0.05
        assert 0 <= cols.min() < cols.max() <= width - 1
        assert 0 <= rows.min() < rows.max() <= height - 1
        filled = max(np.ptp(cols) / width, np.ptp(rows) / height)
        assert filled > 0.6, name


def test_a_portrait_shows_the_object_in_its_colors():
    model = load_object("die_red")
    picture = portrait(model, 120, 100)
    assert picture.shape == (100, 120, 3)
    red = (picture[..., 0] > 90) & (picture[..., 1:].max(axis=2) < 0.5 * picture[..., 0])
    assert red.mean() > 0.15
    np.testing.assert_array_equal(picture, portrait(model, 120, 100))


@pytest.mark.parametrize("name", ["mug_red", "banana_yellow", "soup_can_red"])
def test_built_in_objects_stand(name):
    assert stands(load_object(name))


def test_what_leans_out_too_far_does_not_stand():
    pole = CollisionPiece("box", (0.01, 0.01, 0.1))
    arm = CollisionPiece("box", (0.04, 0.01, 0.01), (0.05, 0.0, 0.09))
    model = replace(load_object("die_red"), pieces=(pole, arm), size_m=(0.1, 0.02, 0.2))
    assert not stands(model)
