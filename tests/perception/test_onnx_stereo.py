"""A matcher in a file: its contract, sizes and scales; tests/helpers/tiny_onnx.py writes models that are told all."""

from dataclasses import replace

import numpy as np
import pytest

from tests.helpers.tiny_onnx import FLOAT, UINT8, matcher
from torc.errors import InputError
from torc.perception.onnx_stereo import OnnxDepth, OnnxStereoConfig
from torc.pipeline.building import make_stage
from torc.records import Observation, StereoPair
from torc.specs.conditions import PipelineSpec
from torc.testing.contexts import box, small_mount
from torc.testing.depth_conformance import check_depth
from torc.testing.synthetic import synthetic_observation

pytest.importorskip("onnxruntime")
FX, BASELINE = 320.0, 0.1
FX_B = np.float32(FX * BASELINE)


def _observation(disparity, confidence):
    """Pictures that show their own disparity and confidence (0..255)."""
    disparity, confidence = np.broadcast_arrays(disparity, confidence)
    K = np.array([[FX, 0, 50.0], [0, FX, 40.0], [0, 0, 1]])
    return Observation(
        rgb=np.zeros((*disparity.shape, 3), np.uint8),
        depth_m=np.zeros(disparity.shape, np.float32),
        K=K,
        T_world_camera=np.eye(4),
        qpos=np.zeros(0),
        stamp_s=0.0,
        pair=StereoPair(disparity.astype(np.uint8), confidence.astype(np.uint8), BASELINE),
    )


@pytest.fixture
def depth_of(tmp_path):
    def make(observation, model=None, **settings):
        path = tmp_path / f"{len(list(tmp_path.iterdir()))}.onnx"
        path.write_bytes(matcher() if model is None else model)
        return OnnxDepth(OnnxStereoConfig(model=str(path), **settings)).measure(observation).depth_m

    return make


def _steps(shape):
    """A disparity of 32 px, and 64 px in a block; where the block is."""
    disparity = np.full(shape, 32.0)
    block = np.s_[shape[0] // 4 : shape[0] // 2, shape[1] // 2 : shape[1] // 4 * 3]
    disparity[block] = 64.0
    return disparity, block


@pytest.mark.parametrize("kind", [FLOAT, UINT8])
@pytest.mark.parametrize("shape", [(64, 96), (61, 97), (33, 130)])
def test_disparity_becomes_depth_whatever_the_size(shape, kind, depth_of):
    disparity, block = _steps(shape)
    depth = depth_of(_observation(disparity, 255), matcher(kind=kind))
    # By hand: 320 px * .1 m / 32 px = 1 m; / 64 px = .5 m; the first 32 columns have no place in the right picture.
    expected = np.full(shape, 1.0)
    expected[block] = 0.5
    expected[:, :32] = 0
    expected[:, 32:64][disparity[:, 32:64] > 32] = 0
    np.testing.assert_allclose(depth, expected, rtol=1e-6)


def test_a_column_that_is_the_disparity_itself_is_still_in_the_right_picture(depth_of):
    depth = depth_of(_observation(np.full((32, 64), 32.0), 255))
    assert (depth[:, 32:] > 0).all()
    assert not depth[:, :32].any()


@pytest.mark.parametrize("scale", [0.5, 2.0])
def test_on_scaled_pictures_a_disparity_means_more_or_fewer_pixels(scale, depth_of):
    disparity, block = _steps((64, 128))
    # What the model finds on the scaled picture is painted as it is: 32 px there are 32 / scale px here.
    depth = depth_of(_observation(disparity, 255), matcher(), scale=scale, min_depth_m=0.1, max_depth_m=9.0)
    rows, cols = (np.s_[(s.start + 2) : (s.stop - 2)] for s in block)
    inside = depth[rows, cols]
    good = np.arange(128)[cols] >= 64 / scale
    np.testing.assert_allclose(inside[:, good], FX_B / (64 / scale), rtol=1e-5)
    assert not inside[:, ~good].any()


def test_a_model_of_a_fixed_size_gets_smaller_pictures_filled_up_and_larger_ones_scaled_down(depth_of):
    model = matcher(size=(64, 96))
    disparity, _ = _steps((50, 90))
    small = depth_of(_observation(disparity, 255), model)
    expected = np.where(disparity <= np.arange(90), FX_B / disparity, 0)
    np.testing.assert_allclose(small, expected, rtol=1e-6)
    large = depth_of(_observation(np.full((128, 192), 20.0), 255), model)
    # Halved pictures: the 20 px that are found are 40 px of the camera's.
    np.testing.assert_allclose(large[:, 40:], FX_B / 40, rtol=1e-6)
    assert not large[:, :39].any()
    wide = depth_of(_observation(np.full((32, 384), 10.0), 255), model)
    np.testing.assert_allclose(wide[:, 40:], FX_B / 40, rtol=1e-6)


def test_what_the_matcher_does_not_trust_is_no_reading(depth_of):
    confidence = np.full((32, 96), 128)
    confidence[:, 60:] = 20
    observation = _observation(np.full((32, 96), 32.0), confidence)
    assert (depth_of(observation, min_confidence=0.4)[:, 32:] > 0).mean(axis=0).tolist() == [1.0] * 28 + [
        0.0
    ] * 36
    assert (depth_of(observation, min_confidence=0.05)[:, 32:] > 0).all()


def test_readings_keep_to_the_range(depth_of):
    observation = _observation(np.full((32, 96), 32.0), 255)
    assert not depth_of(observation, max_depth_m=0.99).any()
    assert not depth_of(observation, min_depth_m=1.01).any()


def test_it_conforms(tmp_path):
    (tmp_path / "m.onnx").write_bytes(matcher(gain=0.2))
    check_depth(lambda: OnnxDepth(OnnxStereoConfig(model=str(tmp_path / "m.onnx"))))


def test_it_is_made_by_name_and_settings(tmp_path):
    spec = PipelineSpec(depth="onnx", settings={"depth.model": "m.onnx", "depth.min_confidence": 0.3})
    assert make_stage(spec, "depth").config == OnnxStereoConfig(model="m.onnx", min_confidence=0.3)
    with pytest.raises(InputError, match=r"--depth.model FILE"):
        make_stage(replace(spec, settings={}), "depth")


@pytest.mark.parametrize(
    ("model", "why"),
    [
        (b"", "no model"),
        (b"junk", "no model"),
        (matcher(outputs=("output_disp", "other")), "It needs"),
        (matcher(size=(64, 96)).replace(b"input_left", b"input_lift"), "It needs"),
    ],
)
def test_a_file_that_is_no_such_matcher_is_refused(model, why, depth_of):
    with pytest.raises(InputError, match=why):
        depth_of(_observation(np.full((32, 64), 8.0), 255), model)


def test_a_camera_without_a_pair_is_told_what_to_do(depth_of):
    observation = synthetic_observation((box(0, 0.62, -0.1, (0.05, 0.06, 0.1)),), small_mount())
    with pytest.raises(InputError, match="--depth as-measured"):
        depth_of(observation)
