"""Perception's view of a snapshot: objects, their points, and its memory."""

from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np
from jaxtyping import Float32, Int16, Int32

from torc.records.camera import TARGET_ID, Observation

_LEAST_P = 1e-3
"""Least probability used in odds."""


@dataclass(frozen=True)
class SegmentedObject:
    """One visible object: its part of the surface point cloud, world frame.

    Attributes:
        id: object id, 0..63; its value in the label image.
        points: surface points, metres.
        normals: unit normals, towards the camera.
        pixels: (row, column) of each point in the image.
        pixel_count: pixels of the object's mask, with or without a depth reading.
        felt: points that a finger touched where no snapshot saw anything; in no image.
    """

    id: int
    points: Float32[np.ndarray, "n 3"]
    normals: Float32[np.ndarray, "n 3"]
    pixels: Int32[np.ndarray, "n 2"]
    pixel_count: int
    felt: Float32[np.ndarray, "k 3"] = field(default_factory=partial(np.zeros, (0, 3), np.float32))


@dataclass(frozen=True)
class KnownObject:
    """Perception's memory of an object, in sight or not.

    Attributes:
        points: some surface points when it was last seen, world frame.
        look: its appearance, a unit vector.
        sureness: probability that it is exactly one object, 0 to 1.
        looks: in how many snapshots it was seen.
        missed: how many have passed since.
        target_p: probability that it is the target, by reference pictures, when it was last seen.
        is_target: it was taken for the target.
    """

    id: int
    points: Float32[np.ndarray, "n 3"]
    look: Float32[np.ndarray, "d"]
    sureness: float
    looks: int = 1
    missed: int = 0
    target_p: float = 0.0
    is_target: bool = False


@dataclass(frozen=True)
class SegmentedScene:
    """Everything that was perceived in one snapshot.

    Attributes:
        observation: the snapshot.
        label_image: object id per pixel; BACKGROUND or ROBOT elsewhere. A task planner is shown only the visible
            objects, here and in the observation; perception itself may leave in what it does not report.
        objects: visible objects, by rising id.
        target_id: id of the target, or None while it is hidden.
        background_points: surface points of no object (table, bin), world frame.
        known: all objects so far, for a perception that keeps ids itself: its memory, for nobody else.
        brought_odds: odds that an unrecognised target was among the delivered objects, against never having been in
            sight; memory like `known`.
    """

    observation: Observation
    label_image: Int16[np.ndarray, "h w"]
    objects: tuple[SegmentedObject, ...]
    target_id: int | None
    background_points: Float32[np.ndarray, "m 3"]
    known: tuple[KnownObject, ...] = ()
    brought_odds: float = 0.0

    @cached_property
    def ids(self) -> tuple[int, ...]:
        """Ids of the visible objects, rising."""
        return tuple(o.id for o in self.objects)

    def object(self, object_id: int) -> SegmentedObject:
        """Return the visible object with that id. Raises KeyError if there is none."""
        for o in self.objects:
            if o.id == object_id:
                return o
        raise KeyError(f"No visible object {object_id}; visible: {self.ids}.")

    @property
    def target_number(self) -> int:
        """The target's id, in sight or not; TARGET_ID until it was seen."""
        if self.target_id is not None:
            return self.target_id
        return next((k.id for k in self.known if k.is_target), TARGET_ID)

    def with_target(self, object_id: int | None) -> "SegmentedScene":
        """Return the scene with that visible object as the target, or with none.

        The memory of a target out of sight is dropped if another object is the target. Raises KeyError if the object is
        not visible.
        """
        if object_id is not None:
            self.object(object_id)
        kept = (k for k in self.known if object_id is None or not k.is_target or k.id in self.ids)
        known = tuple(replace(k, is_target=k.id == object_id) if k.id in self.ids else k for k in kept)
        return replace(self, target_id=object_id, known=known)

    def with_brought(self, object_id: int, p: float) -> "SegmentedScene":
        """Record that this object was delivered and that the in-hand look gave it probability p of being the target.

        Objects that look like it are then less likely to be the target.
        """
        told = {k.id: k.target_p for k in self.known if k.id in self.ids}
        # Odds against "in sight nowhere, and not brought", which has the probability that the others leave.
        others = (
            (1 - told.get(object_id, 0.0)) * (1 + self.brought_odds) / max(1 - sum(told.values()), _LEAST_P)
        )
        return replace(self, brought_odds=self.brought_odds + p / max(1 - p, _LEAST_P) * others)
