"""Measure how far a scene is laid out as it was: per object, from depth and colour, without a new segmentation.

Masks of two looks at the same scene differ: two objects become one, or an edge moves. The new picture is therefore
not segmented. A pixel of an object's mask counts if it shows the same surface as in the reference: as far away, and of
the same colour. Where an object was moved away, the pixels show its background. A turned or exchanged object shows
other depths or colours.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float32, Int16, UInt8

from torc import InputError, Observation
from torc.geometry.transforms import unproject
from torc.records import BACKGROUND, Capture, VoxelGrid

_FAR = np.float32(1e6)
_SAME_M, _SAME_SHARE = 0.008, 0.012
"""Depths are the same if they differ by at most this, or by this share of the depth."""
_SAME_COLOR = np.array([90, 25, 25], np.float32)
"""Colours (CIELAB, 8 bits) this close are the same; lightness may differ more, because of shadows."""
_AROUND = np.ones((3, 3), np.uint8)
"""Neighbouring pixels that may match instead, because edges flicker."""
_BESIDE_PX = 10
"""Nothing counts as new this close to an object, in a picture 480 pixels high."""
_NEW_SHARE = 5e-4
"""A new thing covers more than this share of the picture."""
_LEAST_TABLE = 0.8
"""Least share of the table that must not have moved."""


@dataclass(frozen=True)
class Overlap:
    """How closely a picture matches its reference.

    Attributes:
        objects: by id, intersection over union of where the object was and is, 0 to 1, assuming that it shows as many
            pixels as before.
        new_px: pixels of the largest new thing, where nothing stood before.
        new: True if that is more than noise.
        table: share of the table visible in both pictures that has not moved.
        table_moved: True if that share is too small: the camera or the table has moved.
    """

    objects: Mapping[int, float]
    new_px: int
    new: bool
    table: float
    table_moved: bool

    def fits(self, threshold: float) -> bool:
        """Return whether every object is in its place and nothing new is there."""
        return not (self.new or self.table_moved) and min(self.objects.values()) >= threshold

    def faults(self, threshold: float) -> list[str]:
        """Return what differs from the reference, in words."""
        off = sorted((value, k) for k, value in self.objects.items() if value < threshold)
        told = [f"object {k} overlaps by {value:.2f}" for value, k in off]
        if self.new:
            told.append(f"something stands where nothing stood ({self.new_px} pixels)")
        if self.table_moved:
            told.append(f"{1 - self.table:.0%} of the table is not where it was: has the camera moved?")
        return told


def measure_overlap(stored: Capture, seen: Observation, grid: VoxelGrid) -> Overlap:
    """Compare a snapshot with a stored reference, whose label image holds the objects' masks, within a grid.

    Args:
        grid: the room in which table and new things count, world frame.

    Raises:
        InputError: the pictures' sizes or intrinsics differ, or the reference has no masks.
    """
    reference, label = stored.observation, _checked_label(stored, seen)
    same = _same_depth(reference.depth_m, seen.depth_m) & _same_color(reference, seen, label)
    ids = np.unique(label[label >= 0]).tolist()
    shares = {k: float(same[label == k].mean()) for k in ids}
    watched = (label == BACKGROUND) & _within(reference, grid)
    low, high = _range(seen.depth_m)
    tolerance = _tolerance(reference.depth_m)
    nearer = (reference.depth_m > 0) & (high > 0) & (high < reference.depth_m - 2 * tolerance)
    table = watched & (high > 0) & ~nearer
    level = float((table & (low < reference.depth_m + tolerance))[table].mean()) if table.any() else 0.0
    new_px = _largest(_apart(nearer & _within(seen, grid), label))
    return Overlap(
        # Of an object that shows as many pixels as it did: n of them in common make n / (2 - n) of the union.
        {k: share / (2 - share) for k, share in shares.items()},
        new_px,
        new_px > _NEW_SHARE * label.size,
        level,
        level < _LEAST_TABLE,
    )


def _checked_label(stored: Capture, seen: Observation) -> Int16[np.ndarray, "h w"]:
    reference, label = stored.observation, stored.label_image
    if label is None or not (label >= 0).any():
        raise InputError("The reference of the scene has no objects. Store the scene again.")
    if label.shape != seen.depth_m.shape or not np.allclose(reference.K, seen.K, rtol=0.01):
        (h, w), (height, width) = label.shape, seen.depth_m.shape
        raise InputError(
            f"The scene was stored with {w}x{h} pixels and fx {reference.K[0, 0]:.0f}; the camera gives {width}x"
            f"{height} pixels and fx {seen.K[0, 0]:.0f}. Use the same camera and settings, or store the scene again."
        )
    return label


def _tolerance(depth_m: Float32[np.ndarray, "h w"]) -> Float32[np.ndarray, "h w"]:
    return np.maximum(_SAME_M, _SAME_SHARE * depth_m).astype(np.float32)


def _range(
    depth_m: Float32[np.ndarray, "h w"],
) -> tuple[Float32[np.ndarray, "h w"], Float32[np.ndarray, "h w"]]:
    """Return the least and greatest reading around each pixel; _FAR and 0 where there is none."""
    read = depth_m > 0
    low = cv2.erode(np.where(read, depth_m, _FAR).astype(np.float32), _AROUND)
    high = cv2.dilate(np.where(read, depth_m, 0).astype(np.float32), _AROUND)
    return np.asarray(low), np.asarray(high)


def _same_depth(then: Float32[np.ndarray, "h w"], now: Float32[np.ndarray, "h w"]) -> Bool[np.ndarray, "h w"]:
    """Return where depths agree. A pixel without a reading counts as agreeing; its colour decides."""
    low, high = _range(now)
    tolerance = _tolerance(then)
    both = (then > 0) & (high > 0)
    return np.asarray(~both | ((then >= low - tolerance) & (then <= high + tolerance)))


def _same_color(
    reference: Observation, seen: Observation, label: Int16[np.ndarray, "h w"]
) -> Bool[np.ndarray, "h w"]:
    """Return where colours agree, corrected for a change of light measured on the background."""
    still = (label == BACKGROUND) & _same_depth(reference.depth_m, seen.depth_m)
    light = (
        (reference.rgb[still].mean(axis=0) + 1) / (seen.rgb[still].mean(axis=0) + 1) if still.any() else 1.0
    )
    then, now = _lab(reference.rgb), _lab(np.rint(np.clip(seen.rgb * light, 0, 255)).astype(np.uint8))
    low, high = np.asarray(cv2.erode(now, _AROUND)), np.asarray(cv2.dilate(now, _AROUND))
    return np.asarray(((then >= low - _SAME_COLOR) & (then <= high + _SAME_COLOR)).all(axis=-1))


def _lab(rgb: UInt8[np.ndarray, "h w 3"]) -> Float32[np.ndarray, "h w 3"]:
    return np.asarray(cv2.cvtColor(cv2.GaussianBlur(rgb, (0, 0), 1.5), cv2.COLOR_RGB2LAB), np.float32)


def _within(observation: Observation, grid: VoxelGrid) -> Bool[np.ndarray, "h w"]:
    """Return the pixels whose surface lies in the grid, or at most 2 cm below its floor."""
    read = observation.depth_m > 0
    rows, cols = np.nonzero(read)
    points = unproject(rows, cols, observation.depth_m[rows, cols], observation.K, observation.T_world_camera)
    floor = grid.origin - [0, 0, 0.02]
    out = np.zeros_like(read)
    out[rows, cols] = ((points >= floor) & (points <= grid.upper)).all(axis=1)
    return out


def _apart(nearer: Bool[np.ndarray, "h w"], label: Int16[np.ndarray, "h w"]) -> Bool[np.ndarray, "h w"]:
    """Return the pixels that are nearer than before, except close to the objects, which may be slightly off."""
    px = max(1, round(_BESIDE_PX * label.shape[0] / 480))
    around = cv2.dilate((label != BACKGROUND).astype(np.uint8), np.ones((2 * px + 1,) * 2, np.uint8))
    return np.asarray(nearer & (around == 0))


def _largest(mask: Bool[np.ndarray, "h w"]) -> int:
    """Return the pixels of the largest connected piece, ignoring thin lines."""
    opened = cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_OPEN, _AROUND)
    _, _, facts, _ = cv2.connectedComponentsWithStats(opened)
    return int(facts[1:, cv2.CC_STAT_AREA].max(initial=0))
