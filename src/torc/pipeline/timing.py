"""Wall time by stage. Times are reported, never decided on: results must not depend on how fast a machine is."""

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass


@dataclass
class Lap:
    """One pass through a stage; `seconds` is known when it is over."""

    seconds: float = 0.0


class StageClock:
    """Adds up the wall seconds spent in named stages."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str) -> Iterator[Lap]:
        """Count the time of the block, also when it raises."""
        start, lap = time.perf_counter(), Lap()
        try:
            yield lap
        finally:
            lap.seconds = time.perf_counter() - start
            self.add({name: lap.seconds})

    def add(self, seconds: Mapping[str, float]) -> None:
        """Count times that were measured elsewhere."""
        for name, value in seconds.items():
            self.seconds[name] = self.seconds.get(name, 0.0) + value
