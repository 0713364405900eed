"""Laws of the sensor noise."""

from dataclasses import replace

import numpy as np
import pytest

from torc.errors import InputError
from torc.perception.noise import NoiseConfig, add_sensor_noise, stereo_camera
from torc.perception.privileged import LabelPerception
from torc.records import BACKGROUND
from torc.testing.synthetic import SyntheticBox, inside, synthetic_observation

BOX = SyntheticBox(1, (0.6, 0.0, 1.11), (0.1, 0.12, 0.12))


@pytest.fixture
def view():
    return synthetic_observation([BOX])


def test_off_by_default(view, rng):
    noisy = add_sensor_noise(view, NoiseConfig(), rng)
    assert np.array_equal(noisy.depth_m, view.depth_m)
    assert np.array_equal(noisy.label_image, view.label_image)


def test_equal_generators_equal_noise_and_the_input_stays(view):
    before = view.depth_m.copy()
    a, b, c = (add_sensor_noise(view, stereo_camera(), np.random.default_rng(s)) for s in (1, 1, 2))
    assert np.array_equal(a.depth_m, b.depth_m)
    assert np.array_equal(a.label_image, b.label_image)
    assert not np.array_equal(a.depth_m, c.depth_m)
    assert np.array_equal(view.depth_m, before)
    assert a.depth_m.dtype == np.float32


@pytest.mark.parametrize("grain_px", [0, 4])
def test_depth_noise_grows_with_the_distance_squared(view, rng, grain_px):
    for z in (0.5, 1.0, 2.0):
        flat = replace(view, depth_m=np.full_like(view.depth_m, z))
        noisy = add_sensor_noise(flat, NoiseConfig(depth_sigma_m=0.002, grain_px=grain_px), rng)
        error = noisy.depth_m - z
        assert np.std(error) == pytest.approx(0.002 * z**2, rel=0.1)
        assert abs(np.mean(error)) < 0.1 * 0.002 * z**2


def test_edges_suffer_and_surfaces_do_not(view, rng):
    noisy = add_sensor_noise(view, NoiseConfig(edge_loss=0.5, edge_blend=0.5), rng)
    changed = noisy.depth_m != view.depth_m
    rows, cols = np.nonzero(changed)
    assert len(rows) > 100
    for r, c in zip(rows, cols):
        patch = view.depth_m[max(r - 1, 0) : r + 2, max(c - 1, 0) : c + 2]
        assert np.ptp(patch) > 0.05 * view.depth_m[r, c]
        value = noisy.depth_m[r, c]
        assert value == 0 or patch.min() <= value <= patch.max()


def test_dropout_loses_that_share(view, rng):
    noisy = add_sensor_noise(view, NoiseConfig(dropout=0.1), rng)
    assert np.mean(noisy.depth_m == 0) == pytest.approx(0.1, abs=0.01)
    kept = noisy.depth_m > 0
    assert np.array_equal(noisy.depth_m[kept], view.depth_m[kept])


def test_pixels_without_a_reading_stay_so(view, rng):
    depth = view.depth_m.copy()
    depth[:50] = 0
    depth[50:60] = np.nan
    noisy = add_sensor_noise(replace(view, depth_m=depth), stereo_camera(), rng)
    assert np.all(noisy.depth_m[:50] == 0)
    assert np.all(np.isnan(noisy.depth_m[50:60]))


def test_masks_shrink_to_their_inside(view, rng):
    small = add_sensor_noise(view, NoiseConfig(mask_erosion_px=2), rng).label_image
    large = view.label_image
    assert np.all(large[small == 1] == 1)
    assert np.all(small[large != 1] == BACKGROUND)
    lost = np.argwhere((large == 1) & (small != 1))
    background = np.argwhere(large != 1)
    for p in lost[:: max(1, len(lost) // 50)]:
        assert np.min(np.linalg.norm(background - p, axis=1)) < 2.5


def test_perception_drops_most_of_the_flying_points(view, rng):
    noisy = add_sensor_noise(view, NoiseConfig(edge_blend=1.0), rng)
    mask = view.label_image == 1
    flying = mask & (np.abs(noisy.depth_m - view.depth_m) > 0.02)
    scene = LabelPerception().perceive(noisy)
    pixels = scene.object(1).pixels
    assert flying.sum() > 50
    assert flying[pixels[:, 0], pixels[:, 1]].sum() < 0.35 * flying.sum()
    assert np.mean(inside(BOX, scene.object(1).points, 0.01)) > 0.98


def test_nonsense_is_refused():
    with pytest.raises(InputError, match="shares"):
        NoiseConfig(dropout=1.5)
    with pytest.raises(InputError, match="negative"):
        NoiseConfig(depth_sigma_m=-1)
