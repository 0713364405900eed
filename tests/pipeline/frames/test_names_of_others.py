"""Frames under the names and in the forms that other people use."""

import json

import numpy as np
import pytest
from frame_makers import directory, npz, observe, true_labels
from PIL import Image

from torc.errors import InputError
from torc.geometry.transforms import invert
from torc.pipeline.frames import load_frame
from torc.pipeline.frames.forms import as_labels

SEEN = observe()
LABELS = true_labels()
GREY = np.mean(SEEN.rgb, axis=2)
RS = {"fx": SEEN.K[0, 0], "fy": SEEN.K[1, 1], "ppx": SEEN.K[0, 2], "ppy": SEEN.K[1, 2]}
CHANGES = {
    "masks": {"labels": None, "masks": LABELS},
    "seg": {"labels": None, "seg": LABELS},
    "float segmap": {"labels": None, "segmap": LABELS.astype(np.float32)},
    "camera_pose": {"T_world_camera": None, "camera_pose": SEEN.T_world_camera},
    "c2w": {"T_world_camera": None, "c2w": SEEN.T_world_camera},
    "w2c": {"T_world_camera": None, "w2c": invert(SEEN.T_world_camera)},
    "three rows": {"T_world_camera": SEEN.T_world_camera[:3]},
    "extrinsics": {"T_world_camera": None, "extrinsics": SEEN.T_world_camera},
    "extrinsics, inverse": {"T_world_camera": None, "extrinsics": invert(SEEN.T_world_camera)},
    "float depth": {"depth_m": None, "depth": SEEN.depth_m},
    "depth with an axis of one": {"depth_m": SEEN.depth_m[..., None]},
    "cam_K of nine": {"K": None, "cam_K": SEEN.K.ravel()},
    "transposed K": {"K": SEEN.K.T},
    "single numbers": {"K": None, **RS},
    "image": {"rgb": None, "image": SEEN.rgb},
    "channels first": {"rgb": np.moveaxis(SEEN.rgb, -1, 0)},
    "float colours": {"rgb": SEEN.rgb / 255.0},
    "bgr": {"rgb": None, "bgr": SEEN.rgb[..., ::-1]},
}


@pytest.mark.parametrize("name", CHANGES)
def test_what_is_unambiguous_is_read(tmp_path, name):
    frame = load_frame(npz(tmp_path, **CHANGES[name]))
    np.testing.assert_array_equal(frame.observation.rgb, SEEN.rgb)
    np.testing.assert_allclose(frame.observation.depth_m, SEEN.depth_m)
    np.testing.assert_allclose(frame.observation.K, SEEN.K)
    np.testing.assert_allclose(frame.observation.T_world_camera, SEEN.T_world_camera, atol=1e-9)
    np.testing.assert_array_equal(frame.label_image, LABELS)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"normals": np.zeros((240, 320, 3))}, "unknown key 'normals'"),
        ({"suport": 1.0}, "Did you mean 'support_z_m'"),
        ({"table_height": 1.0}, "Give support_z_m"),
        ({"masks": LABELS}, "labels and masks both mean labels"),
        ({"extrinsics": SEEN.T_world_camera}, "T_world_camera and extrinsics say the same"),
        ({"intrinsics": SEEN.K}, "both mean K"),
        ({"depth_m": None, "depth": np.ones((240, 320), np.uint16), "depth_scale": 1000.0}, "give 0.001"),
        (
            {"depth_m": None, "depth": np.ones((240, 320), np.uint16), "depth_factor": 0.001},
            "units per metre",
        ),
    ],
)
def test_what_is_unknown_or_said_twice_is_refused(tmp_path, changes, text):
    with pytest.raises(InputError, match=text):
        load_frame(npz(tmp_path, **changes))


def test_scales_of_graspnet_and_bop_become_metres_per_unit(tmp_path):
    depth = np.round(SEEN.depth_m * 1000).astype(np.uint16)
    given = {"depth_m": None, "depth": depth}
    for more in ({"factor_depth": 1000.0}, {"K": None, "cam_K": SEEN.K, "depth_scale": 1.0}):
        frame = load_frame(npz(tmp_path, **given, **more))
        np.testing.assert_allclose(frame.observation.depth_m, SEEN.depth_m, atol=0.001)


def test_masks_to_compare_with_are_not_used_and_that_is_said(tmp_path):
    assert "'truth' is not read" in load_frame(npz(tmp_path, truth=LABELS)).warnings[0]


def test_a_stack_of_masks_becomes_numbers():
    stack = np.stack([k == LABELS for k in range(3)])
    np.testing.assert_array_equal(as_labels(stack), np.where(LABELS >= 0, LABELS + 1, 0))
    np.testing.assert_array_equal(as_labels(np.moveaxis(stack, 0, -1)), as_labels(stack))


def test_a_directory_with_a_deep_picture_a_mark_and_realsense_names(tmp_path):
    folder = directory(tmp_path, intrinsics={**RS, "width": 320, "height": 240, "coeffs": [0] * 5})
    Image.fromarray((GREY * 257).astype(np.uint16)).save(folder / "rgb.png")
    text = (folder / "frame.json").read_text()
    (folder / "frame.json").write_text(text, encoding="utf-8-sig")
    seen = load_frame(folder).observation
    assert np.abs(seen.rgb[..., 0] - GREY).max() < 1.5
    np.testing.assert_allclose(seen.K, SEEN.K)
    data = json.loads(text)
    data["intrinsics"]["width"] = 1280
    (folder / "frame.json").write_text(json.dumps(data))
    with pytest.raises(InputError, match="1280x240"):
        load_frame(folder)


def test_a_table_among_the_labels_is_background(tmp_path):
    labels = np.where(LABELS >= 0, LABELS + 2, 1).astype(np.uint8)
    labels[0, 0] = 0
    frame = load_frame(npz(tmp_path, labels=labels, target=2))
    assert sorted(frame.labels.values()) == [2, 3, 4]
    assert "Label 1 is taken for the table" in frame.warnings[0]
    with pytest.raises(InputError, match="is the table"):
        load_frame(npz(tmp_path, labels=labels, target=1))
