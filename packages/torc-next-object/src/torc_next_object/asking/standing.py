"""Score a model's replies beside the baselines."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from torc.vlm.prices import Prices
from torc_next_object.asking.evaluation import RecordedReply, replies_digest
from torc_next_object.replies import read_number
from torc_next_object.scoring import score_answers, score_baselines

FORMAT = "torc-next-object-scores/1"
Row = Mapping[str, Any]


def standing(
    rows: Sequence[Row], replies: Mapping[str, RecordedReply], prices: Prices | None
) -> dict[str, Any]:
    """Return the scores of the rows with a reply, of the baselines on these rows, and the tokens and cost.

    Tokens and cost are None if a reply does not report its tokens. Raises ValueError if there are no replies.
    """
    answered = [row for row in rows if str(row["id"]) in replies]
    some = [replies[str(row["id"])] for row in answered]
    numbers = [read_number(reply.reply, list(row["numbers"])) for row, reply in zip(answered, some)]
    counts = [(reply.sent, reply.written) for reply in some]
    sent, written = (None if None in column else sum(column) for column in zip(*counts))
    cost = None
    if prices is not None and sent is not None and written is not None:
        cost = round(prices.cost(sent, written), 6)
    currency = None if prices is None else prices.currency
    return {
        "rows": len(rows),
        "answered": len(answered),
        "not_answered": len(rows) - len(answered),
        "replies_sha256": replies_digest({reply.id: reply for reply in some}),
        "model_versions": sorted({reply.model_version for reply in some if reply.model_version}),
        "finishes": dict(sorted(Counter(reply.finish for reply in some).items())),
        "use": {"tokens_sent": sent, "tokens_written": written, "cost": cost, "currency": currency},
        "scores": score_answers(zip(answered, numbers)).to_dict(),
        "baselines": score_baselines(answered),
    }
