"""Annotations of GraspClutter6D: the true poses come back, documented faults are met, and bad files are refused."""

import json

import numpy as np
import pytest

from tests.helpers.graspclutter6d_tree import camera_poses, edit_json, upright, write_tree
from torc.errors import InputError
from torc.generation.graspclutter6d.reading import check_root, image_id, read_scene

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
    assert scene.notes == ()


def test_the_pose_equals_the_product_of_the_numbers_in_the_files(root):
    directory = root / "scenes" / "000249"
    camera = json.loads((directory / "scene_camera.json").read_text())[USED]
    truth = json.loads((directory / "scene_gt.json").read_text())[USED]
    R, t = np.reshape(camera["cam_R_w2c"], (3, 3)), np.array(camera["cam_t_w2c"])
    for o, entry in zip(read_scene(root, 249).objects, truth):
        assert np.allclose(o.T_table_mesh[:3, :3], R @ np.reshape(entry["cam_R_m2c"], (3, 3)), atol=1e-9)
        assert np.allclose(1000 * o.T_table_mesh[:3, 3], R @ entry["cam_t_m2c"] + t, atol=1e-6)


def test_camera_poses_named_rightly_are_noticed_and_inverted(tmp_path):
    write_tree(tmp_path / "tree", {249: OBJECTS}, named_rightly=True)
    scene = read_scene(tmp_path / "tree", 249)
    assert _is_true(scene)
    assert "world-to-camera" in scene.notes[0]


def test_a_single_picture_is_read_as_the_public_api_does_and_says_so(root):
    for name in ("scene_camera.json", "scene_gt.json"):
        _edit(root, name, lambda d: [d.pop(k) for k in list(d) if k != USED])
    scene = read_scene(root, 249)
    assert _is_true(scene)
    assert "cross-checked" in scene.notes[0]


def test_pictures_that_disagree_are_noted(root):
    def shake(data):
        for k, image in enumerate(data):
            for entry in data[image]:
                entry["cam_t_m2c"][0] += 100.0 * (k % 3)

    _edit(root, "scene_gt.json", shake)
    assert "disagree" in read_scene(root, 249).notes[0]


def test_a_frame_that_is_not_a_tables_is_refused(root):
    def turn(data):
        flip = np.diag([1.0, -1.0, -1.0])
        for camera in data.values():
            camera["cam_R_w2c"] = (flip @ np.reshape(camera["cam_R_w2c"], (3, 3))).ravel().tolist()
            camera["cam_t_w2c"] = (flip @ camera["cam_t_w2c"]).tolist()

    _edit(root, "scene_camera.json", turn)
    with pytest.raises(InputError, match="below the objects"):
        read_scene(root, 249)


def test_an_unreadable_other_picture_is_noted_and_does_no_harm(root):
    _edit(root, "scene_gt.json", lambda d: d["5"][0].pop("cam_R_m2c"))
    scene = read_scene(root, 249)
    assert "picture 5" in scene.notes[0]
    assert _is_true(scene)


def test_rounded_rotations_become_exact(root):
    def round_(data):
        data[USED][0]["cam_R_m2c"] = np.round(data[USED][0]["cam_R_m2c"], 3).tolist()

    _edit(root, "scene_gt.json", round_)
    R = read_scene(root, 249).objects[0].T_table_mesh[:3, :3]
    assert np.allclose(R @ R.T, np.eye(3), atol=1e-12)


def test_a_scene_that_is_there_twice_is_noticed(tmp_path):
    moved = (*OBJECTS[:3], upright(44, 0.10, -0.06))
    write_tree(tmp_path / "tree", {401: OBJECTS, 402: moved, 404: OBJECTS})
    first, other, same = (read_scene(tmp_path / "tree", scene) for scene in (401, 402, 404))
    assert first.is_same(same)
    assert not first.is_same(other)


def _first(key, value):
    return lambda d: d[USED][0].update({key: value})


@pytest.mark.parametrize(
    ("name", "fault", "told"),
    [
        ("scene_gt", lambda d: d.pop(USED), "no picture 14"),
        ("scene_camera", lambda d: d.pop(USED), "no picture 14"),
        ("scene_gt", lambda d: d.update({"../../etc/passwd": []}), "no annotation"),
        ("scene_gt", lambda d: d.update({USED: []}), "too few"),
        ("scene_gt", lambda d: d.update({USED: d[USED] * 100}), "too many"),
        ("scene_gt", _first("obj_id", "../../../etc/passwd"), "obj_id"),
        ("scene_gt", _first("obj_id", 10**17), "obj_id"),
        ("scene_gt", lambda d: d[USED][0].pop("cam_t_m2c"), "cam_t_m2c: is missing"),
        ("scene_gt", _first("cam_R_m2c", [1, 0, 0, 0, 1, 0, 0, 0]), "too few"),
        ("scene_gt", _first("cam_R_m2c", [2, 0, 0, 0, 1, 0, 0, 0, 1]), "no rotation"),
        ("scene_gt", _first("cam_R_m2c", [1, 0, 0, 0, 1, 0, 0, 0, -1]), "no rotation"),
        ("scene_gt", _first("cam_t_m2c", [0, 0, float("nan")]), "finite"),
        ("scene_gt", _first("cam_t_m2c", [0, 0, 70000]), "millimetres"),
        ("scene_gt", lambda d: [e.update(cam_t_m2c=[0.1, 0.1, 0.6]) for e in d[USED]], "are these metres"),
        ("scene_camera", lambda d: d[USED].pop("cam_R_w2c"), "cam_R_w2c: is missing"),
        ("scene_camera", lambda d: d.update({USED: [1]}), "dictionary"),
    ],
)
def test_bad_entries_are_refused_by_name(root, name, fault, told):
    _edit(root, f"{name}.json", fault)
    with pytest.raises(InputError, match=told) as error:
        read_scene(root, 249)
    assert name in str(error.value)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('{"14": ' * 100_000, "no annotation"),
        ("[]", "no annotation"),
        ('{"14"', "no annotation"),
        ('{"14": "\udce4"}', "no annotation"),
        (" " * 33_000_000, "too large"),
    ],
)
def test_json_that_is_not_what_it_should_be_is_refused(root, text, told):
    (root / "scenes" / "000249" / "scene_gt.json").write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(InputError, match=told):
        read_scene(root, 249)


def test_what_is_missing_is_named(root):
    (root / "scenes" / "000249" / "scene_gt.json").unlink()
    with pytest.raises(InputError, match=r"scene_gt\.json is missing"):
        read_scene(root, 249)
    with pytest.raises(InputError, match="000250 is missing"):
        read_scene(root, 250)
    with pytest.raises(InputError, match="not the root of GraspClutter6D"):
        check_root(root / "scenes")


@pytest.mark.parametrize(("annotation", "camera"), [(13, "zivid"), (-1, "zivid"), (3, "azure kinect")])
def test_pictures_that_do_not_exist_are_refused(root, annotation, camera):
    with pytest.raises(InputError):
        read_scene(root, 249, annotation, camera)


def test_no_camera_of_the_test_tree_is_level():
    """So that a wrong alignment shows in every coordinate."""
    for T in camera_poses(20).values():
        assert np.abs(T[:3, :3]).max() < 0.999
