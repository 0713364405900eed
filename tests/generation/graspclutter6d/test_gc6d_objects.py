"""Meshes of GraspClutter6D become objects in the store: once, in metres, with the mesh frame known."""

import numpy as np
import pytest

from tests.helpers.graspclutter6d_tree import SOLIDS, upright, write_tree
from tests.helpers.plain_mesh_reader import read_plain_mesh
from torc.errors import InputError
from torc.generation.graspclutter6d import placing
from torc.generation.graspclutter6d.placing import convert_object
from torc.geometry.transforms import transform_points
from torc.objects.library import load_object

IDS = (17, 44)


@pytest.fixture
def instant_meshes():
    """Here meshes are really read, but where a test asks for `plain`."""


@pytest.fixture
def store(tmp_path, monkeypatch):
    monkeypatch.setenv("TORC_OBJECTS", str(tmp_path / "store"))
    return tmp_path / "store"


@pytest.fixture
def plain(monkeypatch, store):
    """Instant conversions; tells what was read."""
    read = []

    def reader(path, options):
        read.append((path.parent.name, options.scale))
        return read_plain_mesh(path, options)

    monkeypatch.setattr(placing, "read_mesh", reader)
    return read


def _tree(root, *folders):
    write_tree(root, {1: [upright(i, 0.1 * k, 0.0) for k, i in enumerate(IDS)]}, models=folders, images=1)
    return root


def _covers(converted, object_id, atol):
    """Whether the model is the mesh, where T_object_mesh says that it is."""
    mesh = transform_points(converted.T_object_mesh, SOLIDS[object_id][0])
    seen = np.concatenate([visual.vertices for visual in converted.model.visuals])
    for bound in (np.min, np.max):
        assert np.allclose(bound(mesh, axis=0), bound(seen, axis=0), atol=atol)


@pytest.mark.parametrize("folder", ["models_obj_m", "models_m", "models_obj", "models", "models_obj_eval"])
def test_every_folder_of_meshes_gives_metres(tmp_path, plain, folder):
    root = _tree(tmp_path / "tree", folder, "models_eval")
    for object_id in IDS:
        converted = convert_object(root, object_id, "a thing", str)
        assert converted.notes == ()
        _covers(converted, object_id, 1e-6)
    assert {read_in for read_in, _ in plain} == {folder}  # the best of those that are there
    with pytest.raises(InputError, match=r"no mesh of obj_000043.* models_obj_m is the best"):
        convert_object(root, 43, "a thing", str)


@pytest.mark.parametrize(("folder", "calls_itself"), [("models_obj", "models_obj_m"), ("models_m", "models")])
def test_a_folder_in_the_wrong_unit_is_noticed(tmp_path, plain, folder, calls_itself):
    root = _tree(tmp_path / "tree", folder)
    (root / folder).rename(root / calls_itself)
    converted = convert_object(root, 44, "a can", str)
    _covers(converted, 44, 1e-6)


def test_the_real_mesh_reader_keeps_the_frame_too(tmp_path, store):
    root = _tree(tmp_path / "tree", "models_obj_m", "models")
    (root / "models_obj_m" / "obj_000044.obj").unlink()  # that one comes from models/, as PLY in millimetres
    for object_id in IDS:
        converted = convert_object(root, object_id, "a thing", str)
        _covers(converted, object_id, 1e-4)
    assert load_object("gc6d_000017").visuals[0].texture is not None
