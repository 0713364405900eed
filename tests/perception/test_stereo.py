"""Depth from a stereo pair: what is there is found, what is not there is not made up."""

import numpy as np
import pytest

from torc.errors import InputError
from torc.perception.stereo import (
    SgbmConfig,
    SgbmDepth,
    SgbmMatcher,
    depth_of_disparity,
    made_up_pair,
    sgbm_depth,
)
from torc.records import StereoPair
from torc.testing.contexts import box, small_mount
from torc.testing.depth_conformance import check_depth
from torc.testing.synthetic import synthetic_observation

FX, BASELINE = 300.0, 0.095


def _steps(near=0.5, far=0.8):
    depth = np.full((120, 200), far, np.float32)
    depth[40:80, 90:150] = near
    return depth


def test_it_conforms():
    check_depth(SgbmDepth)


@pytest.mark.parametrize(("near", "far"), [(0.5, 0.8), (0.45, 1.2), (0.7, 0.75)])
def test_a_known_depth_comes_back_to_a_third_of_a_pixel(near, far):
    depth = _steps(near, far)
    found = sgbm_depth(made_up_pair(depth, FX, BASELINE), FX, SgbmConfig())
    inner = np.zeros(depth.shape, bool)
    inner[46:74, 96:144] = inner[8:32, 90:190] = True
    assert np.mean(found[inner] > 0) > 0.98
    a_pixel = depth**2 / (FX * BASELINE)
    error = np.abs(found - depth)[inner & (found > 0)]
    assert np.median(error / a_pixel[inner & (found > 0)]) < 0.33
    assert np.quantile(error, 0.95) < 0.5 * a_pixel.max()


def test_what_the_right_picture_cannot_show_has_no_reading():
    found = sgbm_depth(made_up_pair(_steps(), FX, BASELINE), FX, SgbmConfig())
    assert not found[:, : int(FX * BASELINE / 0.8) - 8].any()
    assert found[8:32, 60:190].mean() > 0.7


def test_without_texture_there_are_no_surfaces():
    flat = np.full((120, 200), 128, np.uint8)
    found = sgbm_depth(StereoPair(flat, flat, BASELINE), FX, SgbmConfig())
    assert np.mean(found > 0) < 0.02


def test_readings_keep_to_the_range():
    pair = made_up_pair(_steps(), FX, BASELINE)
    found = sgbm_depth(pair, FX, SgbmConfig(min_depth_m=0.51, max_depth_m=0.79))
    assert np.mean(found > 0) < 0.01


@pytest.mark.parametrize("disparity", [0.0, 1.0, 17.5])
def test_depth_follows_disparity(disparity):
    found = depth_of_disparity(np.full((1, 1), disparity, np.float32), FX, BASELINE)[0, 0]
    assert found == pytest.approx(FX * BASELINE / disparity if disparity else 0)


def test_the_matcher_says_where_it_has_found_nothing():
    pair = made_up_pair(_steps(), FX, BASELINE)
    disparity, confidence = SgbmMatcher(64).match(pair.left, pair.right)
    np.testing.assert_array_equal(confidence, disparity > 0)


def test_a_camera_without_a_pair_is_told_what_to_do():
    observation = synthetic_observation((box(0, 0.62, -0.1, (0.05, 0.06, 0.1)),), small_mount())
    with pytest.raises(InputError, match="--depth as-measured"):
        SgbmDepth().measure(observation)


@pytest.mark.parametrize("wrong", [{"block_px": 4}, {"min_depth_m": 0.0}, {"max_depth_m": 0.1}])
def test_settings_without_sense_are_refused(wrong):
    with pytest.raises(InputError):
        SgbmConfig(**wrong)


def test_speckles_count_as_such_at_any_resolution():
    """A patch that seems to float before a surface is no reading, however many pixels a camera has for it."""
    for scale in (1, 2):
        depth = np.full((480 * scale, 640 * scale), 0.7, np.float32)
        rows, cols = (slice(a * scale, b * scale) for a, b in ((200, 208), (300, 308)))
        depth[rows, cols] = 0.5
        found = sgbm_depth(made_up_pair(depth, scale * 286.0, BASELINE), scale * 286.0, SgbmConfig())
        assert np.mean((found[rows, cols] > 0) & (found[rows, cols] < 0.6)) < 0.2, scale
        assert np.mean(found[:, 150 * scale :] > 0) > 0.8
