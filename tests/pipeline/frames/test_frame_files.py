"""Frames: round trips, labels from anywhere, and files that cannot be read or written."""

from dataclasses import replace
from operator import attrgetter
from pathlib import Path

import numpy as np
import pytest
from frame_makers import SHAPES, capture, directory, npz, observe, true_labels

from torc.errors import InputError
from torc.pipeline.frames import Frame, load_frame, save_frame
from torc.pipeline.frames.support_plane import estimate_support_z_m, grid_around
from torc.records import BACKGROUND, ROBOT
from torc.workspace.workspace_files import load_workspace


def same(a: Frame, b: Frame, depth_tolerance_m: float = 0.0) -> None:
    np.testing.assert_array_equal(a.observation.rgb, b.observation.rgb)
    np.testing.assert_array_equal(a.label_image, b.label_image)
    np.testing.assert_allclose(a.observation.depth_m, b.observation.depth_m, atol=depth_tolerance_m)
    np.testing.assert_allclose(a.observation.K, b.observation.K)
    np.testing.assert_allclose(a.observation.T_world_camera, b.observation.T_world_camera)
    np.testing.assert_allclose(a.grid.origin, b.grid.origin)
    for name in ("target_id", "target_description", "support_z_m", "grid.voxel_size_m", "grid.shape"):
        assert attrgetter(name)(a) == attrgetter(name)(b)


@pytest.mark.parametrize("target", [0, "hidden", 2])
@pytest.mark.parametrize("name", ["frame.npz", "frame"])
def test_what_is_saved_is_loaded(tmp_path: Path, name: str, target: int | str) -> None:
    labels = true_labels().copy()
    labels[-20:, :30] = ROBOT
    first = load_frame(
        npz(tmp_path, labels=labels, target=target, target_description="the blue can", support_z_m=1.05)
    )
    save_frame(tmp_path / "out" / name, first)
    again = load_frame(tmp_path / "out" / name)
    same(first, again, 0.0 if name.endswith("npz") else 0.0000501)
    assert (again.label_image == ROBOT).sum() == 600


def test_both_forms_tell_the_same(tmp_path: Path) -> None:
    a, b = load_frame(npz(tmp_path, support_z_m=1.05)), load_frame(directory(tmp_path, support_z_m=1.05))
    np.testing.assert_array_equal(a.label_image == 0, b.label_image == 0)
    np.testing.assert_allclose(a.observation.depth_m, b.observation.depth_m, atol=0.0006)
    np.testing.assert_allclose(a.observation.T_world_camera, b.observation.T_world_camera, atol=1e-9)
    assert dict(b.names) == {0: "red mug", 2: "box"}
    assert dict(b.labels) == {0: 1, 2: 2, 3: 3}


def test_integer_depth_has_a_scale(tmp_path: Path) -> None:
    depth = np.round(observe().depth_m * 4000).astype(np.uint16)
    frame = load_frame(npz(tmp_path, depth_m=None, depth=depth, depth_scale=0.00025))
    np.testing.assert_allclose(frame.observation.depth_m, observe().depth_m, atol=0.00013)


def test_no_frame_at_all(tmp_path: Path) -> None:
    (tmp_path / "frame.txt").write_text("hello")
    (tmp_path / "frame.npz").write_bytes(b"hello")
    for name, text in {"nothing": "no frame", "frame.txt": "neither", "frame.npz": "not a readable"}.items():
        with pytest.raises(InputError, match=text):
            load_frame(tmp_path / name)
    truncated = npz(tmp_path).read_bytes()
    (tmp_path / "half.npz").write_bytes(truncated[: len(truncated) // 2])
    with pytest.raises(InputError, match=r"half\.npz"):
        load_frame(tmp_path / "half.npz")


def test_arrays_that_would_fill_the_memory_are_refused_unread(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("torc.io.record_files.MAX_ARRAY_BYTES", 1000)
    with pytest.raises(InputError, match="larger than"):
        load_frame(npz(tmp_path))


def test_labels_from_anywhere_become_ids(tmp_path: Path) -> None:
    numbers = {BACKGROUND: 0, 0: 40_000, 1: 7, 2: 512}
    labels = np.vectorize(numbers.__getitem__)(true_labels()).astype(np.uint16)
    frame = load_frame(npz(tmp_path, labels=labels, target=512))
    assert dict(frame.labels) == {7: 7, 1: 40_000, 0: 512}
    for object_id, label in frame.labels.items():
        np.testing.assert_array_equal(frame.label_image == object_id, labels == label)
    assert frame.target_id == 0


def test_target_is_hidden_when_said_so(tmp_path: Path) -> None:
    frame = load_frame(npz(tmp_path, target="hidden"))
    assert frame.target_id is None
    assert 0 not in frame.labels
    assert frame.labels[3] == 0  # label 0 is an object here, but not the target


def test_a_forgotten_target_is_not_taken_for_a_hidden_one(tmp_path: Path) -> None:
    labels = true_labels() + 1  # 0 is the background now
    with pytest.raises(InputError, match=r"one of \[1, 2, 3\].* or 'hidden'"):
        load_frame(npz(tmp_path, labels=labels))


def test_target_by_name(tmp_path: Path) -> None:
    folder = directory(tmp_path, target="box")
    assert load_frame(folder).labels[0] == 2
    text = (folder / "frame.json").read_text()
    (folder / "frame.json").write_text(text.replace('"target": "box"', '"target": "bxo"'))
    with pytest.raises(InputError, match="'bxo' is no label"):
        load_frame(folder)


@pytest.mark.parametrize("support_z_m", [0.0, 0.4, 0.85, 1.05])
@pytest.mark.parametrize("noise_m", [0.0, 0.003])
def test_support_height_is_found_above_the_floor(
    support_z_m: float, noise_m: float, rng: np.random.Generator
) -> None:
    seen = capture(support_z_m, load_workspace().camera)
    o = seen.observation
    depth = o.depth_m + rng.normal(0, noise_m, o.depth_m.shape).astype(np.float32) * (o.depth_m > 0)
    noisy = replace(seen, observation=replace(o, depth_m=depth))
    assert estimate_support_z_m(noisy) == pytest.approx(support_z_m, abs=0.004)


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
