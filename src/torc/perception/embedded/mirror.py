"""A picture and its mirror image, asked alike: the mean of two answers is righter than either."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float32

from torc.perception.embedded.instances import OFFSETS

_ACROSS = 2
"""Channel of the normal's part to the right, which a mirror turns round."""


def both_ways(
    network: Callable[[Float32[np.ndarray, "c h w"]], Float32[np.ndarray, "o h w"]],
    inputs: Float32[np.ndarray, "c h w"],
) -> Float32[np.ndarray, "o h w"]:
    """What the network says on average of a picture and of its mirror image, in the picture's own pixels."""
    image = np.ascontiguousarray(inputs[..., ::-1])
    image[_ACROSS] = -image[_ACROSS]
    out = network(inputs)
    return np.float32(0.5) * (out + unmirrored(network(image), out))


def unmirrored(
    said: Float32[np.ndarray, "o h w"], otherwise: Float32[np.ndarray, "o h w"]
) -> Float32[np.ndarray, "o h w"]:
    """What was said of a mirror image, of the picture itself. Where the partner of a pixel lies outside of the mirror
    image: `otherwise`."""
    turned = said[..., ::-1]
    out = otherwise.copy()
    out[0] = turned[0]
    for k, (rows, cols) in enumerate(OFFSETS, start=1):
        # In the picture, the partner is as many columns to the left.
        if (rows, -cols) in OFFSETS:
            out[1 + OFFSETS.index((rows, -cols))] = turned[k]
        else:  # only to the right: the pair is the partner's
            out[k, :, :-cols] = turned[k, :, cols:]
    return out
