"""What servers answer, as records: sound as far as concerns every user, finite, rigid, probabilities."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float32, Int

from torc_networks.fields import Fields

_MOST_MASKS = 1000


@dataclass(frozen=True)
class Masks:
    """Objects in a picture, which may be of another size than the one that was sent.

    Attributes:
        masks: one per object; they may overlap.
        scores: how surely each is one object, 0 to 1.
    """

    masks: Bool[np.ndarray, "n h w"]
    scores: Float32[np.ndarray, "n"]


@dataclass(frozen=True)
class Disparity:
    """Of the left picture, maybe at another size than was sent; in pixels of this size, 0 or not finite for none.

    Attributes:
        confidence: 0 to 1; None where the server tells none.
    """

    disparity_px: Float32[np.ndarray, "h w"]
    confidence: Float32[np.ndarray, "h w"] | None


@dataclass(frozen=True)
class Grasps:
    """Gripper poses, by what the network's own frame is.

    Attributes:
        Ts: rigid; in the frame of the points that were sent.
        confidences: 0 to 1.
        widths_m: distance of the pads on the object; NaN where the server does not tell.
        object_ids: of the points' objects; None where the points were one object's.
    """

    Ts: Float[np.ndarray, "n 4 4"]
    confidences: Float[np.ndarray, "n"]
    widths_m: Float[np.ndarray, "n"]
    object_ids: Int[np.ndarray, "n"] | None


@dataclass(frozen=True)
class Motion:
    """A timed path, unchecked: times rise from 0 (seconds), positions in radians."""

    times_s: Float[np.ndarray, "t"]
    qpos: Float[np.ndarray, "t dof"]


def read_masks(answer: Fields) -> Masks:
    """{masks (n, h, w) of truth values or 0 and 1} or {labels (h, w): a mask's number per pixel, negative for none},
    {scores (n)}.
    """
    if answer.has("masks") == answer.has("labels"):
        raise answer.refuse("it must hold either 'masks' or 'labels'.")
    count = len(answer.array("scores", (None,), "iuf"))
    if count > _MOST_MASKS:
        raise answer.refuse(f"it holds {count} masks; {_MOST_MASKS} are the most.")
    scores = answer.probabilities("scores", count).astype(np.float32)
    if answer.has("masks"):
        masks = answer.array("masks", (count, None, None), "biu")
        if masks.dtype != np.bool_ and ((masks < 0) | (masks > 1)).any():
            raise answer.refuse("'masks' must be truth values, or 0 and 1.")
        return Masks(masks.astype(np.bool_), scores)
    labels = answer.array("labels", (None, None), "iu")
    if labels.size and int(labels.max()) >= count:
        raise answer.refuse(f"'labels' go up to {labels.max()}, and there are {count} scores.")
    return Masks(labels == np.arange(count)[:, None, None], scores)


def read_disparity(answer: Fields) -> Disparity:
    """{disparity (h, w), confidence (h, w) if the server has one}."""
    disparity, confidence = answer.array("disparity", (None, None), "f"), None
    if disparity.size == 0:
        raise answer.refuse("'disparity' is empty.")
    with np.errstate(over="ignore"):  # what is too large for float32 is infinite
        if answer.has("confidence"):
            confidence = answer.array("confidence", disparity.shape, "f").astype(np.float32)
        return Disparity(disparity.astype(np.float32), confidence)


def read_grasps(answer: Fields, tells_objects: bool = False) -> Grasps:
    """{grasps (n, 4, 4), confidences (n), widths (n) if the server knows them}; with `tells_objects` object_ids (n)."""
    Ts = answer.poses("grasps")
    n = len(Ts)
    if n == 0:
        none = np.zeros(0)
        return Grasps(Ts, none, none, np.zeros(0, np.int64) if tells_objects else None)
    confidences, widths = answer.probabilities("confidences", n), np.full(n, np.nan)
    if answer.has("widths"):
        widths = answer.array("widths", (n,), "f").astype(np.float64)
        if (widths < 0).any() or np.isinf(widths).any():
            raise answer.refuse("'widths' must be metres, or NaN where they are not known.")
    ids = answer.array("object_ids", (n,), "iu").astype(np.int64) if tells_objects else None
    return Grasps(Ts, confidences, widths, ids)


def read_motion(answer: Fields, dof: int) -> Motion | str:
    """{times (t), positions (t, dof)}, or {failure: why there is no motion}."""
    if answer.has("failure"):
        return answer.text("failure")
    times = answer.finite("times", (None,))
    if len(times) < 2 or times[0] != 0 or (np.diff(times) <= 0).any():
        raise answer.refuse("'times' must begin with 0 and rise.")
    return Motion(times, answer.finite("positions", (len(times), dof)))
