"""Laws of the sensor noise."""

from dataclasses import replace

import numpy as np
import pytest

from torc.errors import InputError
from torc.perception.noise import NoiseConfig, add_sensor_noise, stereo_camera
from torc.records import BACKGROUND, Capture
from torc.testing.synthetic import SyntheticBox, synthetic_capture

BOX = SyntheticBox(1, (0.6, 0.0, 1.11), (0.1, 0.12, 0.12))


@pytest.fixture
def view():
    return synthetic_capture([BOX])


def test_equal_generators_equal_noise_and_the_input_stays(view):
    before = view.observation.depth_m.copy()
    a, b, c = (add_sensor_noise(view, stereo_camera(), np.random.default_rng(s)) for s in (1, 1, 2))
    assert np.array_equal(a.observation.depth_m, b.observation.depth_m)
    assert np.array_equal(a.label_image, b.label_image)
    assert not np.array_equal(a.observation.depth_m, c.observation.depth_m)
    assert np.array_equal(view.observation.depth_m, before)
    assert a.observation.depth_m.dtype == np.float32


@pytest.mark.parametrize("grain_px", [0, 4])
def test_depth_noise_grows_with_the_distance_squared(view, rng, grain_px):
    for z in (0.5, 1.0, 2.0):
        flat = Capture(replace(view.observation, depth_m=np.full_like(view.observation.depth_m, z)))
        noisy = add_sensor_noise(flat, NoiseConfig(depth_sigma_m=0.002, grain_px=grain_px), rng)
        error = noisy.observation.depth_m - z
        assert np.std(error) == pytest.approx(0.002 * z**2, rel=0.1)
        assert abs(np.mean(error)) < 0.1 * 0.002 * z**2


def test_edges_suffer_and_surfaces_do_not(view, rng):
    noisy = add_sensor_noise(view, NoiseConfig(edge_loss=0.5, edge_blend=0.5), rng).observation.depth_m
    depth = view.observation.depth_m
    changed = noisy != depth
    rows, cols = np.nonzero(changed)
    assert len(rows) > 100
    for r, c in zip(rows, cols):
        patch = depth[max(r - 1, 0) : r + 2, max(c - 1, 0) : c + 2]
        assert np.ptp(patch) > 0.05 * depth[r, c]
        value = noisy[r, c]
        assert value == 0 or patch.min() <= value <= patch.max()


def test_without_labels_there_is_noise_too(view):
    blind, labelled = (
        add_sensor_noise(seen, stereo_camera(), np.random.default_rng(1))
        for seen in (Capture(view.observation), view)
    )
    assert blind.label_image is None
    assert np.array_equal(blind.observation.depth_m, labelled.observation.depth_m)


def test_masks_shrink_to_their_inside(view, rng):
    small = add_sensor_noise(view, NoiseConfig(mask_erosion_px=2), rng).label_image
    large = view.label_image
    assert np.all(large[small == 1] == 1)
    assert np.all(small[large != 1] == BACKGROUND)
    lost = np.argwhere((large == 1) & (small != 1))
    assert len(lost) > 100
    background = np.argwhere(large != 1)
    for p in lost[:: max(1, len(lost) // 50)]:
        assert np.min(np.linalg.norm(background - p, axis=1)) < 2.5


def test_nonsense_is_refused():
    with pytest.raises(InputError, match="shares"):
        NoiseConfig(dropout=1.5)
    with pytest.raises(InputError, match="negative"):
        NoiseConfig(depth_sigma_m=-1)
