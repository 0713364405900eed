"""What a model took in a trial: calls, tokens, and what they cost if the user told prices."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from torc.records import Decision
from torc.vlm.prices import Prices

COUNTS = {"tokens_sent": "prompt", "tokens_written": "reply", "tokens_thinking": "thinking"}
"""Name in result.json -> name in the log."""


@dataclass
class VlmUse:
    """Sums over decisions. Replies from a cache count as they did when they were recorded; requests that brought no
    reply are not counted, since no server tells what they took.
    """

    tries: list[Mapping[str, Any]] = field(default_factory=list)

    def add(self, decision: Decision) -> None:
        """Count what a decision's evidence tells; planners of somebody's may leave anything there."""
        told = decision.evidence.get("vlm")
        tries = told.get("tries") if isinstance(told, Mapping) else None
        self.tries += [t for t in tries if isinstance(t, Mapping)] if isinstance(tries, list | tuple) else []

    def facts(self, prices: Prices | None) -> dict[str, Any]:
        """For result.json. A sum is None unless every call told its part of it; `cost` also without prices."""
        facts: dict[str, Any] = {"calls": len(self.tries)}
        facts |= {name: self._sum(of) for name, of in COUNTS.items()}
        sent, written = facts["tokens_sent"], facts["tokens_written"]
        known = prices is not None and sent is not None and written is not None
        cost = prices.cost(sent, written) if prices is not None and known else None
        return facts | {"cost": cost, "currency": prices.currency if prices is not None else ""}

    def _sum(self, name: str) -> int | None:
        counts = [t["tokens"].get(name) if isinstance(t.get("tokens"), Mapping) else None for t in self.tries]
        whole = [n for n in counts if isinstance(n, int) and not isinstance(n, bool)]
        return sum(whole) if len(whole) == len(counts) else None
