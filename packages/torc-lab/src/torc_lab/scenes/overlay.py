"""Draw the picture that guides a person in laying a scene out: the reference over the live picture."""

import cv2
import numpy as np
from jaxtyping import UInt8

from torc import Observation
from torc.drawing.marking import rim, write_numbers
from torc.drawing.strip import crop_around_objects
from torc.records import Capture
from torc_lab.scenes.overlap import Overlap

_GHOST = 0.45
"""Weight of the reference picture where an object is not in its place."""
_MARGIN_PX = 50
_COLORS = {"good": (0, 200, 120), "near": (240, 170, 0), "bad": (255, 60, 20)}
"""Colours of outlines. Colour-blind people can tell them apart, too; worse is also thicker."""
_THICK_PX = {"good": 2, "near": 3, "bad": 4}
_NEAR = 0.6
"""Share of the threshold from which on an object is nearly in its place."""


def state_of(overlap: float, threshold: float) -> str:
    """Return how well an object lies: "good", "near" or "bad"."""
    if overlap >= threshold:
        return "good"
    return "near" if overlap >= _NEAR * threshold else "bad"


def overlay(
    reference: Capture, seen: Observation, found: Overlap, threshold: float, width_px: int = 1280
) -> UInt8[np.ndarray, "h v 3"]:
    """Return the live picture around the objects, with an outline and a number at each object's place.

    Outlines are green if the object is in its place, orange if nearly, else red and thick. Where it is not in its
    place, the reference shines through.

    Args:
        found: overlap of each object.
        threshold: least overlap of an object in its place.
        width_px: width of the picture returned.

    Raises:
        ValueError: the reference has no masks.
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
