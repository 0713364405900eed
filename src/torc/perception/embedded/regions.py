"""The stage `--perception regions`: as `embedded`, but for the masks, which are grown by hand-written rules.

What rises from the support is divided where depth jumps and where surfaces meet in a concave edge: most things bulge.
A bowl falls into its walls, and two boxes side by side are one. It is here to show what the network adds.
"""

from typing import NamedTuple

import cv2
import numpy as np
from jaxtyping import Bool
from scipy import ndimage

from torc.perception.embedded.inputs import Patch, channels
from torc.perception.embedded.instances import Instances, numbered
from torc.perception.embedded.perception import EmbeddedPerception

_LEAST_M = 0.006
"""What rises less is the support."""
_JUMP_M = 0.012
"""Neighbouring pixels (2 mm apart) further from each other than this show two surfaces."""
_CONCAVE = 0.25
"""Two surfaces meet in a concave edge if one normal leans towards the other by more than this (sine)."""
_STEP_PX = 3


class RegionPerception(EmbeddedPerception):
    """Objects by rules."""

    def _instances(self, patch: Patch) -> Instances:
        label = numbered(grow_regions(patch), self.config.instances.min_pixels)
        return Instances(label, np.full(int(label.max(initial=-1)) + 1, 0.5, np.float32))


class _Edges(NamedTuple):
    rising: Bool[np.ndarray, "h w"]
    edge: Bool[np.ndarray, "h w"]


def grow_regions(patch: Patch) -> np.ndarray:
    """A number per region from 0 on, -1 for the support and what shows nothing; (h, w) int32."""
    rising, edge = _edges(patch)
    _, regions = cv2.connectedComponents((rising & ~edge).astype(np.uint8), connectivity=4)
    rows, cols = ndimage.distance_transform_edt(regions == 0, return_distances=False, return_indices=True)
    return np.where(rising, regions[rows, cols] - 1, -1).astype(np.int32)


def _edges(patch: Patch) -> _Edges:
    rising = (patch.points[..., 2] > _LEAST_M) & patch.read
    normals = channels(patch)[2:5]
    edge = np.zeros(rising.shape, bool)
    for axis in (0, 1):
        ahead, behind = np.roll(patch.points, -1, axis), np.roll(patch.points, 1, axis)
        jump = np.maximum(
            np.linalg.norm(ahead - patch.points, axis=-1), np.linalg.norm(behind - patch.points, axis=-1)
        )
        edge |= jump > _JUMP_M
        # Over an edge that bulges, normals lean away from each other; towards each other over one that caves in.
        n0, n1 = np.roll(normals, _STEP_PX, axis + 1), np.roll(normals, -_STEP_PX, axis + 1)
        way = np.moveaxis(
            np.roll(patch.points, -_STEP_PX, axis) - np.roll(patch.points, _STEP_PX, axis), -1, 0
        )
        way = way / np.maximum(np.linalg.norm(way, axis=0), 1e-9)
        edge |= ((n0 - n1) * way).sum(axis=0) > 2 * _CONCAVE
    return _Edges(rising, edge)
