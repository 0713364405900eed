"""A driver of an arm that is nowhere: it goes along its trajectory as time passes, and fails as a test tells it."""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from torc.records import Trajectory
from torc_lab.protocols import ArmStatus, LabError


@dataclass
class FakeArmDriver:
    """Attributes:
    at: after so many seconds of a motion, what happens; told the driver.
    sent: every trajectory that was started.
    stops: how often it was told to stop.
    """

    qpos: np.ndarray
    feels_contact: bool = False
    start_tolerance_rad: float = 0.001
    at: dict[float, Callable[["FakeArmDriver"], None]] = field(default_factory=dict)
    name: str = "the fake arm"
    sent: list[Trajectory] = field(default_factory=list)
    stops: int = 0
    stopped: str = ""
    contact_n: float = 0.0
    silent_since: float | None = None
    lost: str = ""
    early: str | None = None
    offset: np.ndarray | float = 0.0
    frozen: bool = False

    def __post_init__(self) -> None:
        self._began: float | None = None
        self._lock = threading.RLock()

    def status(self) -> ArmStatus:
        with self._lock:
            self._check()
            self._go_on()
            now = time.monotonic() if self.silent_since is None else self.silent_since
            return ArmStatus(
                now, self.qpos + self.offset, self._began is not None, self.stopped, self.contact_n
            )

    def start(self, trajectory: Trajectory) -> None:
        with self._lock:
            self._check()
            self.sent.append(trajectory)
            self._began, self.early = time.monotonic(), None

    def ended(self) -> str | None:
        with self._lock:
            self._check()
            self._go_on()
            if self.early is not None:
                return self.early
            return None if self._began is not None else ""

    def stop(self) -> None:
        with self._lock:
            self.stops += 1
            self._check()
            self._go_on()
            self._began = None

    def close(self) -> None:
        self.lost = "it was closed"

    def _check(self) -> None:
        if self.lost:
            raise LabError(f"{self.name} is lost: {self.lost}.")

    def _go_on(self) -> None:
        if self._began is None:
            return
        elapsed, motion = time.monotonic() - self._began, self.sent[-1]
        for moment in [m for m in self.at if m <= elapsed]:
            self.at.pop(moment)(self)
        self._check()
        if self._began is None:
            return
        if not self.frozen:
            self.qpos = np.array([np.interp(elapsed, motion.times_s, q) for q in motion.qpos.T])
        if elapsed >= motion.duration_s and not self.frozen:
            self._began = None
