"""Annotations of GraspClutter6D: the true poses come back, documented faults are met, and bad files are refused."""

import json
from collections import Counter

import numpy as np
import pytest

from tests.helpers.graspclutter6d_tree import edit_json, upright, write_tree
from torc.errors import InputError
from torc.generation.graspclutter6d.reading import (
    check_root,
    image_id,
    object_words,
    paper_problems,
    parse_object_name,
    published_category,
    read_scene,
)

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


def test_every_scene_has_a_label_and_every_object_words():
    labels = Counter(published_category(scene) for scene in range(1000))
    assert labels == {"structured": 66 + 116, "unstructured": 626 + 192}
    with pytest.raises(InputError, match="Give --category"):
        published_category(1000)
    assert object_words(44) == "the can of peaches"
    assert object_words(42) == "object 42 of GraspClutter6D"


@pytest.mark.parametrize("text", ["44_1", "obj_000044_1", "000044_1"])
def test_objects_are_named_in_short_or_in_full(text):
    assert parse_object_name(text) == (44, 1)
    assert parse_object_name(text[:-2]) == (44, None)


@pytest.mark.parametrize("text", ["", "0", "44_", "../44", "44_1_2", "obj_44_1\n", "4" * 30, "٤٤", "-1"])
def test_anything_else_is_refused(text):
    with pytest.raises(InputError, match="is no object of a scene"):
        parse_object_name(text)
