"""Distances along the rays, taken for depth along the axis."""

import re
from dataclasses import replace

import numpy as np
import pytest
from frame_makers import SHAPES, arrays, npz, observe

from torc.errors import InputError
from torc.geometry.transforms import look_at
from torc.perception.noise import add_sensor_noise, stereo_camera
from torc.pipeline.frames import load_frame
from torc.pipeline.frames.against_picture import along_rays_doubt
from torc.testing.synthetic import synthetic_capture, synthetic_observation
from torc.workspace.description import CameraMount


def looking_down(down_deg):
    down = np.deg2rad(down_deg)
    eye = (0.65 - 0.7 * np.cos(down), -0.1, 1.05 + 0.7 * np.sin(down))
    return look_at(eye, (0.65, -0.1, 1.05))


def seen_from(down_deg, fov_rad=0.9):
    return synthetic_capture(SHAPES, CameraMount(looking_down(down_deg), 320, 240, fov_rad))


def rays(observation):
    K, depth = observation.K, observation.depth_m
    v, u = np.mgrid[: depth.shape[0], : depth.shape[1]]
    return np.sqrt(1 + ((u - K[0, 2]) / K[0, 0]) ** 2 + ((v - K[1, 2]) / K[1, 1]) ** 2).astype(np.float32)


@pytest.mark.parametrize("noisy", [False, True])
@pytest.mark.parametrize("down_deg", [30, 50, 75, 89])
def test_distances_are_noticed_and_depth_is_not_doubted(down_deg, noisy, rng):
    seen = seen_from(down_deg)
    o = (add_sensor_noise(seen, stereo_camera(), rng) if noisy else seen).observation
    assert "along each pixel's ray" in along_rays_doubt(o.depth_m * rays(o), o.K)
    assert along_rays_doubt(o.depth_m, o.K) == ""


def test_the_formula_in_the_message_mends_it():
    o = seen_from(50).observation
    text = along_rays_doubt(o.depth_m * rays(o), o.K)
    formula = re.search(r"divide it by (sqrt\(.*\)\^2\))", text).group(1).replace("^", "**")
    (fx, _, cx), (_, fy, cy) = o.K[:2]
    v, u = np.mgrid[: o.depth_m.shape[0], : o.depth_m.shape[1]]
    names = {"sqrt": np.sqrt, "u": u, "v": v, "fx": fx, "fy": fy, "cx": cx, "cy": cy}
    mended = o.depth_m * rays(o) / eval(formula, names)
    np.testing.assert_allclose(mended, o.depth_m, rtol=1e-5)


def test_nothing_is_said_without_a_plane_or_with_hardly_a_reading(rng):
    o = observe()
    assert along_rays_doubt(rng.uniform(0.3, 2.5, o.depth_m.shape).astype(np.float32), o.K) == ""
    for lone in (0, 1, 60):
        depth = np.zeros_like(o.depth_m)
        depth.flat[:lone] = 0.5
        assert along_rays_doubt(depth, o.K) == ""
    assert along_rays_doubt(np.where(np.arange(320) < 60, 0.5, np.zeros_like(o.depth_m)), o.K) == ""


@pytest.mark.parametrize("pose", [True, False])
def test_a_frame_says_so_with_a_pose_and_without(tmp_path, pose):
    seen = seen_from(50)
    o, given = seen.observation, {} if pose else {"T_world_camera": None, "labels": None}
    frame = load_frame(npz(tmp_path, **arrays(seen) | given | {"depth_m": o.depth_m * rays(o)}))
    (message,) = frame.warnings
    assert "along each pixel's ray" in message


def test_a_refusal_says_so_too(tmp_path):
    """Empty of objects, and of a support that is flat enough."""
    bare = synthetic_observation([], CameraMount(looking_down(30), 320, 240, 1.5))
    bare = replace(bare, depth_m=bare.depth_m * rays(bare))
    with pytest.raises(InputError, match="along each pixel's ray"):
        load_frame(
            npz(tmp_path, rgb=bare.rgb, depth_m=bare.depth_m, K=bare.K, T_world_camera=None, labels=None)
        )


def test_a_pose_of_open_direction_is_refused_with_the_cause(tmp_path):
    seen = seen_from(30, 1.4)
    o = seen.observation
    changes = {
        "depth_m": o.depth_m * rays(o),
        "T_world_camera": None,
        "extrinsics": o.T_world_camera,
    }
    with pytest.raises(InputError, match=r"does not say which.*along each pixel's ray"):
        load_frame(npz(tmp_path, **arrays(seen) | changes))
