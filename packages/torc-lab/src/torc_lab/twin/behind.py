"""What moves behind the twins' wires."""

from typing import Protocol

import numpy as np

from torc_lab.robotiq.registers import Object

HALFWAY_RAD = 0.2
"""An arm with less than this before it may still arrive when it is told to stop: it lags behind what it was told."""


class ArmBehind(Protocol):
    """What moves: it is told points of a trajectory in time to be there."""

    @property
    def qpos(self) -> np.ndarray:
        """Where it is."""

    def goal(self, qpos: np.ndarray) -> None:
        """Where it has to be now."""

    @property
    def contact_n(self) -> float:
        """Force at its hardest contact, but for what it holds, newtons."""


class Fingers(Protocol):
    """What moves. Positions are 0 (open) to 255 (closed)."""

    def go(self, position: int, speed: int, force: int) -> None:
        """Starts towards a position."""

    def now(self) -> tuple[int, Object]:
        """Where they are, and whether something stopped them."""
