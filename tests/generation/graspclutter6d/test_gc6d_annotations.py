"""Annotations of GraspClutter6D: the true poses come back, every documented fault is met, and bad files are refused."""

import json

import numpy as np
import pytest
from PIL import Image

from tests.helpers.graspclutter6d_tree import camera_poses, edit_json, upright, write_tree
from torc.errors import InputError
from torc.generation.graspclutter6d.alignment import align_to_table
from torc.generation.graspclutter6d.annotations import read_scene, same_annotation
from torc.generation.graspclutter6d.layout import check_root, find_mesh, image_id, scene_ids
from torc.generation.graspclutter6d.masks import mask_notes

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


def _positions(scene):
    return np.array([T[:3, 3] for T in scene.Ts_table_mesh])


@pytest.mark.parametrize(
    ("annotation", "camera", "image"), [(3, "realsense-d435", 14), (0, "realsense-d415", 1), (4, "zivid", 20)]
)
def test_poses_on_the_table_are_the_true_ones_by_every_picture(root, annotation, camera, image):
    scene = read_scene(root, 249, annotation, camera)
    assert scene.view.image == image
    aligned = align_to_table(scene)
    for T, true in zip(aligned.Ts_table_mesh, OBJECTS):
        assert np.allclose(T, true.T_table_mesh, atol=1e-9)
    assert [o.name for o in aligned.objects] == [
        "obj_000017_0",
        "obj_000044_0",
        "obj_000056_0",
        "obj_000044_1",
    ]
    assert aligned.disagreement_m < 1e-6
    assert aligned.notes == ()


def test_the_pose_equals_the_product_of_the_numbers_in_the_files(root):
    directory = root / "scenes" / "000249"
    camera = json.loads((directory / "scene_camera.json").read_text())[USED]
    truth = json.loads((directory / "scene_gt.json").read_text())[USED]
    aligned = align_to_table(read_scene(root, 249))
    R, t = np.reshape(camera["cam_R_w2c"], (3, 3)), np.array(camera["cam_t_w2c"])
    for T, entry in zip(aligned.Ts_table_mesh, truth):
        assert np.allclose(T[:3, :3], R @ np.reshape(entry["cam_R_m2c"], (3, 3)), atol=1e-9)
        assert np.allclose(1000 * T[:3, 3], R @ entry["cam_t_m2c"] + t, atol=1e-6)


def test_camera_poses_named_rightly_are_noticed_and_inverted(tmp_path):
    write_tree(tmp_path / "tree", {249: OBJECTS}, named_rightly=True)
    aligned = align_to_table(read_scene(tmp_path / "tree", 249))
    assert aligned.reading == "world_to_camera"
    assert "world-to-camera" in aligned.notes[0]
    for T, true in zip(aligned.Ts_table_mesh, OBJECTS):
        assert np.allclose(T, true.T_table_mesh, atol=1e-9)


def test_a_single_picture_is_read_as_the_public_api_does_and_says_so(root):
    for name in ("scene_camera.json", "scene_gt.json"):
        _edit(root, name, lambda d: [d.pop(k) for k in list(d) if k != USED])
    aligned = align_to_table(read_scene(root, 249))
    assert aligned.reading == "camera_to_world"
    assert aligned.disagreement_m is None
    assert "cross-checked" in aligned.notes[0]
    assert np.allclose(_positions(aligned), [o.T_table_mesh[:3, 3] for o in OBJECTS])


def test_pictures_that_disagree_are_noted(root):
    def shake(data):
        for k, image in enumerate(data):
            for entry in data[image]:
                entry["cam_t_m2c"][0] += 100.0 * (k % 3)

    _edit(root, "scene_gt.json", shake)
    assert "disagree" in " ".join(align_to_table(read_scene(root, 249)).notes)


def test_a_frame_that_is_not_a_tables_is_refused(root):
    def turn(data):
        flip = np.diag([1.0, -1.0, -1.0])
        for camera in data.values():
            camera["cam_R_w2c"] = (flip @ np.reshape(camera["cam_R_w2c"], (3, 3))).ravel().tolist()
            camera["cam_t_w2c"] = (flip @ camera["cam_t_w2c"]).tolist()

    _edit(root, "scene_camera.json", turn)
    with pytest.raises(InputError, match="below the objects"):
        align_to_table(read_scene(root, 249))


