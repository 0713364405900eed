"""Textures of mesh files: grey ones of many bits, and what cannot be used."""

import io
import struct
from collections.abc import Callable

import numpy as np
import pytest
from mesh_files import png
from PIL import Image

from torc.scenes.importing.reading.pictures import PictureError, picture

STEPS = np.array([[0, 0x4000, 0x8000, 0xFFFF]])
"""Grey values of 16 bits, and what they are of 8."""
GREYS = [0, 64, 128, 255]


def _tiff(image: Image.Image, tags: dict[int, int] | None = None) -> bytes:
    file = io.BytesIO()
    image.save(file, "TIFF", tiffinfo=tags or {})
    return file.getvalue()


@pytest.mark.parametrize(
    ("write", "dtype"),
    [(png, np.uint16), (_tiff, np.uint16), (_tiff, ">u2"), (_tiff, np.int32)],
    ids=["png", "tiff", "big-endian tiff", "wide tiff"],
)
def test_grey_pictures_of_16_bits_are_scaled(
    write: Callable[[Image.Image], bytes], dtype: np.typing.DTypeLike
) -> None:
    pixels = picture(write(Image.fromarray(STEPS.astype(dtype))), 64)
    assert pixels[0].tolist() == [[g, g, g] for g in GREYS]


def test_grey_pictures_of_12_bits_are_scaled() -> None:
    """Pillow does not write them: four pixels of 12 bits, then the directory."""
    pixels = bytes.fromhex("000400800fff")
    tags = {256: 4, 257: 1, 258: 12, 259: 1, 262: 1, 273: 8, 277: 1, 278: 1, 279: len(pixels)}
    entries = b"".join(struct.pack("<HHII", tag, 4, 1, value) for tag, value in tags.items())
    directory = struct.pack("<H", len(tags)) + entries + bytes(4)
    data = b"II" + struct.pack("<HI", 42, 8 + len(pixels)) + pixels + directory
    assert picture(data, 64)[0, :, 0].tolist() == GREYS


def test_greys_that_begin_with_white_are_turned() -> None:
    sense, white_is_zero = 262, 0
    turned = _tiff(Image.fromarray(STEPS.astype(np.uint16)), {sense: white_is_zero})
    with Image.open(io.BytesIO(turned)) as image:
        assert image.tag_v2[sense] == white_is_zero  # type: ignore[attr-defined]
    assert picture(turned, 64)[0, :, 0].tolist() == [255 - g for g in GREYS]


def test_grey_values_beyond_16_bits_are_refused() -> None:
    for value in (-1, 2**16):
        with pytest.raises(PictureError, match=r"not of 16 bits; save it with 8 bits"):
            picture(_tiff(Image.fromarray(np.full((2, 2), value, np.int32))), 64)


def test_pictures_of_fractions_are_refused() -> None:
    data = _tiff(Image.fromarray(np.full((2, 2), 0.5, np.float32)))
    with pytest.raises(PictureError, match="fractions, which are not read; save it with 8 bits"):
        picture(data, 64)


def test_what_is_no_picture_is_told_in_words() -> None:
    with pytest.raises(PictureError, match="it is of no picture format that is read") as caught:
        picture(b"no picture", 64)
    assert "BytesIO" not in str(caught.value)
