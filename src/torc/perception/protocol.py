"""What every perception offers."""

from typing import Protocol

from torc.records import Observation, SegmentedScene


class Perception(Protocol):
    """Finds the objects of a snapshot."""

    def perceive(self, observation: Observation) -> SegmentedScene:
        """The visible objects with their clouds; the target has id 0 where it is recognised."""
        ...
