"""The base of connections.

The first fault loses a connection for good: nothing is sent after a reconnection, and no late answer is mistaken for
another.
"""

import threading
from collections.abc import Callable
from typing import Any, ClassVar

from torc_lab.protocols import LabError


class Link:
    """A connection that several threads use.

    Attributes:
        name: for messages.
        lost: why it cannot be used any more; "" while it can.
    """

    fault: ClassVar[type[LabError]] = LabError
    """Error to raise once the connection is lost."""

    def __init__(self, name: str) -> None:
        self.name, self.lost = name, ""
        self._news = threading.Condition()
        """Guards everything that a reader takes in; notified of each message, and of the loss."""

    def _check(self) -> None:
        """Raise `fault`, a LabError, if the connection is lost."""
        if self.lost:
            raise self.fault(f"{self.name} is lost: {self.lost}.")

    def _lose(self, why: object) -> LabError:
        """Mark the connection as lost and return the error to raise. The first reason counts."""
        with self._news:
            self.lost = self.lost or str(why) or type(why).__name__
            self._news.notify_all()
        return self.fault(f"{self.name} is lost: {self.lost}.")

    def _await(self, there: Callable[[], Any], seconds: float) -> bool:
        """Wait until `there` holds or the connection is lost; return whether it holds."""
        with self._news:
            self._news.wait_for(lambda: there() or self.lost, seconds)
            return bool(there())
