"""Which of a robot's joint states is the newest, and how old it is: messages may come late, twice, or out of order.

The robot's clock is not this machine's. What came least late tells how far they are apart.
"""

from typing import Any

_LEAK = 1e-3
"""Clocks run apart, by far less than this; a network that has become slower for good is noticed for so much longer."""


class Arrivals:
    """The newest message by its own time stamp, and when it would have come if it had not been late."""

    def __init__(self) -> None:
        self._message: Any = None
        self._told_s: float | None = None
        self._stamp_s = 0.0
        self._least_s = float("inf")
        self._came_s = 0.0

    def take(self, message: Any, came_s: float) -> tuple[Any, float]:
        """The newest message and its stamp, by this machine's monotonic clock, after one more; the same one may be
        taken again. A message without a time of its own counts as new.
        """
        told_s = stamp_of(message)
        if told_s is None:
            self._message, self._told_s, self._stamp_s = message, None, came_s
        elif self._told_s is None or told_s > self._told_s:
            least = self._least_s + _LEAK * max(0.0, came_s - self._came_s)
            self._least_s, self._came_s = min(least, came_s - told_s), came_s
            self._message, self._told_s, self._stamp_s = message, told_s, told_s + self._least_s
        return self._message, self._stamp_s


def stamp_of(message: Any) -> float | None:
    """The time in a message's header, seconds; None if there is none, or zero."""
    try:
        stamp = message["header"]["stamp"]
        seconds = stamp.get("secs", stamp.get("sec", 0)) + 1e-9 * stamp.get("nsecs", stamp.get("nanosec", 0))
        return float(seconds) or None
    except (TypeError, KeyError, AttributeError, ValueError, OverflowError):
        return None
