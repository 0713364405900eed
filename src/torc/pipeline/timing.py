"""Wall time by stage. Times are reported, never decided on: results must not depend on how fast a machine is."""

import time
from collections.abc import Iterator
from contextlib import contextmanager


class StageClock:
    """Adds up the wall seconds spent in named stages.

    >>> clock = StageClock()
    >>> with clock.stage("perceive"):
    ...     pass
    >>> list(clock.seconds)
    ['perceive']
    """

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Count the time of the block, also when it raises."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start
