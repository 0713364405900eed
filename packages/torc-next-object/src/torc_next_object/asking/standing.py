"""A model beside the baselines: scores of its replies, as a table and as data."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from torc.vlm.prices import Prices
from torc_next_object.asking.recorded_replies import RecordedReply, replies_digest
from torc_next_object.replies import read_number
from torc_next_object.scoring import score_answers, score_baselines

FORMAT = "torc-next-object-scores/1"
_GROUPS = (("hard", "difficulty", "hard"), ("hidden", "target", "hidden"), ("visible", "target", "visible"))
Row = Mapping[str, Any]


def standing(
    rows: Sequence[Row], replies: Mapping[str, RecordedReply], prices: Prices | None
) -> dict[str, Any]:
    """Scores of the rows with a reply, of the baselines on the same rows, and what the replies took. Raises ValueError
    where there are none.
    """
    answered = [row for row in rows if str(row["id"]) in replies]
    some = [replies[str(row["id"])] for row in answered]
    numbers = [read_number(reply.text, list(row["numbers"])) for row, reply in zip(answered, some)]
    return {
        "rows": len(rows),
        "answered": len(answered),
        "not_answered": len(rows) - len(answered),
        "replies_sha256": replies_digest({reply.id: reply for reply in some}),
        "model_versions": sorted({reply.model_version for reply in some if reply.model_version}),
        "finishes": dict(sorted(Counter(reply.finish for reply in some).items())),
        "use": _use(some, prices),
        "scores": score_answers(zip(answered, numbers)).to_dict(),
        "baselines": score_baselines(answered),
    }


def standing_table(model: str, found: Mapping[str, Any]) -> list[list[str]]:
    """Rows of text: a heading, the model, then the baselines."""
    heading = ["", "regret", "95 %", "best choice", "invalid", *(f"regret, {name}" for name, _, _ in _GROUPS)]
    lines = [_line(model, found["scores"])]
    lines += [_line(name, scores) for name, scores in found["baselines"].items()]
    return [heading, *lines]


def _line(name: str, scores: Mapping[str, Any]) -> list[str]:
    parts = [scores["by"].get(kind, {}).get(group, {}).get("regret") for _, kind, group in _GROUPS]
    interval = f"{shown(scores['regret_low'])} to {shown(scores['regret_high'])}"
    shares = [f"{scores[key]:.1%}" for key in ("top1", "invalid")]
    return [name, shown(scores["regret"]), interval, *shares, *map(shown, parts)]


def shown(value: float | None) -> str:
    """A regret, or a dash where there is none."""
    return "-" if value is None else f"{value:.2f}"


def _use(replies: Sequence[RecordedReply], prices: Prices | None) -> dict[str, Any]:
    """Sums; None where a reply does not tell, or nobody told the prices."""
    sent = _sum([reply.sent for reply in replies])
    written = _sum([reply.written for reply in replies])
    known = prices is not None and sent is not None and written is not None
    cost = round(prices.cost(sent, written), 6) if known else None  # type: ignore[union-attr, arg-type]
    currency = None if prices is None else prices.currency
    return {"tokens_sent": sent, "tokens_written": written, "cost": cost, "currency": currency}


def _sum(counts: Sequence[int | None]) -> int | None:
    known = [count for count in counts if count is not None]
    return sum(known) if len(known) == len(counts) else None
