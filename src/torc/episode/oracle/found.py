"""Sequences of picks, what they cost, and what a search has found so far."""

from dataclasses import dataclass
from typing import Generic

from torc.episode.oracle.budget import LOOK_COST
from torc.episode.oracle.space import Choice, State


@dataclass(frozen=True, order=True)
class Cost:
    """Of a sequence, or a lower bound of it: picks first, then drops."""

    picks: int
    drops: int


NOTHING = Cost(0, 0)


@dataclass(frozen=True)
class Spent:
    """What a search has used: picks tried, and looks, rough ones included."""

    picks: int = 0
    looks: int = 0

    @property
    def total(self) -> float:
        """In picks."""
        return self.picks + LOOK_COST * self.looks


@dataclass(frozen=True)
class Path(Generic[State]):
    """A sequence of picks from the start.

    Attributes:
        choices: what is picked.
        states: before each pick, and at the end.
        notes: what a look at each of them told, in words; "" where nobody looked.
        cost: picks and drops.
    """

    choices: tuple[Choice, ...]
    states: tuple[State, ...]
    notes: tuple[str, ...]
    cost: Cost


@dataclass(frozen=True)
class Found(Generic[State]):
    """The answer so far.

    Attributes:
        best: the best sequence that ends with the target, None if none was found.
        bound: no sequence costs less; None if it is proved that none that counts ends with the
            target.
        rough_bound: picks that are needed at least if picks moved nothing else, as far as that was found out: near the
            truth, but no proof.
        outlook: the most promising sequence that does not end with the target: what to do where there is no best.
        spent: what it took.
        limit: picks that a sequence may have, where there is no best and longer ones were not tried for that reason.
        likely: every sequence that would be better than the best if picks moved nothing else was tried, and was not.
    """

    best: Path[State] | None
    bound: Cost | None
    rough_bound: int
    outlook: Path[State]
    spent: Spent
    limit: int | None = None
    likely: bool = False

    @property
    def proved(self) -> bool:
        """Nothing is left to find out: `best` is the best there is, or there is none."""
        return self.bound is None or (self.best is not None and self.best.cost <= self.bound)
