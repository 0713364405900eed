"""Every way a frame can be broken is refused, with the file, the key and a remedy."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from frame_makers import directory, npz, observe, true_labels
from PIL import Image

from torc.errors import InputError
from torc.pipeline.frames import load_frame


def flipped() -> np.ndarray:
    return observe().T_world_camera @ np.diag([1.0, -1.0, -1.0, 1.0])


def in_millimetres() -> np.ndarray:
    T = observe().T_world_camera.copy()
    T[:3, 3] *= 1000
    return T


def lifted(z: float) -> np.ndarray:
    T = observe().T_world_camera.copy()
    T[2, 3] = z
    return T


def many_labels() -> np.ndarray:
    labels = true_labels().copy()
    labels.flat[:70] = np.arange(100, 170)
    return labels


BROKEN_ARRAYS: dict[str, tuple[Callable[[], dict[str, Any]], str]] = {
    "no rgb": (lambda: {"rgb": None}, "lacks rgb"),
    "grey rgb": (lambda: {"rgb": observe().rgb[..., 0]}, "key rgb"),
    "sizes differ": (lambda: {"labels": true_labels()[:-1]}, "sizes differ"),
    "tiny": (lambda: {"rgb": observe().rgb[:4, :4]}, "4x4 pixels"),
    "depth negative": (lambda: {"depth_m": -observe().depth_m}, "negative"),
    "depth in mm": (lambda: {"depth_m": 1000 * observe().depth_m}, "unit or scale"),
    "absurd scale": (
        lambda: {"depth_m": None, "depth": np.ones((240, 320), np.uint16), "depth_scale": 5.0},
        "key depth_scale",
    ),
    "pose in millimetres": (lambda: {"T_world_camera": in_millimetres()}, "Are these millimetres?"),
    "pose in OpenGL's axes": (lambda: {"T_world_camera": flipped()}, "OpenGL"),
    "camera below the table": (lambda: {"support_z_m": 1.5}, "does not see"),
    "camera far above": (
        lambda: {"T_world_camera": lifted(8.0), "support_z_m": 1.05},
        "does not see the workspace",
    ),
    "no object": (lambda: {"labels": np.full((240, 320), -1)}, "no object"),
    "objects without depth": (
        lambda: {"depth_m": np.where(true_labels() < 0, observe().depth_m, 0), "support_z_m": 1.05},
        "no labelled pixel has a depth",
    ),
    "too far away": (
        lambda: {
            "depth_m": np.where(true_labels() < 0, observe().depth_m, 12.0).astype(np.float32),
            "support_z_m": 1.05,
        },
        "12.00 m from the camera; readings from 0.1 to 10 m",
    ),
    "misspelt key": (lambda: {"suport_z_m": 1.05}, "Did you mean 'support_z_m'"),
    "no background": (
        lambda: {"labels": np.where(true_labels() < 0, 5, 0), "target": 5},
        "support_z_m",
    ),
    "too many objects": (lambda: {"labels": many_labels()}, "73 instances"),
    "target not in labels": (lambda: {"target": 9}, "key target: 9"),
    "half a grid": (lambda: {"grid_shape": np.ones(3)}, "key grid.origin"),
    "huge grid": (
        lambda: {"grid_origin": np.zeros(3), "grid_voxel_size_m": 0.01, "grid_shape": np.full(3, 900)},
        "20 million",
    ),
    "Python objects": (lambda: {"target_description": np.array({"a": 1}, dtype=object)}, "Python objects"),
}


@pytest.mark.usefixtures("any_arrays")
@pytest.mark.parametrize("fault", BROKEN_ARRAYS)
def test_broken_arrays_are_refused_with_their_name(tmp_path: Path, fault: str) -> None:
    changes, text = BROKEN_ARRAYS[fault]
    path = npz(tmp_path, **changes())
    with pytest.raises(InputError, match=text) as caught:
        load_frame(path)
    assert str(path) in str(caught.value)


BROKEN_JSON: dict[str, tuple[dict[str, Any], str]] = {
    "misspelt key": ({"suport_z_m": 1.0}, "Did you mean 'support_z_m'"),
    "intrinsics are text": (
        {"intrinsics": {"fx": "a", "fy": 1, "cx": 1, "cy": 1}},
        "key intrinsics: need 4 finite",
    ),
    "no pose": ({"camera_pose": None}, "key T_world_camera"),
    "no unit quaternion": ({"camera_pose": {"position": [0, 0, 1], "wxyz": [5, 0, 0, 0]}}, "unit quaternion"),
    "names are a list": ({"names": [1, 2]}, "key names"),
    "future version": ({"version": 3}, "key version"),
    "background is text": ({"background": "none"}, "key background"),
}


@pytest.mark.parametrize("fault", BROKEN_JSON)
def test_broken_json_is_refused_with_its_key(tmp_path: Path, fault: str) -> None:
    changes, text = BROKEN_JSON[fault]
    with pytest.raises(InputError, match=text) as caught:
        load_frame(directory(tmp_path, **changes))
    assert "frame.json" in str(caught.value) or "depth.png" in str(caught.value)


@pytest.mark.parametrize("name", ["rgb.png", "depth.png", "labels.png", "frame.json"])
@pytest.mark.parametrize("content", [None, b"\x00not a picture, not json\xff" * 9])
def test_files_missing_or_unreadable(tmp_path: Path, name: str, content: bytes | None) -> None:
    folder = directory(tmp_path)
    (folder / name).unlink()
    if content is not None:
        (folder / name).write_bytes(content)
    with pytest.raises(InputError, match=name):
        load_frame(folder)


def test_color_coded_labels_and_byte_depth_are_refused(tmp_path: Path) -> None:
    folder = directory(tmp_path)
    Image.fromarray(observe().rgb).save(folder / "labels.png")
    with pytest.raises(InputError, match=r"labels\.png.*color-coded"):
        load_frame(folder)
    Image.fromarray(np.ones((240, 320), np.uint8)).save(folder / "depth.png")
    with pytest.raises(InputError, match=r"depth\.png.*16 bits"):
        load_frame(folder)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
@pytest.mark.parametrize("name", ["frame.npz", "form/frame.json"])
def test_a_pipe_is_refused_rather_than_waited_for(name, tmp_path):
    path = tmp_path / name
    path.parent.mkdir(exist_ok=True)
    os.mkfifo(path)
    with pytest.raises(InputError, match=f"{path.name} is no regular file"):
        load_frame(tmp_path / name.split("/")[0])
