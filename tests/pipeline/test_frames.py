"""Saved frames: round trips, labels from anywhere, and every way a file can be broken."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from torc.errors import InputError
from torc.geometry.transforms import wxyz_from_rotation
from torc.perception.privileged import LabelPerception
from torc.pipeline.frames import Frame, load_frame, save_frame
from torc.pipeline.support_plane import estimate_support_z_m, grid_around
from torc.records import BACKGROUND, ROBOT, Observation
from torc.scenes.workspace import CameraMount, Workspace
from torc.testing.contexts import box, small_mount
from torc.testing.synthetic import SyntheticBox, random_clutter, synthetic_observation

SHAPES = (
    box(0, 0.62, 0.0, (0.06, 0.06, 0.10)),
    box(1, 0.60, -0.2, (0.08, 0.06, 0.12)),
    box(2, 0.72, -0.1, (0.05, 0.05, 0.16)),
)


def observe(support_z_m: float = 1.05, mount: CameraMount | None = None) -> Observation:
    shapes = [replace(s, center=(*s.center[:2], s.center[2] + support_z_m - 1.05)) for s in SHAPES]
    return synthetic_observation(shapes, small_mount() if mount is None else mount, support_z_m)


def arrays(observation: Observation | None = None) -> dict[str, Any]:
    o = observe() if observation is None else observation
    return {
        "rgb": o.rgb,
        "depth_m": o.depth_m,
        "K": o.K,
        "T_world_camera": o.T_world_camera,
        "labels": o.label_image,
    }


def npz(path: Path, **changes: Any) -> Path:
    """A good .npz with some keys changed, or left out where None."""
    data = {k: v for k, v in (arrays() | changes).items() if v is not None}
    np.savez(path / "frame.npz", **data)
    return path / "frame.npz"


def directory(path: Path, **changes: Any) -> Path:
    """A good frame directory with some keys of frame.json changed, or left out where None."""
    o, folder = observe(), path / "frame"
    folder.mkdir()
    Image.fromarray(o.rgb).save(folder / "rgb.png")
    Image.fromarray(np.round(o.depth_m * 1000).astype(np.uint16)).save(folder / "depth.png")
    Image.fromarray((o.label_image + 1).astype(np.uint8)).save(folder / "labels.png")
    data = {
        "intrinsics": {"fx": o.K[0, 0], "fy": o.K[1, 1], "cx": o.K[0, 2], "cy": o.K[1, 2]},
        "camera_pose": {
            "position": o.T_world_camera[:3, 3].tolist(),
            "wxyz": wxyz_from_rotation(o.T_world_camera[:3, :3]).tolist(),
        },
        "target": 1,
        "names": {"1": "red mug", "2": "box"},
    }
    data = {k: v for k, v in (data | changes).items() if v is not None}
    (folder / "frame.json").write_text(json.dumps(data))
    return folder


def same(a: Frame, b: Frame, depth_tolerance_m: float = 0.0) -> None:
    np.testing.assert_array_equal(a.observation.rgb, b.observation.rgb)
    np.testing.assert_array_equal(a.observation.label_image, b.observation.label_image)
    np.testing.assert_allclose(a.observation.depth_m, b.observation.depth_m, atol=depth_tolerance_m)
    np.testing.assert_allclose(a.observation.K, b.observation.K)
    np.testing.assert_allclose(a.observation.T_world_camera, b.observation.T_world_camera)
    assert (a.target_id, a.target_description, a.support_z_m) == (
        b.target_id,
        b.target_description,
        b.support_z_m,
    )
    np.testing.assert_allclose(a.grid.origin, b.grid.origin)
    assert (a.grid.voxel_size_m, a.grid.shape) == (b.grid.voxel_size_m, b.grid.shape)


@pytest.mark.parametrize("target", [0, "hidden", 2])
@pytest.mark.parametrize("name", ["frame.npz", "frame"])
def test_what_is_saved_is_loaded(tmp_path: Path, name: str, target: int | str) -> None:
    labels = observe().label_image.copy()
    labels[-20:, :30] = ROBOT
    first = load_frame(
        npz(tmp_path, labels=labels, target=target, target_description="the blue can", support_z_m=1.05)
    )
    save_frame(tmp_path / "out" / name, first)
    again = load_frame(tmp_path / "out" / name)
    same(first, again, 0.0 if name.endswith("npz") else 0.0000501)
    assert (again.observation.label_image == ROBOT).sum() == 600


def test_both_forms_tell_the_same(tmp_path: Path) -> None:
    a, b = load_frame(npz(tmp_path, support_z_m=1.05)), load_frame(directory(tmp_path, support_z_m=1.05))
    np.testing.assert_array_equal(a.observation.label_image == 0, b.observation.label_image == 0)
    np.testing.assert_allclose(a.observation.depth_m, b.observation.depth_m, atol=0.0006)
    np.testing.assert_allclose(a.observation.T_world_camera, b.observation.T_world_camera, atol=1e-9)
    assert dict(b.names) == {0: "red mug", 2: "box"}
    assert dict(b.labels) == {0: 1, 2: 2, 3: 3}


def test_labels_from_anywhere_become_ids(tmp_path: Path) -> None:
    o = observe()
    numbers = {BACKGROUND: 0, 0: 40_000, 1: 7, 2: 512}
    labels = np.vectorize(numbers.__getitem__)(o.label_image).astype(np.uint16)
    frame = load_frame(npz(tmp_path, labels=labels, target=512))
    assert dict(frame.labels) == {7: 7, 1: 40_000, 0: 512}
    for object_id, label in frame.labels.items():
        np.testing.assert_array_equal(frame.observation.label_image == object_id, labels == label)
    assert frame.target_id == 0


def test_target_is_hidden_when_said_so_or_not_there(tmp_path: Path) -> None:
    frame = load_frame(npz(tmp_path, target="hidden"))
    assert frame.target_id is None
    assert 0 not in frame.labels
    assert frame.labels[3] == 0  # label 0 is an object here, but not the target
    labels = observe().label_image + 1  # 0 is the background now
    assert load_frame(npz(tmp_path, labels=labels)).target_id is None


def test_target_by_name(tmp_path: Path) -> None:
    assert load_frame(directory(tmp_path, target="box")).labels[0] == 2


def test_names_that_are_no_target_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="'bxo' is neither"):
        load_frame(directory(tmp_path, target="bxo"))


def test_perception_accepts_what_is_loaded(tmp_path: Path) -> None:
    scene = LabelPerception().perceive(load_frame(npz(tmp_path)).observation)
    assert scene.ids == (0, 1, 2)
    assert scene.target_id == 0


def test_missing_readings_may_be_nan_or_infinite(tmp_path: Path) -> None:
    depth = observe().depth_m.copy()
    depth[:20], depth[20:40] = np.nan, np.inf
    frame = load_frame(npz(tmp_path, depth_m=depth))
    assert not frame.observation.depth_m[:40].any()


def test_integer_depth_has_a_scale(tmp_path: Path) -> None:
    depth = np.round(observe().depth_m * 4000).astype(np.uint16)
    frame = load_frame(npz(tmp_path, depth_m=None, depth=depth, depth_scale=0.00025))
    np.testing.assert_allclose(frame.observation.depth_m, observe().depth_m, atol=0.00013)


@pytest.mark.parametrize("support_z_m", [0.0, 0.4, 0.85, 1.05])
@pytest.mark.parametrize("noise_m", [0.0, 0.003])
def test_support_height_is_found_above_the_floor(
    support_z_m: float, noise_m: float, rng: np.random.Generator
) -> None:
    o = observe(support_z_m, CameraMount())
    depth = o.depth_m + rng.normal(0, noise_m, o.depth_m.shape).astype(np.float32) * (o.depth_m > 0)
    assert estimate_support_z_m(replace(o, depth_m=depth)) == pytest.approx(support_z_m, abs=0.004)


@pytest.mark.parametrize("seed", range(4))
def test_support_height_is_found_under_clutter(seed: int) -> None:
    o = synthetic_observation(random_clutter(np.random.default_rng(seed), 18), small_mount())
    assert estimate_support_z_m(o) == pytest.approx(Workspace().support_z_m, abs=0.004)


def test_a_platform_beside_the_objects_is_not_their_support() -> None:
    platform = SyntheticBox(BACKGROUND, (0.70, 0.45, 1.10), (0.6, 0.7, 0.1))
    o = synthetic_observation((*SHAPES, platform), small_mount())
    assert estimate_support_z_m(o) == pytest.approx(1.05, abs=0.004)


def test_grid_covers_the_objects_and_stands_on_the_support(tmp_path: Path) -> None:
    frame = load_frame(npz(tmp_path))
    assert frame.support_estimated
    assert frame.grid.origin[2] == frame.support_z_m
    for shape in SHAPES:
        half = np.array(shape.size) / 2
        assert (np.array(shape.center) - half >= frame.grid.origin - 0.005).all()
        assert (np.array(shape.center) + half <= frame.grid.upper).all()


def test_grid_ignores_stray_points_but_not_a_wide_spread() -> None:
    points = np.random.default_rng(0).uniform(0, 0.3, (1000, 3))
    stray = np.concatenate([points, [[9, 9, 9], [-9, 9, 9]]])
    assert np.subtract(grid_around(stray, 0.0).shape, grid_around(points, 0.0).shape).max() <= 1
    with pytest.raises(InputError, match="spread"):
        grid_around(points * 20, 0.0)


def flipped() -> np.ndarray:
    T = observe().T_world_camera.copy()
    T[:3, 1:3] *= -1
    return T


def lowered(z: float) -> np.ndarray:
    T = observe().T_world_camera.copy()
    T[2, 3] = z
    return T


def many_labels() -> np.ndarray:
    labels = observe().label_image.copy()
    labels.flat[:70] = np.arange(100, 170)
    return labels


BROKEN_ARRAYS: dict[str, tuple[Callable[[], dict[str, Any]], str]] = {
    "no rgb": (lambda: {"rgb": None}, "lacks rgb"),
    "no depth": (lambda: {"depth_m": None}, "lacks depth_m"),
    "grey rgb": (lambda: {"rgb": observe().rgb[..., 0]}, "key rgb"),
    "float rgb": (lambda: {"rgb": observe().rgb / 255}, "uint8"),
    "float labels": (lambda: {"labels": observe().label_image * 1.0}, "key labels"),
    "sizes differ": (lambda: {"labels": observe().label_image[:-1]}, "sizes differ"),
    "tiny": (lambda: {"rgb": observe().rgb[:4, :4]}, "4x4 pixels"),
    "depth zero": (lambda: {"depth_m": 0 * observe().depth_m}, "depth is empty"),
    "depth NaN": (lambda: {"depth_m": np.nan * observe().depth_m}, "depth is empty"),
    "depth negative": (lambda: {"depth_m": -observe().depth_m}, "negative"),
    "depth in mm": (lambda: {"depth_m": 1000 * observe().depth_m}, "unit or scale"),
    "integer depth_m": (lambda: {"depth_m": np.ones((240, 320), np.uint16)}, "depth_scale"),
    "byte depth": (lambda: {"depth_m": None, "depth": np.ones((240, 320), np.uint8)}, "16 bits"),
    "absurd scale": (
        lambda: {"depth_m": None, "depth": np.ones((240, 320), np.uint16), "depth_scale": 5.0},
        "depth_scale is 5.0",
    ),
    "K of another size": (lambda: {"K": np.diag([30000.0, 30000.0, 1.0])}, "key K"),
    "K is NaN": (lambda: {"K": np.full((3, 3), np.nan)}, "key K"),
    "K transposed": (lambda: {"K": observe().K.T}, "key K"),
    "pose of wrong shape": (lambda: {"T_world_camera": np.eye(3)}, "4x4 finite"),
    "pose scaled": (lambda: {"T_world_camera": np.diag([2.0, 2, 2, 1])}, "not a rotation"),
    "pose mirrored": (lambda: {"T_world_camera": np.diag([-1.0, 1, 1, 1])}, "not a rotation"),
    "pose transposed": (lambda: {"T_world_camera": observe().T_world_camera.T}, "pose"),
    "pose in OpenGL's axes": (lambda: {"T_world_camera": flipped()}, "OpenGL"),
    "camera below the table": (lambda: {"support_z_m": 1.5}, "below the support"),
    "camera far above": (
        lambda: {"T_world_camera": lowered(8.0), "support_z_m": 1.05},
        "does not see the workspace",
    ),
    "no object": (lambda: {"labels": np.full((240, 320), -1)}, "no object"),
    "objects without depth": (
        lambda: {"depth_m": np.where(observe().label_image < 0, observe().depth_m, 0), "support_z_m": 1.05},
        "no labelled pixel has a depth",
    ),
    "no background": (lambda: {"labels": np.where(observe().label_image < 0, 5, 0)}, "support_z_m"),
    "too many objects": (lambda: {"labels": many_labels()}, "73 instances"),
    "odd negative label": (lambda: {"labels": np.where(observe().label_image == 1, -7, -1)}, "negative"),
    "target not in labels": (lambda: {"target": 9}, "label 9 has no pixel"),
    "target is a fraction": (lambda: {"target": 0.5}, "not a whole number"),
    "target is a list": (lambda: {"target": np.arange(3)}, "key target"),
    "support is NaN": (lambda: {"support_z_m": np.nan}, "key support_z_m"),
    "description is a number": (lambda: {"target_description": 3}, "target_description"),
    "half a grid": (lambda: {"grid_shape": np.ones(3)}, "grid needs all"),
    "huge grid": (
        lambda: {"grid_origin": np.zeros(3), "grid_voxel_size_m": 0.01, "grid_shape": np.full(3, 900)},
        "20 million",
    ),
    "Python objects": (lambda: {"target_description": np.array({"a": 1}, dtype=object)}, "Python objects"),
}


@pytest.mark.parametrize("fault", BROKEN_ARRAYS)
def test_broken_arrays_are_refused_with_their_name(tmp_path: Path, fault: str) -> None:
    changes, text = BROKEN_ARRAYS[fault]
    path = npz(tmp_path, **changes())
    with pytest.raises(InputError, match=text) as caught:
        load_frame(path)
    assert str(path) in str(caught.value)


BROKEN_JSON: dict[str, tuple[dict[str, Any], str]] = {
    "misspelt key": ({"suport_z_m": 1.0}, "Did you mean 'support_z_m'"),
    "no intrinsics": ({"intrinsics": None}, "intrinsics"),
    "intrinsics are text": ({"intrinsics": {"fx": "a", "fy": 1, "cx": 1, "cy": 1}}, "intrinsics.fx"),
    "no pose": ({"camera_pose": None}, "lacks camera_pose"),
    "pose without position": ({"camera_pose": {"wxyz": [1, 0, 0, 0]}}, "position"),
    "no unit quaternion": ({"camera_pose": {"position": [0, 0, 1], "wxyz": [5, 0, 0, 0]}}, "unit quaternion"),
    "ragged pose": ({"camera_pose": [[1, 2], [3]]}, "4x4 finite"),
    "scale is text": ({"depth_scale_m": "mm"}, "depth_scale_m"),
    "names are a list": ({"names": [1, 2]}, "key names"),
    "future version": ({"version": 3}, "version 3"),
    "grid is a number": ({"grid": 3}, "key grid"),
    "background is text": ({"background": "none"}, "key background"),
}


@pytest.mark.parametrize("fault", BROKEN_JSON)
def test_broken_json_is_refused_with_its_key(tmp_path: Path, fault: str) -> None:
    changes, text = BROKEN_JSON[fault]
    with pytest.raises(InputError, match=text) as caught:
        load_frame(directory(tmp_path, **changes))
    assert "frame.json" in str(caught.value) or "depth.png" in str(caught.value)


@pytest.mark.parametrize("name", ["rgb.png", "depth.png", "labels.png", "frame.json"])
@pytest.mark.parametrize("content", [None, b"", b"\x00not a picture, not json\xff" * 9])
def test_files_missing_or_unreadable(tmp_path: Path, name: str, content: bytes | None) -> None:
    folder = directory(tmp_path)
    (folder / name).unlink()
    if content is not None:
        (folder / name).write_bytes(content)
    with pytest.raises(InputError, match=name):
        load_frame(folder)


def test_colour_coded_labels_and_byte_depth_are_refused(tmp_path: Path) -> None:
    folder = directory(tmp_path)
    Image.fromarray(observe().rgb).save(folder / "labels.png")
    with pytest.raises(InputError, match=r"labels\.png.*colour-coded"):
        load_frame(folder)
    Image.fromarray(np.ones((240, 320), np.uint8)).save(folder / "depth.png")
    with pytest.raises(InputError, match=r"depth\.png.*16 bits"):
        load_frame(folder)


def test_truncated_images_are_refused(tmp_path: Path) -> None:
    folder = directory(tmp_path)
    whole = (folder / "depth.png").read_bytes()
    (folder / "depth.png").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(InputError, match=r"depth\.png"):
        load_frame(folder)


def test_no_frame_at_all(tmp_path: Path) -> None:
    (tmp_path / "frame.txt").write_text("hello")
    (tmp_path / "frame.npz").write_bytes(b"hello")
    for name, text in {"nothing": "no frame", "frame.txt": "neither", "frame.npz": "Cannot read"}.items():
        with pytest.raises(InputError, match=text):
            load_frame(tmp_path / name)
    truncated = npz(tmp_path).read_bytes()
    (tmp_path / "half.npz").write_bytes(truncated[: len(truncated) // 2])
    with pytest.raises(InputError, match=r"half\.npz"):
        load_frame(tmp_path / "half.npz")


def test_arrays_that_would_fill_the_memory_are_refused_unread(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("torc.pipeline.frame_files.MAX_ARRAY_BYTES", 1000)
    with pytest.raises(InputError, match="larger than"):
        load_frame(npz(tmp_path))


def test_what_cannot_be_saved_says_so(tmp_path: Path) -> None:
    frame = load_frame(npz(tmp_path))
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="Cannot write"):
        save_frame(tmp_path / "file" / "frame", frame)
    with pytest.raises(InputError, match="label image"):
        save_frame(tmp_path / "x", replace(frame, observation=replace(frame.observation, label_image=None)))
