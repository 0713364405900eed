"""The picture by which a person lays a scene out: the reference over what the camera sees now."""

import cv2
import numpy as np
from jaxtyping import UInt8

from torc import Observation
from torc.drawing.marking import rim, write_numbers
from torc.drawing.strip import crop_around_objects
from torc.records import Capture
from torc_lab.scenes.overlap import Overlap

_GHOST = 0.45
"""Share of the reference where an object is not in its place."""
_MARGIN_PX = 50
_COLORS = {"good": (0, 200, 120), "near": (240, 170, 0), "bad": (255, 60, 20)}
"""Of outlines; they differ for the colour-blind too, and the worse the thicker."""
_THICK_PX = {"good": 2, "near": 3, "bad": 4}
_NEAR = 0.6
"""Of the threshold: an object that overlaps by so much is nearly there."""


def state_of(overlap: float, threshold: float) -> str:
    """How an object lies: "good", "near" or "bad"."""
    if overlap >= threshold:
        return "good"
    return "near" if overlap >= _NEAR * threshold else "bad"


def overlay(
    reference: Capture, seen: Observation, found: Overlap, threshold: float, width_px: int = 1280
) -> UInt8[np.ndarray, "h v 3"]:
    """The live picture around the objects, so wide; over it, where they have to be, an outline and a number per object:
    green where it is in its place, orange where nearly, red and thick else. There the reference shines through. Raises
    ValueError for a reference without masks.
    """
    if reference.label_image is None:
        raise ValueError("The reference has no masks.")
    crop = crop_around_objects(reference.label_image, _MARGIN_PX)
    height, width = reference.label_image[crop].shape
    size = width_px, max(1, round(height * width_px / width))
    then, image = (np.asarray(cv2.resize(o.rgb[crop], size), np.uint8) for o in (reference.observation, seen))
    label = np.asarray(cv2.resize(reference.label_image[crop], size, interpolation=cv2.INTER_NEAREST))
    off = np.isin(label, [k for k, value in found.objects.items() if value < threshold])
    image[off] = np.rint(image[off] + _GHOST * (then[off].astype(np.float32) - image[off]))
    scale = max(1.0, label.shape[0] / 480)
    states = {k: state_of(value, threshold) for k, value in found.objects.items()}
    for k in sorted(states, key=lambda k: -found.objects[k]):
        mask = (label == k).astype(np.uint8)
        image[rim(mask, round(scale * _THICK_PX[states[k]])) & (mask > 0)] = _COLORS[states[k]]
    write_numbers(image, label, {k: k for k in states})
    return image
