"""Deep grey pictures keep their shades where PIL would clip them to white."""

import numpy as np
import pytest
from PIL import Image

from torc.io.pictures import in_eight_bits
from torc.perception.target import load_pictures

RAMP = np.linspace(0, 1, 64 * 48).reshape(48, 64)


@pytest.mark.parametrize("top", [255, 1023, 4095, 65535])
def test_deep_values_are_scaled(top):
    scaled = in_eight_bits(np.round(RAMP * top).astype(np.uint16))
    assert (scaled.min(), scaled.max()) == (0, 255)
    assert abs(np.median(scaled) - 127.5) < 1


@pytest.mark.parametrize(
    ("deep", "name"),
    [
        (np.round(RAMP * 65535).astype(np.uint16), "deep.png"),
        (np.round(RAMP * 4095).astype(np.uint16), "deep.png"),
        (np.round(RAMP * 65535).astype(np.int32), "deep.tif"),
        (RAMP.astype(np.float32), "deep.tif"),
    ],
)
def test_a_deep_reference_picture_keeps_its_shades(tmp_path, deep, name):
    Image.fromarray(deep).save(tmp_path / name)
    (picture,) = load_pictures([tmp_path / name])
    assert np.abs(picture[..., 0] - 255 * RAMP).max() < 1.5


def test_a_large_deep_reference_picture_is_shrunk(tmp_path):
    Image.fromarray(np.round(np.kron(RAMP, np.ones((40, 40))) * 65535).astype(np.uint16)).save(
        tmp_path / "large.png"
    )
    (picture,) = load_pictures([tmp_path / "large.png"])
    assert max(picture.shape) == 1024
    assert 120 < picture.mean() < 135
