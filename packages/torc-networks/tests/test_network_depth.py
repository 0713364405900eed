"""Depth by a server: what it finds becomes depth by hand-computed rules, and torc's own matcher behind it is itself."""

from dataclasses import replace

import numpy as np
import pytest

from torc.errors import InputError, NetworkError
from torc.perception.stereo import SgbmDepth, made_up_pair
from torc.pipeline.building import build_pipeline, make_stage
from torc.records import Observation, StereoPair
from torc.specs.conditions import PipelineSpec
from torc.testing.contexts import box, small_mount
from torc.testing.depth_conformance import check_depth
from torc.testing.synthetic import synthetic_observation
from torc_networks.addresses import ServerConfig
from torc_networks.depth import NetworkDepth, NetworkDepthConfig

FX, BASELINE, SHAPE = 200.0, 0.1, (6, 60)
"""So a disparity of 20 px is 1 m."""
INF, NAN = float("inf"), float("nan")


def _observation(shape=SHAPE):
    grey = np.arange(shape[0] * shape[1], dtype=np.uint8).reshape(shape)
    K = np.array([[FX, 0, 30.0], [0, 2 * FX, 3.0], [0, 0, 1]])
    pair = StereoPair(grey, grey[:, ::-1].copy(), BASELINE)
    zeros = np.zeros(shape, np.float32)
    return Observation(np.zeros((*shape, 3), np.uint8), zeros, K, np.eye(4), np.zeros(0), 0.0, pair=pair)


@pytest.fixture
def measured(server_of):
    """The depth that a stage makes of a server's disparity."""

    def make(disparity, observation=None, confidence=None, **settings):
        answer = {"disparity": np.asarray(disparity), "confidence": confidence}
        server = server_of(stereo=answer)
        stage = NetworkDepth(NetworkDepthConfig(server=server, **settings))
        return stage.measure(observation or _observation()).depth_m

    return make


def _row(values, shape=SHAPE):
    return np.broadcast_to(np.asarray(values, np.float32), shape)


@pytest.mark.parametrize("kind", ["f2", "f4", "f8"])
def test_disparity_becomes_depth(measured, kind):
    depth = measured(_row(np.full(60, 20)).astype(kind))
    assert depth.dtype == np.float32
    np.testing.assert_allclose(depth[:, 20:], 1.0, rtol=1e-6)
    assert not depth[:, :20].any()


@pytest.mark.parametrize("none", [0.0, -3.0, NAN, INF, -INF, 1e-30, 1e300, 60.5])
def test_what_is_no_disparity_is_no_reading(measured, none):
    disparity = np.full(SHAPE, 20.0)
    disparity[:, 50:] = none
    depth = measured(disparity)
    assert not depth[:, 50:].any()
    assert (depth[:, 20:50] > 0).all()


@pytest.mark.parametrize(("wide", "high"), [(30, 3), (120, 12), (15, 2), (90, 9)])
def test_a_disparity_of_another_size_is_in_its_own_pixels(measured, wide, high):
    """At half the width 10 px are 20 px of the camera's; rows have no say, whatever their rounding."""
    depth = measured(np.full((high, wide), 20.0 * wide / 60))
    np.testing.assert_allclose(depth[:, 20:], 1.0, rtol=1e-6)
    assert not depth[:, :20].any()


def test_values_of_another_size_are_those_of_the_nearest_pixel(measured):
    """Nothing between two surfaces: 4 and 10 px of 30 columns are 8 and 20 px of 60, or 2.5 and 1 m."""
    depth = measured(np.where(np.arange(30) < 15, 4.0, 10.0) + np.zeros((3, 1)))
    np.testing.assert_allclose(np.unique(depth[depth > 0]), [1.0, 2.5], rtol=1e-6)


@pytest.mark.parametrize("shape", [(60, 6), (6, 59, 1), (6, 30), (1, 1), (6, 80), (0, 60)])
def test_a_disparity_of_another_view_is_refused(measured, shape):
    with pytest.raises(NetworkError):
        measured(np.full(shape, 2.0))


def test_pictures_are_sent_scaled_and_what_comes_back_counts_at_that_scale(server_of, told):
    observation = _observation((40, 60))
    server = server_of(stereo=lambda asked: {"disparity": np.full(asked["left"].shape, 10.0)})
    depth = NetworkDepth(NetworkDepthConfig(server=server, scale=0.5)).measure(observation).depth_m
    assert told["stereo"]["left"].shape == (20, 30)
    # 200 px * .1 m / .3 m = 66.7 px at most, half of that on the half picture.
    assert told["stereo"]["max_disparity"] == 34
    np.testing.assert_allclose(depth[:, 20:], 1.0, rtol=1e-6)


