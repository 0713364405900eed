"""Annotations of GraspClutter6D: the true poses come back, documented faults are met, and bad files are refused."""

import json
from collections import Counter

import numpy as np
import pytest

from tests.helpers.graspclutter6d_tree import SOLIDS, edit_json, upright, write_tree
from tests.helpers.plain_mesh_reader import read_plain_mesh
from torc.errors import InputError
from torc.generation.graspclutter6d import placing
from torc.generation.graspclutter6d.placing import convert_object
from torc.generation.graspclutter6d.reading import (
    check_root,
    image_id,
    object_words,
    paper_problems,
    parse_object_name,
    published_category,
    read_scene,
)
from torc.geometry.transforms import transform_points
from torc.objects.library import load_object

USED = str(image_id(3, "realsense-d435"))
OBJECTS = (
    upright(17, 0.0, 0.0, 0.3),
    upright(44, 0.10, 0.05),
    upright(56, -0.10, 0.0, 1.0),
    upright(44, 0.10, -0.05, -0.7),
)


@pytest.fixture
def root(tmp_path):
    write_tree(tmp_path / "gc6d", {249: OBJECTS})
    return tmp_path / "gc6d"


def _edit(root, name, change):
    edit_json(root / "scenes" / "000249" / name, change)


def _is_true(scene):
    return all(np.allclose(o.T_table_mesh, true.T_table_mesh) for o, true in zip(scene.objects, OBJECTS))


@pytest.mark.parametrize(
    ("annotation", "camera"), [(3, "realsense-d435"), (0, "realsense-d415"), (4, "zivid")]
)
def test_poses_on_the_table_are_the_true_ones_by_every_picture(root, annotation, camera):
    scene = read_scene(root, 249, annotation, camera)
    assert _is_true(scene)
    names = ["obj_000017_0", "obj_000044_0", "obj_000056_0", "obj_000044_1"]
    assert [o.name for o in scene.objects] == names


def test_the_pose_equals_the_product_of_the_numbers_in_the_files(root):
    directory = root / "scenes" / "000249"
    camera = json.loads((directory / "scene_camera.json").read_text())[USED]
    truth = json.loads((directory / "scene_gt.json").read_text())[USED]
    R, t = np.reshape(camera["cam_R_w2c"], (3, 3)), np.array(camera["cam_t_w2c"])
    for o, entry in zip(read_scene(root, 249).objects, truth):
        assert np.allclose(o.T_table_mesh[:3, :3], R @ np.reshape(entry["cam_R_m2c"], (3, 3)), atol=1e-9)
        assert np.allclose(1000 * o.T_table_mesh[:3, 3], R @ entry["cam_t_m2c"] + t, atol=1e-6)


def test_a_frame_that_is_not_a_tables_is_refused(root):
    def turn(data):
        flip = np.diag([1.0, -1.0, -1.0])
        for camera in data.values():
            camera["cam_R_w2c"] = (flip @ np.reshape(camera["cam_R_w2c"], (3, 3))).ravel().tolist()
            camera["cam_t_w2c"] = (flip @ camera["cam_t_w2c"]).tolist()

    _edit(root, "scene_camera.json", turn)
    with pytest.raises(InputError, match="below the objects"):
        read_scene(root, 249)


def _first(key, value):
    return lambda d: d[USED][0].update({key: value})


@pytest.mark.parametrize(
    ("name", "fault", "told"),
    [
        ("scene_gt", lambda d: d.pop(USED), "no picture 14"),
        ("scene_gt", lambda d: d.update({USED: []}), "too few"),
        ("scene_gt", lambda d: d[USED][0].pop("cam_t_m2c"), "cam_t_m2c: is missing"),
        ("scene_gt", _first("cam_R_m2c", [2, 0, 0, 0, 1, 0, 0, 0, 1]), "no rotation"),
        ("scene_gt", _first("cam_R_m2c", [1, 0, 0, 0, 1, 0, 0, 0, -1]), "no rotation"),
        ("scene_gt", _first("cam_t_m2c", [0, 0, float("nan")]), "finite"),
        ("scene_gt", lambda d: [e.update(cam_t_m2c=[0.1, 0.1, 0.6]) for e in d[USED]], "millimetres"),
        ("scene_camera", lambda d: d[USED].pop("cam_R_w2c"), "cam_R_w2c: is missing"),
    ],
)
def test_bad_entries_are_refused_by_name(root, name, fault, told):
    _edit(root, f"{name}.json", fault)
    with pytest.raises(InputError, match=told) as error:
        read_scene(root, 249)
    assert name in str(error.value)


def test_what_is_missing_is_named(root):
    (root / "scenes" / "000249" / "scene_gt.json").unlink()
    with pytest.raises(InputError, match=r"scene_gt\.json is missing"):
        read_scene(root, 249)
    with pytest.raises(InputError, match="000250 is missing"):
        read_scene(root, 250)
    with pytest.raises(InputError, match="not the root of GraspClutter6D"):
        check_root(root / "scenes")


def test_the_paper_has_forty_problems_half_of_them_structured():
    problems = paper_problems()
    assert Counter(p.category for p in problems) == {"structured": 20, "unstructured": 20}
    assert len({(p.scene, p.target) for p in problems}) == 40
    assert all(published_category(p.scene) == p.category for p in problems)
    assert all("object" not in object_words(parse_object_name(p.target)[0]) for p in problems)


@pytest.mark.parametrize("text", ["", "0", "44_", "../44", "44_1_2", "obj_44_1\n", "4" * 30, "٤٤", "-1"])
def test_anything_else_is_refused(text):
    with pytest.raises(InputError, match="is no object of a scene"):
        parse_object_name(text)


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