def test_an_unreadable_other_picture_is_noted_and_does_no_harm(root):
    _edit(root, "scene_gt.json", lambda d: d["5"][0].pop("cam_R_m2c"))
    aligned = align_to_table(read_scene(root, 249))
    assert "picture 5" in aligned.notes[0]
    assert np.allclose(_positions(aligned), [o.T_table_mesh[:3, 3] for o in OBJECTS])


def test_rotations_in_three_rows_and_unknown_fields_are_fine(root):
    def reshape(data):
        for entry in data[USED]:
            entry["cam_R_m2c"] = np.reshape(entry["cam_R_m2c"], (3, 3)).tolist()
            entry["inst_id"] = 1

    _edit(root, "scene_gt.json", reshape)
    assert np.allclose(align_to_table(read_scene(root, 249)).Ts_table_mesh[0], OBJECTS[0].T_table_mesh)


def test_rounded_rotations_become_exact(root):
    _edit(
        root,
        "scene_gt.json",
        lambda d: d[USED][0].update(cam_R_m2c=np.round(d[USED][0]["cam_R_m2c"], 3).tolist()),
    )
    R = read_scene(root, 249).view.objects[0].T_camera_mesh[:3, :3]
    assert np.allclose(R @ R.T, np.eye(3), atol=1e-12)


def test_a_scene_that_is_there_twice_is_noticed(tmp_path):
    moved = (*OBJECTS[:3], upright(44, 0.10, -0.06))
    write_tree(tmp_path / "tree", {401: OBJECTS, 402: moved, 404: OBJECTS})
    first, other, twin = (read_scene(tmp_path / "tree", scene) for scene in (401, 402, 404))
    assert same_annotation(first, twin)
    assert not same_annotation(first, other)


def test_masks_that_do_not_fit_are_noted(tmp_path):
    root = tmp_path / "tree"
    write_tree(root, {117: OBJECTS}, images=14, masks=True)
    masks = root / "scenes" / "000117" / "mask"
    assert mask_notes(read_scene(root, 117)) == ()
    blank = Image.new("L", (64, 36))
    blank.save(masks / "000014_000001.png")
    blank.save(masks / "000014_000004.png")
    (masks / "000014_000002.png").unlink()
    notes = " ".join(mask_notes(read_scene(root, 117)))
    assert "1 more masks" in notes
    assert "no mask of obj_000056_0" in notes
    assert "obj_000044_0 is empty" in notes


def test_absurd_masks_are_refused(tmp_path):
    root = tmp_path / "tree"
    write_tree(root, {117: OBJECTS}, images=14, masks=True)
    mask = root / "scenes" / "000117" / "mask" / "000014_000000.png"
    for side in (5000, 30000):
        Image.new("1", (side, 20)).save(mask)
        with pytest.raises(InputError, match=f"{side}x20 pixels"):
            mask_notes(read_scene(root, 117))
    mask.write_bytes(b"not a picture")
    with pytest.raises(InputError, match="no readable PNG"):
        mask_notes(read_scene(root, 117))


def _first(key, value):
    return lambda d: d[USED][0].update({key: value})


_FAULTS = [
    ("scene_gt.json", lambda d: d.pop(USED), "no picture 14"),
    ("scene_camera.json", lambda d: d.pop(USED), "no picture 14"),
    ("scene_gt.json", lambda d: d.update({"../../etc/passwd": []}), "not the number of a picture"),
    ("scene_gt.json", lambda d: d.update({USED: []}), "0 objects"),
    ("scene_gt.json", lambda d: d.update({USED: "x"}), "no list"),
    ("scene_gt.json", lambda d: d.update({USED: d[USED] * 100}), "400 objects"),
    ("scene_gt.json", lambda d: d.update({str(i): [] for i in range(2000)}), "2000 pictures"),
    ("scene_gt.json", _first("obj_id", "../../../etc/passwd"), "obj_id must be a number"),
    ("scene_gt.json", _first("obj_id", True), "obj_id must be a number"),
    ("scene_gt.json", _first("obj_id", 0), "obj_id must be a number"),
    ("scene_gt.json", _first("obj_id", 10**17), "obj_id must be a number"),
    ("scene_gt.json", lambda d: d[USED][0].pop("obj_id"), "obj_id must be a number"),
    ("scene_gt.json", lambda d: d[USED][0].pop("cam_t_m2c"), "cam_t_m2c is missing"),
    ("scene_gt.json", _first("cam_R_m2c", [1, 0, 0, 0, 1, 0, 0, 0]), "must be 9 numbers"),
    ("scene_gt.json", _first("cam_R_m2c", [1, 0, 0, 0, 1, 0, 0, 0, "1"]), "must be 9 numbers"),
    ("scene_gt.json", _first("cam_R_m2c", [2, 0, 0, 0, 1, 0, 0, 0, 1]), "no rotation"),
    ("scene_gt.json", _first("cam_R_m2c", [1, 0, 0, 0, 1, 0, 0, 0, -1]), "a mirroring"),
    ("scene_gt.json", _first("cam_R_m2c", [0] * 9), "no rotation"),
    ("scene_gt.json", _first("cam_t_m2c", [0, 0, 1e12]), "must be 3 numbers"),
    ("scene_gt.json", _first("cam_t_m2c", [0, 0, 70000]), "millimetres"),
    ("scene_gt.json", lambda d: [e.update(cam_t_m2c=[0.1, 0.1, 0.6]) for e in d[USED]], "are these metres"),
    ("scene_camera.json", lambda d: d[USED].pop("cam_R_w2c"), "cam_R_w2c is missing"),
    ("scene_camera.json", lambda d: d.update({USED: [1]}), "must be an object"),
    ("scene_camera.json", lambda d: d[USED].update(cam_R_w2c=[[1, 0], [0, 1]]), "must be 9 numbers"),
]


