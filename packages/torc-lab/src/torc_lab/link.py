"""What connections have in common: each is lost for good at its first fault, so that nothing is sent after it was made
again, and no late answer is taken for another one.
"""

import threading
from collections.abc import Callable
from typing import Any, ClassVar

from torc_lab.protocols import LabError


class Link:
    """A connection that several threads use.

    Attributes:
        name: for messages.
        lost: why it is of no use any more; "" while it is.
    """

    fault: ClassVar[type[LabError]] = LabError
    """What is raised once it is lost."""

    def __init__(self, name: str) -> None:
        self.name, self.lost = name, ""
        self._news = threading.Condition()
        """Holds what a reader heard; notified of all of it, and of the loss."""

    def _check(self) -> None:
        """Raises LabError once the connection is lost."""
        if self.lost:
            raise self.fault(f"{self.name} is lost: {self.lost}.")

    def _lose(self, why: object) -> LabError:
        """The error to raise. The first reason counts."""
        with self._news:
            self.lost = self.lost or str(why) or type(why).__name__
            self._news.notify_all()
        return self.fault(f"{self.name} is lost: {self.lost}.")

    def _await(self, there: Callable[[], Any], seconds: float) -> bool:
        """Waits until something is there, or the connection is lost; whether it is there."""
        with self._news:
            self._news.wait_for(lambda: there() or self.lost, seconds)
            return bool(there())
