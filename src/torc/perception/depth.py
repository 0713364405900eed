"""Depth as the camera measures it."""

from torc.records import Observation


class AsMeasured:
    """Leaves the camera's depth as it is."""

    def measure(self, observation: Observation) -> Observation:
        """The observation itself."""
        return observation
