"""Where the number of each object stands in the picture, so that the page can draw it, and knows a click on it."""

from collections.abc import Collection
from typing import Any

import numpy as np
from jaxtyping import Int8

from torc.drawing.marking import number_places


def find_tags(
    label_image: Int8[np.ndarray, "h w"], ids: Collection[int], *, outlines: bool
) -> dict[int, dict[str, Any]]:
    """By id: `box` (left, top, width, height), the pixel of the object where it belongs (`anchor`: column, row), and
    whether a `leader` line ties the two. As `mark_image` writes them, or, with `outlines`, as `mark_pixels` does.
    """
    label = np.where(np.isin(label_image, list(ids)), label_image, -1).astype(np.int16)
    places = number_places(label, {i: i for i in ids}, small=outlines)
    return {
        i: {
            "box": [p.col, p.row, p.size[1], p.size[0]],
            "anchor": [p.anchor[1], p.anchor[0]],
            "leader": p.leader,
        }
        for i, p in places.items()
    }
