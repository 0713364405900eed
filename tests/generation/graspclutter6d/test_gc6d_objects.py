"""Meshes of GraspClutter6D become objects in the store: once, in metres, with the mesh frame known."""

import numpy as np
import pytest

from tests.helpers.graspclutter6d_tree import SOLIDS, upright, write_tree
from tests.helpers.plain_mesh_reader import read_plain_mesh
from torc.errors import InputError
from torc.generation.graspclutter6d import objects
from torc.generation.graspclutter6d.objects import convert_object
from torc.geometry.transforms import transform_points
from torc.objects.library import load_object, object_description

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

    monkeypatch.setattr(objects, "read_mesh", reader)
    return read


def _tree(root, *folders):
    write_tree(root, {1: [upright(i, 0.1 * k, 0.0) for k, i in enumerate(IDS)]}, models=folders, images=1)
    return root


def _covers(converted, object_id, atol):
    """Whether the model is the mesh, where T_object_mesh says that it is."""
    mesh = transform_points(converted.T_object_mesh, SOLIDS[object_id][0])
    for bound in (np.min, np.max):
        assert np.allclose(bound(mesh, axis=0), bound(converted.visible_points, axis=0), atol=atol)


def test_an_object_is_converted_once_and_then_comes_from_the_store(tmp_path, plain):
    root, told = _tree(tmp_path / "tree", "models_obj_m"), []
    first = convert_object(root, 17, "the potted meat can", told.append)
    again = convert_object(root, 17, "the potted meat can", told.append)
    assert plain == [("models_obj_m", 1.0)]
    assert told == ["converting gc6d_000017: the potted meat can"]
    assert np.array_equal(first.T_object_mesh, again.T_object_mesh)
    assert load_object("gc6d_000017").size_m == pytest.approx((0.05, 0.10, 0.08))
    assert object_description("gc6d_000017") == "the potted meat can"


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
def test_a_folder_in_the_wrong_unit_is_noticed_and_noted(tmp_path, plain, folder, calls_itself):
    root = _tree(tmp_path / "tree", folder)
    (root / folder).rename(root / calls_itself)
    converted = convert_object(root, 44, "a can", str)
    assert "against the folder's name" in converted.notes[0]
    _covers(converted, 44, 1e-6)


def test_somebody_elses_object_of_that_name_is_left_alone(tmp_path, plain, store):
    root = _tree(tmp_path / "tree", "models_obj_m")
    convert_object(root, 17, "a can", str)
    facts = store / "gc6d_000017" / "object.yaml"
    facts.write_text(facts.read_text().replace("GraspClutter6D, CC-BY-SA-4.0", "my own"))
    with pytest.raises(InputError, match="is not from GraspClutter6D"):
        convert_object(root, 17, "a can", str)


def test_the_real_mesh_reader_keeps_the_frame_too(tmp_path, store):
    root = _tree(tmp_path / "tree", "models_obj_m", "models")
    (root / "models_obj_m" / "obj_000044.obj").unlink()  # that one comes from models/, as PLY in millimetres
    for object_id in IDS:
        converted = convert_object(root, object_id, "a thing", str)
        _covers(converted, object_id, 1e-4)
    assert load_object("gc6d_000017").visuals[0].texture is not None


def test_another_data_sets_mesh_of_that_number_is_not_passed_over(tmp_path, store):
    pytest.importorskip("coacd")
    convert_object(_tree(tmp_path / "one", "models_obj_m"), 17, "the can", lambda _: None)
    other = _tree(tmp_path / "other", "models_obj_m")
    assert convert_object(other, 17, "the can", lambda _: None).notes == ()
    (mesh,) = (other / "models_obj_m").rglob("obj_000017.obj")
    mesh.write_text(mesh.read_text() + "# another\n")
    with pytest.raises(InputError, match="was made from another mesh than"):
        convert_object(other, 17, "the can", lambda _: None)
    mesh.unlink()  # once converted, the meshes are not needed
    convert_object(other, 17, "the can", lambda _: None)
