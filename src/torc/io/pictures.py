"""Pictures as bytes (PNG, JPEG), and those of more than 8 bits scaled, where PIL would clip them to white."""

import base64
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import UInt8
from PIL import Image


def write_png(path: Path, rgb: UInt8[np.ndarray, "h w 3"]) -> None:
    """Write a picture. Raises OSError where it cannot."""
    path.write_bytes(png_bytes(rgb))


def png_bytes(rgb: UInt8[np.ndarray, "h w 3"]) -> bytes:
    """A picture as a PNG file; the same picture gives the same bytes."""
    _, encoded = cv2.imencode(".png", cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR))
    return encoded.tobytes()


def jpeg_bytes(rgb: UInt8[np.ndarray, "h w 3"], quality: int = 92) -> bytes:
    """A picture as a JPEG file, a quarter of the size."""
    _, encoded = cv2.imencode(
        ".jpg", cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, quality]
    )
    return encoded.tobytes()


def media_type(picture: bytes) -> str:
    """Of a file that is PNG or JPEG."""
    return "image/jpeg" if picture.startswith(b"\xff\xd8\xff") else "image/png"


def data_url(picture: bytes) -> str:
    """A PNG or JPEG file in the form in which pages and messages carry it."""
    return f"data:{media_type(picture)};base64,{base64.b64encode(picture).decode()}"


def eight_bit_picture(image: Image.Image) -> Image.Image:
    """The picture in a mode that PIL converts to colour without clipping: deep grey ones are scaled."""
    deep = image.mode.startswith(("I", "F"))
    return Image.fromarray(in_eight_bits(np.array(image))) if deep else image


def in_eight_bits(image: np.ndarray) -> np.ndarray:
    """Brightness from 0 to 255: of floats up to 1, and of integers of 10 to 16 bits, by the least such range that holds
    all of them. Other pictures pass as they are.
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
