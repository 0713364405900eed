"""Compare perception's masks and ids with the simulator's: what each mask shows, and which faults it has."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Int16, Int64

from torc.pipeline.look import Look
from torc.records import MAX_OBJECTS, SegmentedScene

_LEAST_SHARE = 0.25
"""A mask shows no object if no object fills this share of it; a mask with this share of an object is a part of it."""
_MOST_SHARE = 0.5
"""A mask with this share of an object holds it."""
_LEAST_PX = 60
"""An object that shows fewer pixels than this is not missed."""


@dataclass(frozen=True)
class MaskFaults:
    """The faults in the masks of a look, by the simulator's ids.

    Attributes:
        merged: objects that share a mask, most of each.
        split: objects that are in parts.
        missed: objects in sight without a mask that holds enough of them.
    """

    merged: tuple[int, ...] = ()
    split: tuple[int, ...] = ()
    missed: tuple[int, ...] = ()


def true_ids(look: Look) -> dict[int, int]:
    """Return `shown_by` for a look; empty if perception was given the true labels, or they are unknown."""
    return {} if look.truth is None else shown_by(look.context.scene, look.truth)


def shown_by(scene: SegmentedScene, truth: Int16[np.ndarray, "h w"]) -> dict[int, int]:
    """Return which true object fills most of each object's mask, by perception's id; -1 for nothing with an id."""
    shared, sizes = (
        _shared(scene, truth),
        np.bincount(scene.label_image[scene.label_image >= 0].astype(np.int64)),
    )
    return {
        k: int(np.argmax(shared[k])) if shared[k].max() >= _LEAST_SHARE * sizes[k] else -1 for k in scene.ids
    }


def mask_faults(look: Look) -> MaskFaults | None:
    """Return the faults in the masks of a look; None where `true_ids` is empty."""
    truth = look.truth
    if truth is None:
        return None
    shared = _shared(look.context.scene, truth)
    sizes = np.bincount(truth[truth >= 0].astype(np.int64), minlength=MAX_OBJECTS)
    there = np.flatnonzero(sizes >= _LEAST_PX)
    share = shared[:, there] / sizes[there]
    held = share >= _MOST_SHARE
    merged = held[held.sum(axis=1) >= 2].any(axis=0)
    parts = (share >= _LEAST_SHARE).sum(axis=0)
    return MaskFaults(
        *(tuple(there[chosen].tolist()) for chosen in (merged, parts >= 2, share.max(axis=0) < _LEAST_SHARE))
    )


def _shared(scene: SegmentedScene, truth: Int16[np.ndarray, "h w"]) -> Int64[np.ndarray, "ids ids"]:
    """Return how many pixels each mask (rows, perception's id) has of each object (columns)."""
    both = (scene.label_image >= 0) & (truth >= 0)
    cells = scene.label_image[both].astype(np.int64) * MAX_OBJECTS + truth[both]
    return np.bincount(cells, minlength=MAX_OBJECTS**2).reshape(MAX_OBJECTS, MAX_OBJECTS)