def test_left_and_right_arrive_as_they_are(server_of, told):
    server = server_of(stereo={"disparity": np.ones(SHAPE)})
    observation = _observation()
    NetworkDepth(NetworkDepthConfig(server=server)).measure(observation)
    np.testing.assert_array_equal(told["stereo"]["left"], observation.pair.left)
    np.testing.assert_array_equal(told["stereo"]["right"], observation.pair.right)


def test_what_the_matcher_does_not_trust_is_no_reading(measured):
    confidence = _row(np.linspace(0, 1, 60)).copy()
    confidence[0] = NAN
    depth = measured(_row(np.full(60, 20)), confidence=confidence, min_confidence=0.5)
    assert not depth[0].any()
    np.testing.assert_array_equal(depth[1:] > 0, confidence[1:] >= 0.5)


def test_readings_keep_to_the_range(measured):
    assert not measured(_row(np.full(60, 20)), max_depth_m=0.99).any()
    assert not measured(_row(np.full(60, 20)), min_depth_m=1.01).any()


def test_torcs_own_matcher_behind_a_server_gives_what_it_gives_here(server_of, own_parts):
    depth = np.full((120, 200), 0.8, np.float32)
    depth[40:80, 90:150] = 0.5
    here = replace(_observation(depth.shape), pair=made_up_pair(depth, FX, BASELINE))
    server = server_of(stereo=own_parts.stereo)
    there = NetworkDepth(NetworkDepthConfig(server=server)).measure(here).depth_m
    np.testing.assert_array_equal(there, SgbmDepth().measure(here).depth_m)
    assert (there > 0).mean() > 0.5


def test_it_conforms(server_of, own_parts):
    server = server_of(stereo=own_parts.stereo)
    check_depth(lambda: NetworkDepth(NetworkDepthConfig(server=server)))


def test_it_is_made_by_name_and_settings(workspace, robot):
    settings = {"depth.server.address": "tcp://10.0.0.9:1", "depth.server.remote": True, "depth.scale": 0.5}
    spec = PipelineSpec(depth="network", settings=settings)
    made = make_stage(spec, "depth")
    assert made.config == NetworkDepthConfig(scale=0.5, server=ServerConfig("tcp://10.0.0.9:1", remote=True))
    assert (
        build_pipeline(spec, robot, workspace).occlusion
        == build_pipeline(PipelineSpec(depth="sgbm"), robot, workspace).occlusion
    )
    with pytest.raises(InputError, match="not on this machine"):
        make_stage(
            PipelineSpec(depth="network", settings={"depth.server.address": "tcp://10.0.0.9:1"}), "depth"
        )


def test_a_camera_without_a_pair_is_told_what_to_do():
    observation = synthetic_observation((box(0, 0.62, -0.1, (0.05, 0.06, 0.1)),), small_mount())
    with pytest.raises(InputError, match="--depth as-measured"):
        NetworkDepth().measure(observation)


@pytest.mark.parametrize(
    "wrong", [{"scale": 0.0}, {"scale": 9.0}, {"min_depth_m": 0.0}, {"max_depth_m": 0.1}]
)
def test_settings_without_sense_are_refused(wrong):
    with pytest.raises(InputError):
        NetworkDepthConfig(**wrong)


@pytest.mark.parametrize(
    "wrong",
    [
        {},
        {"left": np.zeros((20, 20), np.uint8), "right": np.zeros((20, 21), np.uint8), "max_disparity": 16},
        {"left": np.zeros((20, 20)), "right": np.zeros((20, 20)), "max_disparity": 16},
        {"left": np.zeros((20, 20), np.uint8), "right": np.zeros((20, 20), np.uint8), "max_disparity": 10**9},
        {"left": np.zeros((20, 20), np.uint8), "right": np.zeros((20, 20), np.uint8), "max_disparity": True},
    ],
    ids=str,
)
def test_torcs_own_server_refuses_bad_requests(wrong, own_parts):
    with pytest.raises(InputError):
        own_parts.stereo(wrong)


def test_torcs_own_server_takes_colour_too(own_parts):
    depth = np.full((60, 120), 0.8, np.float32)
    pair = made_up_pair(depth, FX, BASELINE)
    asked = {"left": pair.left, "right": pair.right, "max_disparity": 32}
    colour = {**asked, "left": np.stack([pair.left] * 3, 2), "right": np.stack([pair.right] * 3, 2)}
    answer = own_parts.stereo
    np.testing.assert_array_equal(answer(asked)["disparity"], answer(colour)["disparity"])
