"""The protocols of perceptions and depths, and their input."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import UInt8

from torc.errors import InputError
from torc.records import Observation, SegmentedScene
from torc.registry.kinds import DepthTraits

Picture = UInt8[np.ndarray, "h w c"]


@dataclass(frozen=True)
class Wanted:
    """The target as its user describes it.

    Attributes:
        description: in words, e.g. "the blue tuna can".
        pictures: reference pictures, RGB, or RGBA with the target where the fourth channel is not 0; uint8.
        mark: in the first snapshot, a pixel of the target (column, row), or a box around it (left, top, right, bottom).
        size_m: its length, corner to corner, and the width of the narrowest tube it passes through, metres; a ruler is
            accurate enough. None if unknown.
    """

    description: str
    pictures: tuple[Picture, ...] = ()
    mark: tuple[int, ...] = ()
    size_m: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if self.size_m is not None and not 0.001 <= self.size_m[1] <= self.size_m[0] <= 2.0:
            raise InputError(
                f"The target's size is {self.size_m[0]:g} by {self.size_m[1]:g} m; it is its length, and the width of "
                "the narrowest tube that it goes through, in metres, up to 2."
            )
        if len(self.mark) not in (0, 2, 4):
            raise InputError(f"A mark is x,y or a box x,y,x,y in pixels, not {self.mark}.")
        if len(self.mark) == 4 and not (self.mark[0] < self.mark[2] and self.mark[1] < self.mark[3]):
            raise InputError(f"The box {self.mark} has no area: give left, top, right, bottom, in pixels.")


@runtime_checkable
class Perception(Protocol):
    """Finds the objects of a snapshot.

    A class declares what it needs by `torc.registry.kinds.PerceptionTraits`. With `needs_labels`, `perceive` has a
    further keyword argument `label_image`: the true object id per pixel.

    It may also have a method `recognise(observation, mask, wanted, scene, object_id) -> float | None`: the probability
    that the gripper holds the target, from a snapshot after the lift and the pixels (h, w) of the held object, maybe
    none; `object_id` is its id in the latest `scene`. None if it cannot say: the belief before the lift then stays.
    """

    def perceive(
        self, observation: Observation, wanted: Wanted, before: SegmentedScene | None
    ) -> SegmentedScene:
        """Return the visible objects with their clouds.

        An object keeps its id from snapshot to snapshot. Ids are 1 to 63; 0 may only be the target's.

        Args:
            observation: the snapshot.
            wanted: the target.
            before: the scene of the previous snapshot; None for the first one of an episode.
        """
        ...


@runtime_checkable
class Depth(Protocol):
    """Makes the depth image that the later stages read: unchanged, mended, or from two pictures.

    A class declares what it needs by `torc.registry.kinds.DepthTraits`.
    """

    def measure(self, observation: Observation) -> Observation:
        """Return the observation with its depth in metres along the optical axis, 0 or NaN for no reading."""
        ...


class AsMeasured(DepthTraits):
    """Leaves the camera's depth unchanged."""

    def measure(self, observation: Observation) -> Observation:
        """Return the observation unchanged."""
        return observation
