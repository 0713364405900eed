"""Sum what a model used in a trial: calls, tokens, and their cost if prices are known."""

from collections.abc import Sequence

from torc.records.evidence import ModelTry
from torc.trials.log import VlmUse
from torc.vlm.prices import Prices


def vlm_use(tries: Sequence[ModelTry], prices: Prices | None) -> VlmUse:
    """Sum up the requests of a trial.

    Replies from a cache count as they did when they were recorded. Requests without a reply are not counted, since no
    server says what they used.
    """
    sent, written, thinking = (
        _sum([getattr(t.tokens, name) for t in tries]) for name in ("prompt", "reply", "thinking")
    )
    cost = None
    if prices is not None and sent is not None and written is not None:
        cost = prices.cost(sent, written)
    return VlmUse(
        calls=len(tries),
        tokens_sent=sent,
        tokens_written=written,
        tokens_thinking=thinking,
        cost=cost,
        currency=prices.currency if prices is not None else "",
    )


def _sum(counts: list[int | None]) -> int | None:
    known = [n for n in counts if n is not None]
    return sum(known) if len(known) == len(counts) else None
