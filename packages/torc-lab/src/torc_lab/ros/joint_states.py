"""Where every joint is, by joint states that several nodes may publish on one topic, each of some joints.

A Motoman driver publishes a message per group there, and a gripper its own. So the newest value of each joint counts,
with its own age, not the newest message.
"""

import threading
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from torc_lab.protocols import LabError
from torc_lab.ros.arrivals import Arrivals


class JointStates:
    """Takes in JointState messages; may be used by several threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        # Each publisher has a clock of its own, and sends the same names every time.
        self._publishers: dict[tuple[str, ...], Arrivals] = {}
        self._newest: dict[str, tuple[float, float]] = {}
        """Position and stamp of each joint."""
        self._unreadable = ""

    def take(self, message: Any, came_s: float) -> None:
        """Take in one message, which came in at `came_s` by `time.monotonic`."""
        with self._lock:
            try:
                names = tuple(map(str, message["name"]))
                arrivals = self._publishers.setdefault(names, Arrivals())
                newest, stamp_s = arrivals.take(message, came_s)
                positions = [float(v) for v in newest["position"]]
            except (KeyError, TypeError, ValueError) as error:
                self._unreadable = str(error) or type(error).__name__
                return
            # Some publish velocities or efforts alone, without positions.
            for name, position in zip(names, positions):
                if name not in self._newest or stamp_s >= self._newest[name][1]:
                    self._newest[name] = position, stamp_s

    def knows(self, joint_names: Sequence[str]) -> bool:
        """Whether each of these joints has been heard of."""
        with self._lock:
            return all(name in self._newest for name in joint_names)

    def of(self, joint_names: Sequence[str]) -> tuple[Float[np.ndarray, "dof"], float]:
        """Positions of these joints, radians, and when the oldest of them was measured, by `time.monotonic`. Raises
        LabError if one is missing, or is not a number.
        """
        with self._lock:
            missing = [name for name in joint_names if name not in self._newest]
            if missing:
                raise LabError(self._without(missing))
            found = [self._newest[name] for name in joint_names]
        qpos = np.array([position for position, _ in found])
        if not np.isfinite(qpos).all():
            raise LabError("The joint states hold numbers that are not finite.")
        return qpos, min(stamp_s for _, stamp_s in found)

    def all(self) -> Mapping[str, float]:
        """The newest position of every joint that was heard of."""
        with self._lock:
            return {name: position for name, (position, _) in self._newest.items()}

    def _without(self, missing: Sequence[str]) -> str:
        """With the lock held."""
        if not self._newest:
            why = f": {self._unreadable}" if self._unreadable else ""
            return f"No joint states could be read{why}."
        heard = ", ".join(sorted(self._newest))
        return (
            f"The joint states have no {', '.join(map(repr, missing))}; they have {heard}. "
            "Do the names in the lab file fit this robot?"
        )
