"""Pictures as bytes (PNG, JPEG), and pictures of untrusted files, read within bounds.

Pictures of more than 8 bits are scaled, where PIL would clip them to white.
"""

import base64
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import UInt8
from PIL import Image

from torc.errors import InputError

MAX_PIXELS = 20_000_000


def write_png(path: Path, rgb: UInt8[np.ndarray, "h w 3"]) -> None:
    """Write a picture as PNG. Raises OSError if it cannot be written."""
    path.write_bytes(png_bytes(rgb))


def png_bytes(rgb: UInt8[np.ndarray, "h w 3"]) -> bytes:
    """Return a picture as a PNG file; equal pictures give equal bytes."""
    _, encoded = cv2.imencode(".png", cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR))
    return encoded.tobytes()


def jpeg_bytes(rgb: UInt8[np.ndarray, "h w 3"], quality: int = 92) -> bytes:
    """Return a picture as a JPEG file, about a quarter of the PNG's size."""
    _, encoded = cv2.imencode(
        ".jpg", cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, quality]
    )
    return encoded.tobytes()


def media_type(picture: bytes) -> str:
    """Return the media type of a PNG or JPEG file."""
    return "image/jpeg" if picture.startswith(b"\xff\xd8\xff") else "image/png"


def data_url(picture: bytes) -> str:
    """Return a PNG or JPEG file as the data URL that pages and messages carry."""
    return f"data:{media_type(picture)};base64,{base64.b64encode(picture).decode()}"


def eight_bit_picture(image: Image.Image) -> Image.Image:
    """Return the picture in a mode that PIL converts to colour without clipping: deep grey ones are scaled."""
    deep = image.mode.startswith(("I", "F"))
    return Image.fromarray(in_eight_bits(np.array(image))) if deep else image


def in_eight_bits(image: np.ndarray) -> np.ndarray:
    """Scale brightness to 0..255: floats up to 1, and integers of 10 to 16 bits by the least range that holds all of
    them.

    Other pictures are unchanged.
    """
    if image.dtype == np.uint8 or image.size == 0 or not np.issubdtype(image.dtype, np.number):
        return image
    if not np.isfinite(image).all() or image.min() < 0:
        return image
    brightest = float(image.max())
    if np.issubdtype(image.dtype, np.floating):
        top = 1.0 if brightest <= 1.0 else 255.0
    else:
        top = next((float(2**bits - 1) for bits in (8, 10, 12, 14, 16) if brightest < 2**bits), brightest)
    if brightest > top:
        return image
    return np.round(image * (255.0 / top)).astype(np.uint8)


def read_pixels(path: Path) -> np.ndarray:
    """Read a picture's pixels: rgb.png in colour, others unchanged. Raises InputError."""
    try:
        with Image.open(path) as opened:
            if opened.width * opened.height > MAX_PIXELS:
                raise ValueError(f"{opened.width}x{opened.height} pixels are too many")
            if path.name != "rgb.png":
                return np.array(opened)
            return np.array(eight_bit_picture(opened).convert("RGB"))
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise InputError(f"Cannot read the image {path}: {error}.") from error
