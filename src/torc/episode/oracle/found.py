"""Sequences of picks, what they cost, what a search may spend, and what it has found so far."""

from dataclasses import dataclass
from typing import Generic

from torc.episode.oracle.space import Choice, State
from torc.errors import InputError

LOOK_COST = 0.5
"""What a look, real or rough, takes of a budget that is counted in picks: about its share of the computing."""
DEFAULT_BUDGET = 80.0
"""In simulated picks, not seconds, so that the answer is the same on a busy machine. At most some 40 seconds of one
2 GHz core; proves most answers of up to three picks."""


def check_budget(budget: float) -> None:
    """Raises InputError for a budget that is no number or does not allow for a single look."""
    if not LOOK_COST <= budget < float("inf"):
        raise InputError(
            f"The budget is {budget:g}; it must be a number of simulated picks, e.g. {DEFAULT_BUDGET:g}."
        )


@dataclass(frozen=True, order=True)
class Cost:
    """Of a sequence, or a lower bound of it: picks first, then drops."""

    picks: int
    drops: int


@dataclass(frozen=True)
class Spent:
    """Picks tried, and looks, rough ones included."""

    picks: int = 0
    looks: int = 0

    @property
    def total(self) -> float:
        """In picks."""
        return self.picks + LOOK_COST * self.looks


@dataclass(frozen=True)
class Path(Generic[State]):
    """A sequence of picks from the start: choices; states before each pick, and at the end; what a look at each of them
    told, in words ("" where nobody looked); picks and drops.
    """

    choices: tuple[Choice, ...]
    states: tuple[State, ...]
    notes: tuple[str, ...]
    cost: Cost


@dataclass(frozen=True)
class Found(Generic[State]):
    """The answer so far.

    Attributes:
        best: the best sequence that ends with the target, if any.
        bound: no sequence costs less; None if it is proved that none that counts ends with the target.
        rough_bound: picks that are needed at least if picks moved nothing else, as far as known; no proof.
        outlook: the most promising sequence that does not end with the target.
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
        """`best` is the best there is, or there is none."""
        return self.bound is None or (self.best is not None and self.best.cost <= self.bound)
