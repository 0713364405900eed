"""Time of flight: exact where nothing disturbs it, flying at edges, rough where it is dark, none where it is darker."""

from dataclasses import replace

import numpy as np
import pytest

from torc.errors import InputError
from torc.perception.tof import TofConfig, TofDepth
from torc.testing.contexts import box
from torc.testing.depth_conformance import check_depth
from torc.testing.synthetic import synthetic_capture

CLEAN = TofConfig(blur_px=0, scatter=0, noise_m=0, least=0)
SHAPES = (box(1, 0.60, -0.10, (0.06, 0.10, 0.16)),)


@pytest.fixture(scope="module")
def capture():
    return synthetic_capture(SHAPES)


@pytest.fixture(scope="module")
def observation(capture):
    return capture.observation


def test_it_keeps_the_rules():
    check_depth(TofDepth)


def test_without_disturbance_it_is_exact_beyond_the_unambiguous_range_too(observation):
    depth = TofDepth(CLEAN).measure(observation).depth_m
    assert observation.depth_m.max() > 299_792_458 / (2 * CLEAN.frequency_hz)
    np.testing.assert_allclose(depth, observation.depth_m, atol=2e-4)


def test_pixels_at_an_edge_lie_between_both_surfaces(capture, observation):
    depth = TofDepth(replace(CLEAN, blur_px=1.0)).measure(observation).depth_m
    row = 260
    inside = capture.label_image[row] == 1
    edge = int(np.flatnonzero(inside)[0])
    near, far = observation.depth_m[row, edge + 5], observation.depth_m[row, edge - 5]
    between = (depth[row, edge - 3 : edge + 3] > near + 0.005) & (
        depth[row, edge - 3 : edge + 3] < far - 0.005
    )
    assert between.any()
    assert abs(depth[row, edge + 8] - observation.depth_m[row, edge + 8]) < 0.003


def test_noise_grows_with_distance_and_with_darkness(capture, observation):
    config = replace(CLEAN, noise_m=0.002)
    dark = replace(observation, rgb=np.full_like(observation.rgb, 20))
    bright = replace(observation, rgb=np.full_like(observation.rgb, 250))
    errors = {
        name: TofDepth(config).measure(o).depth_m - o.depth_m
        for name, o in (("dark", dark), ("bright", bright))
    }
    table = (capture.label_image == -1) & (observation.depth_m < 0.8)
    wall = observation.depth_m > 3
    assert errors["dark"][table].std() > 2 * errors["bright"][table].std()
    assert errors["bright"][wall].std() > 5 * errors["bright"][table].std()


def test_what_is_too_dark_has_no_reading_and_nothing_else_is_lost(observation):
    rgb = np.full_like(observation.rgb, 255)
    rgb[200:300, 300:400] = 0
    depth = TofDepth(replace(CLEAN, least=0.6)).measure(replace(observation, rgb=rgb)).depth_m
    near = observation.depth_m < 0.7
    patch = np.zeros(near.shape, bool)
    patch[200:300, 300:400] = True
    assert (depth[near & patch] == 0).mean() > 0.9
    assert (depth[near & ~patch] > 0).mean() > 0.9


def test_scattered_light_pulls_dark_distant_things_nearer(observation):
    rgb = np.full_like(observation.rgb, 255)
    wall = observation.depth_m > 3
    rgb[wall] = 10
    seen = replace(observation, rgb=rgb)
    depth = TofDepth(replace(CLEAN, scatter=0.02)).measure(seen).depth_m
    assert np.median(np.abs(depth[wall] - observation.depth_m[wall])) > 0.02


def test_the_same_snapshot_gives_the_same_depth_and_another_moment_another(observation):
    first, again = (TofDepth().measure(observation).depth_m for _ in range(2))
    later = TofDepth().measure(replace(observation, stamp_s=1.0)).depth_m
    assert np.array_equal(first, again)
    assert not np.array_equal(first, later)


def test_settings_are_checked():
    with pytest.raises(InputError, match="frequency"):
        TofConfig(frequency_hz=0)
    with pytest.raises(InputError, match="negative"):
        TofConfig(scatter=-1)
