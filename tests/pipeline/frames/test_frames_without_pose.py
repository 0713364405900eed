"""Frames whose camera pose nobody gave, what a camera saw as a frame, and stereo pairs in frames."""

import json
from dataclasses import replace

import numpy as np
import pytest
from frame_makers import directory, npz, observe

from torc.errors import InputError
from torc.geometry.transforms import make_pose
from torc.perception.stereo import made_up_pair
from torc.pipeline.frames import frame_of, load_capture, load_frame, save_frame, save_observation

WITHOUT = {"T_world_camera": None, "labels": None}
CAMERA_ABOVE_TABLE_M = observe().T_world_camera[2, 3] - 1.05


def test_the_pose_is_estimated_with_the_support_at_zero(tmp_path):
    given, found = load_frame(npz(tmp_path, labels=None)), load_frame(npz(tmp_path, **WITHOUT))
    assert (given.pose_estimated, found.pose_estimated) == (False, True)
    assert found.support_z_m == 0
    assert found.observation.T_world_camera[2, 3] == pytest.approx(CAMERA_ABOVE_TABLE_M, abs=0.003)
    # As much stands on it, whatever the world is called.
    volume = [np.prod(f.grid.shape) * f.grid.voxel_size_m**3 for f in (given, found)]
    assert volume[1] == pytest.approx(volume[0], rel=0.25)


@pytest.mark.parametrize("name", ["again.npz", "again"])
def test_that_it_was_estimated_is_stored(tmp_path, name):
    first = load_frame(npz(tmp_path, **WITHOUT))
    save_frame(tmp_path / name, first)
    again = load_frame(tmp_path / name)
    assert again.pose_estimated
    assert again.support_z_m == 0
    np.testing.assert_allclose(again.observation.T_world_camera, first.observation.T_world_camera, atol=1e-12)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"T_world_camera": None}, "key T_world_camera: is missing.*without masks"),
        (WITHOUT | {"support_z_m": 1.05}, "key support_z_m: is given in the world.*leave out support_z_m"),
        (
            WITHOUT | {"grid_origin": np.zeros(3), "grid_voxel_size_m": 0.01, "grid_shape": np.full(3, 50)},
            "key grid: is given in the world",
        ),
        (
            WITHOUT | {"depth_m": np.full((240, 320), 5.0, np.float32)},
            "cannot be estimated. The depth has too few",
        ),
        ({"pose_estimated": "perhaps"}, "key pose_estimated"),
    ],
)
def test_what_makes_no_sense_without_a_pose_is_refused(tmp_path, changes, text):
    with pytest.raises(InputError, match=text):
        load_frame(npz(tmp_path, **changes))


@pytest.mark.parametrize("name", ["seen.npz", "seen"])
def test_a_recorded_snapshot_is_the_snapshot(tmp_path, name):
    o = observe()
    pose = make_pose(None, [0, 0, -1.05]) @ o.T_world_camera
    o = replace(o, T_world_camera=pose, pose_estimated=True)
    o = replace(o, pair=made_up_pair(o.depth_m, float(o.K[0, 0])))
    save_observation(tmp_path / name, o, "the blue can")
    capture = load_capture(tmp_path / name)
    assert capture.label_image is None
    again = capture.observation
    np.testing.assert_array_equal(again.rgb, o.rgb)
    np.testing.assert_array_equal(again.K, o.K)
    np.testing.assert_array_equal(again.T_world_camera, o.T_world_camera)
    np.testing.assert_allclose(again.depth_m, o.depth_m, atol=0.0 if name.endswith("npz") else 0.000051)
    assert again.pose_estimated
    assert again.pair.baseline_m == o.pair.baseline_m
    np.testing.assert_array_equal(again.pair.left, o.pair.left)
    np.testing.assert_array_equal(again.pair.right, o.pair.right)
    assert load_frame(tmp_path / name).target_description == "the blue can"


def test_what_is_far_is_stored_more_coarsely_and_what_is_farther_not_at_all(tmp_path):
    o = observe()
    depth = o.depth_m.copy()
    depth[:2], depth[2:4], depth[4:6] = 20.0, 90.0, np.nan
    save_observation(tmp_path / "seen", replace(o, depth_m=depth))
    assert json.loads((tmp_path / "seen" / "frame.json").read_text())["depth_scale_m"] == 0.001
    again = load_capture(tmp_path / "seen").observation.depth_m
    np.testing.assert_allclose(again[6:], o.depth_m[6:], atol=0.00051)
    assert (np.unique(again[:2]), again[2:6].max()) == (pytest.approx(20.0), 0)


def test_a_part_of_a_pair_is_refused(tmp_path):
    grey = np.zeros((240, 320), np.uint8)
    with pytest.raises(InputError, match="part of a stereo pair: it lacks right, baseline_m"):
        load_frame(npz(tmp_path, left=grey))
    with pytest.raises(InputError, match="sizes differ"):
        load_frame(npz(tmp_path, left=grey, right=grey[:-1], baseline_m=0.05))
    with pytest.raises(InputError, match="key baseline_m"):
        load_frame(npz(tmp_path, left=grey, right=grey, baseline_m=-0.05))


def test_a_frame_of_a_snapshot_is_the_one_that_would_be_loaded(tmp_path):
    o = observe()
    save_observation(tmp_path / "seen.npz", o)
    mine, loaded = frame_of(o), load_frame(tmp_path / "seen.npz")
    assert mine.support_z_m == loaded.support_z_m
    assert mine.grid.shape == loaded.grid.shape
    np.testing.assert_array_equal(mine.grid.origin, loaded.grid.origin)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda o: {"depth_m": 1000 * o.depth_m}, "The snapshot: median depth is .* unit or scale"),
        (lambda o: {"depth_m": 0 * o.depth_m}, "depth is empty"),
        (lambda o: {"T_world_camera": o.T_world_camera @ np.diag([1.0, -1, -1, 1])}, "OpenGL"),
        (lambda o: {"T_world_camera": make_pose(None, [0, 0, 1.0])}, "support"),
    ],
)
def test_a_snapshot_that_cannot_be_is_refused(change, text):
    o = observe()
    with pytest.raises(InputError, match=text):
        frame_of(replace(o, **change(o)))


def test_a_directory_without_a_pose_says_so(tmp_path):
    with pytest.raises(InputError, match="key T_world_camera: is missing"):
        load_frame(directory(tmp_path, camera_pose=None))
