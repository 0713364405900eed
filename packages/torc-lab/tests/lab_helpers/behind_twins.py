"""An arm and fingers for the laboratory's twins, without physics."""

import time

import numpy as np

from torc_lab.robotiq.registers import Object
from torc_lab.twin.base import ArmBehind


class ObedientArm:
    """An arm that is at once where it is told to be."""

    def __init__(self, qpos: np.ndarray) -> None:
        self.qpos = np.array(qpos, dtype=float)
        self.contact_n = 0.0

    def goal(self, qpos: np.ndarray) -> None:
        """There."""
        self.qpos = qpos


class TimedFingers:
    """Fingers that travel evenly, with or without something between them.

    Attributes:
        object_at: position at which they touch what is between them; None for nothing.
    """

    def __init__(self, travel_s: float = 0.2, ends: tuple[int, int] = (3, 230)) -> None:
        self.travel_s, self.ends = travel_s, ends
        self.object_at: int | None = None
        self._from = self._to = float(ends[0])
        self._began = time.monotonic()

    def go(self, position: int, speed: int, force: int) -> None:
        """Starts towards a position."""
        self._from, self._began = self.now()[0], time.monotonic()
        self._to = float(min(max(position, self.ends[0]), self.ends[1]))

    def now(self) -> tuple[int, Object]:
        """Where they are."""
        gone = (time.monotonic() - self._began) / self.travel_s * (self.ends[1] - self.ends[0])
        distance = self._to - self._from
        closing, arrived = distance > 0, gone >= abs(distance)
        at = self._to if arrived else self._from + (gone if closing else -gone)
        if self.object_at is not None and self._to > self.object_at and at >= self.object_at:
            return self.object_at, Object.STOPPED_CLOSING
        return round(at), Object.AT_POSITION if arrived else Object.MOVING


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
