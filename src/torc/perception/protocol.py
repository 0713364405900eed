"""What every perception and depth offers, and what is asked of them."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import UInt8

from torc.records import Observation, SegmentedScene


@dataclass(frozen=True)
class Wanted:
    """The target as its user describes it: in words, e.g. "the blue tuna can", and by reference pictures, RGB."""

    description: str
    pictures: tuple[UInt8[np.ndarray, "h w 3"], ...] = ()


@runtime_checkable
class Perception(Protocol):
    """Finds the objects of a snapshot."""

    def perceive(
        self, observation: Observation, wanted: Wanted, before: SegmentedScene | None
    ) -> SegmentedScene:
        """The visible objects with their clouds.

        An object keeps its id from snapshot to snapshot; the target has id 0 where it is recognised.

        Args:
            observation: the snapshot.
            wanted: the target.
            before: what it made of the snapshot before; None for the first one of an episode.
        """
        ...


@runtime_checkable
class Depth(Protocol):
    """Makes the depth image that the later stages read: as it is, mended, or from two pictures.

    A class may have two attributes: `needs_pair`, true if it reads the observation's stereo pair, which a simulated
    camera takes only then; and `rough`, true if its depth has a sensor's errors, for which perception and occlusion
    volume have settings of their own.
    """

    def measure(self, observation: Observation) -> Observation:
        """The observation with its depth in metres along the optical axis, 0 or NaN for no reading."""
        ...


class AsMeasured:
    """Leaves the camera's depth as it is."""

    def measure(self, observation: Observation) -> Observation:
        """The observation itself."""
        return observation
