"""Pictures of more than 8 bits, scaled to 8 where PIL would clip them to white."""

import numpy as np
from PIL import Image


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
