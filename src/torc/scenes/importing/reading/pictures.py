"""Pictures of strangers as textures."""

import io

import numpy as np
from jaxtyping import UInt8
from PIL import Image, UnidentifiedImageError

_MAX_IMAGE_SIDE_PX, _MAX_IMAGE_PIXELS = 16_384, 80_000_000
_IMAGE_FORMATS = ("PNG", "JPEG", "BMP", "TGA", "TIFF", "WEBP", "GIF")
"""Pillow knows more, some of which start other programs."""
_FAULTS = (
    OSError,
    SyntaxError,
    ValueError,
    EOFError,
    Image.DecompressionBombError,
    Image.DecompressionBombWarning,
)
_MAX_GREY = 2**16 - 1
_TIFF_BITS, _TIFF_SENSE, _WHITE_IS_ZERO = 258, 262, 0


class PictureError(ValueError):
    """A picture cannot be used; the text tells why."""


def picture(data: bytes, texture_px: int) -> UInt8[np.ndarray, "h w 3"]:
    """The colours of a picture file, scaled down to a longest side of texture_px.

    Raises:
        PictureError: too large, damaged, or of a format that is not read.
    """
    try:
        image = Image.open(io.BytesIO(data))
        _check_picture(image)
        small = (_grey(image) if image.mode.startswith("I") else image).convert("RGB")
        if max(small.size) > texture_px:
            factor = texture_px / max(small.size)
            size = (max(1, round(factor * small.width)), max(1, round(factor * small.height)))
            small = small.resize(size, Image.Resampling.LANCZOS)
    except UnidentifiedImageError:  # Pillow's own words name an object in memory
        raise PictureError("it is of no picture format that is read; PNG and JPEG are") from None
    except _FAULTS as error:
        raise PictureError(str(error) or type(error).__name__) from None
    return np.asarray(small, np.uint8)


def _grey(image: Image.Image) -> Image.Image:
    """8 bits of a grey picture of more, which Pillow cuts off at 255 instead of scaling."""
    values = np.asarray(image)
    if values.min() < 0 or values.max() > _MAX_GREY:
        raise ValueError("its grey values are not of 16 bits; save it with 8 bits per colour")
    tags = getattr(image, "tag_v2", {})  # of a TIFF
    most = 2**12 - 1 if tags.get(_TIFF_BITS) == (12,) else _MAX_GREY
    grey = np.round(values * np.float32(255 / most)).astype(np.uint8)
    return Image.fromarray(255 - grey if tags.get(_TIFF_SENSE) == _WHITE_IS_ZERO else grey)


def _check_picture(image: Image.Image) -> None:
    """Raises ValueError for a picture that is not to be unpacked."""
    if image.format not in _IMAGE_FORMATS:
        raise ValueError(f"it is {image.format or 'of an unknown format'}; PNG and JPEG are read")
    if max(image.size) > _MAX_IMAGE_SIDE_PX or image.width * image.height > _MAX_IMAGE_PIXELS:
        raise ValueError(f"{image.width}x{image.height} pixels are too many")
    if image.mode == "F":
        raise ValueError("its colours are fractions, which are not read; save it with 8 bits per colour")
