"""Data sets with true masks: read as their makers lay them out, judged by what is found in them."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from torc.brain.seeing import judge
from torc.cli.perception import EvaluateCommand
from torc.drawing.marking import mask_comparison
from torc.errors import InputError
from torc.perception.scoring import score_masks
from torc.pipeline.frames.annotated import LAYOUTS, AnnotatedPicture, annotated_pictures
from torc.pipeline.frames.level import level_pose
from torc.specs.conditions import PipelineSpec
from torc.testing.contexts import box
from torc.testing.synthetic import synthetic_capture
from torc.workspace.description import CameraMount
from torc.workspace.workspace_files import load_workspace

SHAPES = (box(0, 0.60, -0.20, (0.06, 0.06, 0.10)), box(4, 0.62, 0.00, (0.05, 0.08, 0.08)))
OWN = load_workspace().camera
XTION = CameraMount(OWN.T_world_camera, 640, 480, float(2 * np.arctan(240 / 570.3422)))


def picture(mount=XTION):
    """What a camera sees, and the true labels."""
    capture = synthetic_capture(SHAPES, mount)
    return capture.observation, capture.label_image


def save(path, array):
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(array).save(path)


def test_the_depth_stage_is_used():
    observation, label = picture()
    found = AnnotatedPicture("a", observation, True, label)
    with pytest.raises(InputError, match="needs the two pictures"):
        judge(found, PipelineSpec(perception="embedded", depth="sgbm"))


def write_ocid(root):
    (o, label), seq = picture(), root / "ARID20" / "table" / "top" / "seq01"
    labels = np.where(label < 0, 2, label + 3).astype(np.uint16)
    labels[:40] = 1
    save(seq / "rgb" / "a.png", o.rgb)
    save(seq / "depth" / "a.png", np.minimum(o.depth_m * 1000, 65535).round().astype(np.uint16))
    save(seq / "label" / "a.png", labels)


def write_osd(root):
    o, label = picture()
    save(root / "image_color" / "a.png", o.rgb)
    save(root / "disparity" / "a.png", np.minimum(o.depth_m * 1000, 65535).round().astype(np.uint16))
    save(root / "annotation" / "a.png", (label + 1).clip(0).astype(np.uint8))


def write_graspclutter6d(root):
    (o, label), scene = picture(OWN), root / "scenes" / "000007"
    save(scene / "rgb" / "000003.png", o.rgb)
    save(scene / "depth" / "000003.png", np.minimum(o.depth_m * 10000, 65535).round().astype(np.uint16))
    labels = (label + 1).clip(0).astype(np.uint8)
    save(scene / "label" / "000003.png", np.repeat(labels[..., None], 3, axis=-1))
    T = o.T_world_camera
    camera = {
        "cam_K": o.K.ravel().tolist(),
        "depth_scale": 0.1,
        "cam_R_w2c": T[:3, :3].ravel().tolist(),
        "cam_t_w2c": (1000 * T[:3, 3]).tolist(),
    }
    (scene / "scene_camera.json").write_text(json.dumps({"3": camera}))


def write_frames(root):
    o, label = picture(OWN)
    root.mkdir(exist_ok=True)
    data = {"rgb": o.rgb, "depth_m": o.depth_m, "K": o.K, "T_world_camera": o.T_world_camera}
    np.savez(root / "a.npz", **data, labels=label, target=0)


WRITERS = {
    "ocid": write_ocid,
    "osd": write_osd,
    "graspclutter6d": write_graspclutter6d,
    "frames": write_frames,
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_each_layout_gives_the_picture_its_depth_and_its_true_masks(layout, tmp_path):
    WRITERS[layout](tmp_path)
    ((_, read),) = annotated_pictures(tmp_path, layout)
    found = read()
    o, label = picture(OWN if layout in ("graspclutter6d", "frames") else XTION)
    assert score_masks(found.truth, np.where(label < 0, -1, label).astype(np.int16)).overlap_f == 1
    inside = o.depth_m < 6
    np.testing.assert_allclose(found.observation.depth_m[inside], o.depth_m[inside], atol=1e-3)
    np.testing.assert_allclose(found.observation.K, o.K, rtol=1e-3)
    if found.posed:
        np.testing.assert_allclose(found.observation.T_world_camera, o.T_world_camera, atol=1e-9)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_free_standing_boxes_are_found_whatever_the_layout(layout, tmp_path):
    WRITERS[layout](tmp_path)
    ((_, read),) = annotated_pictures(tmp_path, layout)
    assert judge(read(), PipelineSpec(perception="embedded")).score.overlap_f > 0.85


def test_the_command_prints_the_means_and_shows_the_worst(tmp_path, capsys):
    write_frames(tmp_path / "data")
    stages = PipelineSpec(perception="embedded")
    assert EvaluateCommand(tmp_path / "data", out=tmp_path / "out", json=True, stages=stages).run() == 0
    told = json.loads(capsys.readouterr().out)
    assert told["pictures"] == 1
    assert told["overlap_f"] > 0.85
    rows = (tmp_path / "out" / "scores.csv").read_text().splitlines()
    assert len(rows) == 2
    with Image.open(tmp_path / "out" / "worst.png") as worst:
        assert worst.size[0] == 1200


def test_what_cannot_be_used_is_told_with_its_reason(tmp_path, capsys):
    with pytest.raises(InputError, match="no directory"):
        annotated_pictures(tmp_path / "nowhere", "ocid")
    with pytest.raises(InputError, match="rgb"):
        annotated_pictures(tmp_path, "ocid")
    with pytest.raises(InputError, match="ocid"):
        annotated_pictures(tmp_path, "ocids")
    write_frames(tmp_path)
    with pytest.raises(InputError, match="nothing to evaluate"):
        judge(annotated_pictures(tmp_path, "frames")[0][1](), PipelineSpec())
    broken = Path(tmp_path / "b.npz")
    broken.write_bytes(b"no archive")
    assert EvaluateCommand(tmp_path, stages=PipelineSpec(perception="embedded")).run() == 0
    assert "b.npz: left out" in capsys.readouterr().err


def test_a_pose_by_the_support_is_near_the_true_one():
    o, _ = picture(OWN)
    T = level_pose(o)
    up = T[2, :3] @ o.T_world_camera[2, :3]
    assert np.degrees(np.arccos(min(1.0, up))) < 1.0
    assert T[2, 3] == pytest.approx(o.T_world_camera[2, 3] - load_workspace().support_z_m, abs=0.01)
    np.testing.assert_allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3), atol=1e-9)
    assert T[1, 3] == T[0, 3] == 0


def test_a_picture_without_a_plane_has_no_pose():
    o, _ = picture(OWN)
    rng = np.random.default_rng(0)
    ragged = replace(o, depth_m=rng.uniform(0.3, 2.5, o.depth_m.shape).astype(np.float32))
    with pytest.raises(InputError, match="No support"):
        level_pose(ragged)
    with pytest.raises(InputError, match="too few readings"):
        level_pose(replace(o, depth_m=np.zeros_like(o.depth_m)))


def test_comparisons_show_three_pictures_a_row():
    rgb, label = np.full((30, 40, 3), 90, np.uint8), np.full((30, 40), -1, np.int16)
    label[5:20, 5:20] = 2
    image = mask_comparison([(rgb, label, label), (rgb, label, np.full_like(label, -1))], width=240)
    assert image.shape == (2 * 60, 240, 3)
    with pytest.raises(ValueError, match="nothing"):
        mask_comparison([])
