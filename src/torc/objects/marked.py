"""Models with a mark: a shipped one with a round sticker on its front, which is seen from that side only.

They are made from the shipped ones when they are loaded and have no files. Their names are NAME.marked.
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from torc.objects.models import ObjectModel, VisualMesh
from torc.objects.names import SUFFIX, marked_description

COLOR = (0.98, 0.80, 0.05, 1.0)
"""Yellow; no model's front is entirely so."""
_SHARE = 0.42
"""Diameter of the sticker relative to the shorter of the front's edges."""
_ABOVE_M = 0.0008
"""How far the sticker stands off: less than surfaces and contacts agree within, more than depth buffers confuse."""
_CORNERS = 24


@lru_cache(maxsize=32)
def marked(model: ObjectModel) -> ObjectModel:
    """Return a model with the sticker; contacts, mass and size are unchanged."""
    return replace(
        model,
        name=model.name + SUFFIX,
        description=marked_description(model.description),
        visuals=(*model.visuals, _sticker(model)),
    )


def _sticker(model: ObjectModel) -> VisualMesh:
    """Return a disc before the front (-x), at the height of the middle."""
    vertices = np.concatenate([mesh.vertices for mesh in model.visuals])
    lower, upper = vertices.min(axis=0), vertices.max(axis=0)
    _, y, z = (lower + upper) / 2
    radius = 0.5 * _SHARE * float(min(upper[1:] - lower[1:]))
    angle = 2 * np.pi * np.arange(_CORNERS) / _CORNERS
    x = np.full(_CORNERS, lower[0] - _ABOVE_M)
    # Counter-clockwise for an eye at -x: y to the right is -y of the model.
    rim = np.stack([x, y - radius * np.cos(angle), z + radius * np.sin(angle)], axis=1)
    faces = np.array([[0, k, k + 1] for k in range(1, _CORNERS - 1)], dtype=np.int64)
    normals = np.tile([-1.0, 0.0, 0.0], (_CORNERS, 1))
    return VisualMesh(vertices=rim, faces=faces, rgba=COLOR, normals=normals)
