"""What moves behind the twins' wires."""

from typing import Protocol

import numpy as np

from torc.lab.robotiq.registers import Object

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


class Miswired:
    """An arm whose joints do something else than they are commanded: `turns @ q` instead of q, from where it is now."""

    def __init__(self, arm: ArmBehind, turns: np.ndarray) -> None:
        """turns: e.g. diag(1, -1, 1, ...) for a second joint that turns the wrong way."""
        self._arm, self._turns, self._start = arm, turns, arm.qpos.copy()

    @property
    def qpos(self) -> np.ndarray:
        """Where it really is."""
        return self._arm.qpos

    def goal(self, qpos: np.ndarray) -> None:
        """Where it is told to be."""
        self._arm.goal(self._start + self._turns @ (qpos - self._start))

    @property
    def contact_n(self) -> float:
        """The arm's own."""
        return self._arm.contact_n