@pytest.mark.parametrize(("name", "fault", "told"), _FAULTS)
def test_bad_entries_are_refused_by_name(root, name, fault, told):
    _edit(root, name, fault)
    with pytest.raises(InputError, match=told) as error:
        read_scene(root, 249)
    assert name in str(error.value)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[" * 100_000, "nested too deeply"),
        ('{"14": ' * 100_000, "nested too deeply"),
        ('{"14": ' + "9" * 100_000 + "}", "digits"),
        ('{"14": ' + "9" * 19 + "}", "19 digits"),
        ('{"14": 1e999}', "not finite"),
        ('{"14": NaN}', "no number"),
        ('{"14": 1, "14": 2}', "more than once"),
        ("[]", "must hold an object"),
        ('{"14"', "is not the object poses"),
        ('{"14": "\udce4"}', "UTF-8"),
        (" " * 33_000_000, "too large"),
    ],
)
def test_json_that_is_not_what_it_should_be_is_refused(root, text, told):
    (root / "scenes" / "000249" / "scene_gt.json").write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(InputError, match=told):
        read_scene(root, 249)


def test_missing_files_are_named(root):
    (root / "scenes" / "000249" / "scene_gt.json").unlink()
    with pytest.raises(InputError, match=r"scene_gt\.json is missing"):
        read_scene(root, 249)
    with pytest.raises(InputError, match=r"000250 is missing \(1 scenes are there, from 249 to 249\)"):
        read_scene(root, 250)


@pytest.mark.parametrize(("annotation", "camera"), [(13, "zivid"), (-1, "zivid"), (3, "azure kinect")])
def test_pictures_that_do_not_exist_are_refused(root, annotation, camera):
    with pytest.raises(InputError):
        read_scene(root, 249, annotation, camera)


def test_wrong_roots_are_told_apart(root, tmp_path):
    check_root(root)
    assert scene_ids(root) == (249,)
    for wrong, told in (
        (root / "scenes", "its parent"),
        (root / "no", "no directory"),
        (tmp_path, "no folder scenes/"),
    ):
        with pytest.raises(InputError, match=told):
            check_root(wrong)
    (tmp_path / "samples.json").write_text("{}")
    with pytest.raises(InputError, match="FiftyOne"):
        check_root(tmp_path)


def test_the_best_mesh_is_found_with_its_unit(tmp_path):
    folders = ["models_eval", "models", "models_obj", "models_m", "models_obj_m"]
    for k in range(len(folders)):
        root = tmp_path / str(k)
        write_tree(root, {1: OBJECTS}, images=1, models=folders[: k + 1])
        mesh = find_mesh(root, 44)
        assert mesh.path.parent.name == folders[k]
        assert mesh.unit_m == (1.0 if folders[k].endswith("_m") else 1e-3)
    with pytest.raises(InputError, match=r"no mesh of obj_000043: .* models_obj_m is the best"):
        find_mesh(root, 43)


def test_no_camera_of_the_test_tree_is_level():
    """So that a wrong alignment shows in every coordinate."""
    for T in camera_poses(20).values():
        assert np.abs(T[:3, :3]).max() < 0.999
