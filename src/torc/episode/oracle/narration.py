"""Progress of a search in words."""

from collections.abc import Callable
from typing import Any

from torc.episode.oracle.found import Found

_EVERY = 4.0


class Narration:
    """Says a line when the answer gets better or the bound tighter, and now and then in between."""

    def __init__(self, say: Callable[[str], None], budget: float) -> None:
        self._say, self._budget = say, budget
        self._last: tuple[Any, ...] = ()
        self._next = 0.0
        say(f"oracle: trying out orders of picks in a simulation of its own (budget {budget:g} picks)")

    def __call__(self, found: Found[Any]) -> None:
        """Take the answer so far."""
        news = (found.best and found.best.cost, found.bound)
        if news == self._last and found.spent.total < self._next:
            return
        self._last, self._next = news, found.spent.total + _EVERY
        if found.best is None:
            best = "none found yet"
        else:
            best = f"best {found.best.cost.picks} picks with {found.best.cost.drops} dropped"
        bound = "none possible" if found.bound is None else f"at least {found.bound.picks} needed"
        self._say(f"oracle: {best}, {bound} ({found.spent.total:.3g} of {self._budget:g} spent)")
