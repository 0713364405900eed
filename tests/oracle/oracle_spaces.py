"""Small made-up search spaces, and the best sequence in them by trying all."""

import itertools
import zlib
from dataclasses import dataclass

from torc.oracle.tree import Arrival, Choice, Cost, Fate, Options

TARGET = 0
State = tuple[Choice, ...]
"""The picks so far: all that happened follows from them."""


@dataclass
class ToySpace:
    """Objects that lie on each other; picks sometimes fail, drop things, or lose the target.

    Everything is drawn from the seed and the picks so far, so that the same picks have the same outcome. `failing`,
    `dropping` and `losing` are percent; so is `lying`, the share of the peeks that tell nonsense.
    """

    seed: int
    count: int = 5
    failing: int = 20
    dropping: int = 15
    losing: int = 8
    lying: int = 0

    def look(self, state: State) -> Options:
        return self._options(self.gone(state), state)

    def peek(self, state: State, removed: frozenset[int]) -> Options:
        if self._dice("lie", state, tuple(sorted(removed))) < self.lying:
            some = [k for k in range(self.count) if self._dice("some", k, state, tuple(sorted(removed))) < 50]
            return Options(tuple(some), TARGET if TARGET in some else None)
        return self._options(self.gone(state) | removed, state)

    def pick(self, state: State, choice: Choice) -> Arrival[State]:
        after = (*state, choice)
        if choice is None:
            return Arrival(after)
        dropped = int(self._dice("drop", after) < self.dropping)
        if self._dice("lose", after) < self.losing:
            return Arrival(after, dropped, Fate.LOST)
        took = not self._fails(after)
        fate = Fate.SOLVED if took and choice == TARGET else Fate.OPEN
        return Arrival(after, dropped, fate, frozenset({choice}) if took else frozenset())

    def gone(self, state: State) -> frozenset[int]:
        """The objects that were taken away."""
        picks = [(choice, state[: i + 1]) for i, choice in enumerate(state)]
        return frozenset(k for k, so_far in picks if k is not None and not self._fails(so_far))

    def best(self, max_picks: int) -> Cost | None:
        """The least cost, by trying everything."""
        costs = [cost for cost in self._all((), 0, max_picks) if cost is not None]
        return min(costs, default=None)

    def _all(self, state: State, drops: int, max_picks: int):
        if len(state) == max_picks:
            return
        for choice in self._options(self.gone(state), state).choices:
            arrival = self.pick(state, choice)
            if arrival.fate is Fate.SOLVED:
                yield Cost(len(arrival.state), drops + arrival.dropped)
            elif arrival.fate is Fate.OPEN:
                yield from self._all(arrival.state, drops + arrival.dropped, max_picks)

    def _options(self, gone: frozenset[int], state: State) -> Options:
        free = [k for k in range(self.count) if k not in gone and self._on(k) <= gone]
        others = sorted((k for k in free if k != TARGET), key=lambda k: self._dice("order", k, state))
        target = TARGET if TARGET in free else None
        choices = (*([TARGET] if target is not None else []), *others)
        return Options(choices or (None,), target, outlook=len(gone) + 2.0 * (target is not None))

    def _on(self, k: int) -> frozenset[int]:
        """What lies on an object. Only what has a higher number does, so that something is always free."""
        return frozenset(
            j for j in range(k + 1, self.count) if self._dice("on", k, j) < (60 if k == TARGET else 25)
        )

    def _fails(self, picks: State) -> bool:
        return self._dice("fail", picks) < self.failing

    def _dice(self, *what: object) -> int:
        return zlib.crc32(repr((self.seed, what)).encode()) % 100


def toy_spaces(number: int, count: int = 0, **options: int):
    """Many of them, of different sizes where none is given."""
    for seed, some in zip(range(number), itertools.cycle((2, 3, 4, 5))):
        yield ToySpace(seed, count or some, **options)
