"""Pictures as people store them, made those that torc reads: 8-bit RGB, one number per pixel."""

import numpy as np
from jaxtyping import UInt8

from torc.io.pictures import in_eight_bits

_MOST_INSTANCES = 1000


def as_rgb(image: np.ndarray) -> UInt8[np.ndarray, "h w 3"] | np.ndarray:
    """A colour picture of any depth, with an alpha channel or without, channels first or last. Whatever else is given
    comes back as it is.
    """
    if image.ndim == 3 and image.shape[0] in (3, 4) and image.shape[2] not in (3, 4):
        image = np.moveaxis(image, 0, -1)
    if image.ndim != 3 or image.shape[2] not in (3, 4):
        return image
    return np.ascontiguousarray(in_eight_bits(image)[..., :3])


def as_plane(image: np.ndarray) -> np.ndarray:
    """Depth or labels without axes of length one."""
    return np.squeeze(image) if image.ndim > 2 and np.squeeze(image).ndim == 2 else image


def as_labels(image: np.ndarray) -> np.ndarray:
    """Whole numbers per pixel: of floats that are whole, of one mask (1 where it is), and of a stack of masks (1 for
    the first one, and so on; a later one covers an earlier one). Whatever else is given comes back as it is.
    """
    image = as_plane(image)
    if image.ndim == 3 and (image.dtype == bool or (image.shape[2] != 3 and np.isin(image, (0, 1)).all())):
        first = image if image.shape[0] < image.shape[2] else np.moveaxis(image, -1, 0)
        if len(first) > _MOST_INSTANCES:
            return image
        stacked = np.zeros(first.shape[1:], np.int16)
        for number, mask in enumerate(first, start=1):
            stacked[mask.astype(bool)] = number
        return stacked
    if image.dtype == bool:
        return image.astype(np.int16)
    if np.issubdtype(image.dtype, np.floating) and np.isfinite(image).all():
        whole = np.round(image)
        if (whole == image).all() and np.abs(image).max(initial=0) < 2**31:
            return whole.astype(np.int64)
    return image
