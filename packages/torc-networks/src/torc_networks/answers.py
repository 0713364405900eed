"""Read what servers answer as records, sound in what concerns every user: finite, rigid, probabilities."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float32, Int

from torc_networks.fields import Fields

_MOST_MASKS = 1000
_MOST_TEXT = 500


@dataclass(frozen=True)
class Masks:
    """Objects in a picture; the masks may have another size than the picture that was sent.

    Attributes:
        masks: one per object; they may overlap.
        scores: how surely each is one object, 0 to 1.
    """

    masks: Bool[np.ndarray, "n h w"]
    scores: Float32[np.ndarray, "n"]


@dataclass(frozen=True)
class Grasps:
    """Gripper poses, in the network's own gripper frame.

    Attributes:
        Ts: rigid; in the frame of the points that were sent.
        confidences: 0 to 1.
        widths_m: distance between the pads on the object; NaN if the server does not say.
        object_ids: owner of each grasp; None if the points were of one object.
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
    """Read masks (n, h, w; booleans, or 0 and 1) or labels (h, w; a mask's number, negative for none), and scores."""
    if answer.has("masks") == answer.has("labels"):
        raise answer.refuse("it must hold either 'masks' or 'labels'.")
    count = len(answer.array("scores", (None,), "iuf"))
    if count > _MOST_MASKS:
        raise answer.refuse(f"it holds {count} masks; {_MOST_MASKS} are the most.")
    scores = answer.probabilities("scores", count).astype(np.float32)
    if answer.has("masks"):
        given = answer.array("masks", (count, None, None), "biu")
        masks = given.astype(np.bool_)
        if (given != masks).any():
            raise answer.refuse("'masks' must be truth values, or 0 and 1.")
        return Masks(masks, scores)
    labels = answer.array("labels", (None, None), "iu")
    if (labels >= count).any():
        raise answer.refuse(f"'labels' go up to {labels.max()}, and there are {count} scores.")
    return Masks(labels == np.arange(count)[:, None, None], scores)


def read_disparity(
    answer: Fields,
) -> tuple[Float32[np.ndarray, "h w"], Float32[np.ndarray, "h w"] | None]:
    """Read the disparity of the left picture, and its confidence (0 to 1; None if the server has none).

    The disparity is in pixels of its own size, which may differ from the pictures'; 0 or not finite means none.
    """
    disparity, confidence = answer.array("disparity", (None, None), "f"), None
    if disparity.size == 0:
        raise answer.refuse("'disparity' is empty.")
    with np.errstate(over="ignore"):  # what is too large for float32 is infinite
        if answer.has("confidence"):
            confidence = answer.array("confidence", disparity.shape, "f").astype(np.float32)
        return disparity.astype(np.float32), confidence


def read_grasps(answer: Fields, of_scene: bool = False) -> Grasps:
    """Read grasps (n, 4, 4), confidences, widths if the server knows them; for a scene also object_ids."""
    Ts = answer.poses("grasps")
    n = len(Ts)
    if n == 0:
        none = np.zeros(0)
        return Grasps(Ts, none, none, np.zeros(0, np.int64) if of_scene else None)
    confidences, widths = answer.probabilities("confidences", n), np.full(n, np.nan)
    if answer.has("widths"):
        widths = answer.array("widths", (n,), "f").astype(np.float64)
        if (widths < 0).any() or np.isinf(widths).any():
            raise answer.refuse("'widths' must be metres, or NaN where they are not known.")
    ids = answer.array("object_ids", (n,), "iu").astype(np.int64) if of_scene else None
    return Grasps(Ts, confidences, widths, ids)


def read_motion(answer: Fields, dof: int) -> Motion | str:
    """Read times (t) and positions (t, dof), or the reason why there is no motion."""
    if answer.has("failure"):
        return str(answer.values["failure"])[:_MOST_TEXT]
    times = answer.finite("times", (None,))
    if len(times) < 2 or times[0] != 0 or (np.diff(times) <= 0).any():
        raise answer.refuse("'times' must begin with 0 and rise.")
    return Motion(times, answer.finite("positions", (len(times), dof)))
