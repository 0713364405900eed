"""Recorded frames: what was recorded is played, in order, to the end and beyond."""

from dataclasses import replace

import numpy as np
import pytest

from torc.cameras.recorded import RecordedCamera, RecordedConfig, find_frames
from torc.errors import CameraError, InputError
from torc.geometry.transforms import look_at
from torc.pipeline.frames import save_observation
from torc.testing.camera_conformance import check_camera
from torc.testing.contexts import box
from torc.testing.synthetic import synthetic_observation
from torc.workspace.description import CameraMount

POSE = look_at((0.05, -0.1, 1.55), (0.64, -0.1, 1.08))
SEEN = synthetic_observation(
    [box(0, 0.62, 0.0, (0.06, 0.06, 0.10)), box(1, 0.60, -0.2, (0.08, 0.06, 0.12))],
    CameraMount(POSE, 320, 240, 0.96),
)


@pytest.fixture
def frames(tmp_path):
    """Three frames, a shade brighter each, whose names do not sort as text; and what is none."""
    for k, name in enumerate(("frame_2", "frame_10", "frame_11.npz")):
        save_observation(tmp_path / name, replace(SEEN, rgb=np.full_like(SEEN.rgb, k)))
    (tmp_path / "notes.txt").write_text("nothing")
    (tmp_path / "empty").mkdir()
    return tmp_path


def test_it_keeps_the_rules(frames):
    check_camera(RecordedCamera(RecordedConfig(str(frames))))


def test_what_was_recorded_is_played(tmp_path):
    save_observation(tmp_path / "frame_1", SEEN)
    capture = RecordedCamera(RecordedConfig(str(tmp_path))).capture()
    o = capture.observation
    assert capture.label_image is None
    np.testing.assert_array_equal(o.rgb, SEEN.rgb)
    np.testing.assert_allclose(o.depth_m, SEEN.depth_m, atol=0.00051)
    np.testing.assert_array_equal(o.K, SEEN.K)
    np.testing.assert_array_equal(o.T_world_camera, SEEN.T_world_camera)


def test_the_last_frame_stays(frames):
    camera = RecordedCamera(RecordedConfig(str(frames)))
    assert [int(camera.capture().observation.rgb[0, 0, 0]) for _ in range(5)] == [0, 1, 2, 2, 2]
    camera.close()
    assert camera.capture().observation.stamp_s == 0


def test_or_it_raises(frames):
    camera = RecordedCamera(RecordedConfig(str(frames), at_end="raise"))
    assert [camera.capture().observation.stamp_s for _ in range(3)] == [0, 1, 2]
    with pytest.raises(CameraError, match=r"All 3 frames of .* were played"):
        camera.capture()


def test_one_frame_is_a_recording_too(frames):
    assert find_frames(str(frames / "frame_10")) == [frames / "frame_10"]
    assert find_frames(str(frames / "frame_11.npz")) == [frames / "frame_11.npz"]


def test_no_frames_are_told(frames):
    with pytest.raises(InputError, match=r"no recorded frames at ''\. Give --camera\.path"):
        RecordedCamera().capture()
    with pytest.raises(InputError, match="holds no frames"):
        RecordedCamera(RecordedConfig(str(frames / "empty"))).capture()
    (frames / "frame_2" / "depth.png").unlink()
    with pytest.raises(InputError, match=r"lacks depth\.png"):
        RecordedCamera(RecordedConfig(str(frames))).capture()
