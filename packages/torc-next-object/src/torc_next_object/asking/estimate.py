"""Estimate what an evaluation will take, before it begins."""

from collections.abc import Iterable, Mapping, Sequence
from io import BytesIO
from typing import Any

from PIL import Image

from torc.vlm.prices import Prices
from torc_next_object.asking.evaluation import RecordedReply
from torc_next_object.prompting import prompt_text, sent_pictures

CHARACTERS_PER_TOKEN = 4
PIXELS_PER_TOKEN = 750
"""Models count pictures differently; most are near this."""
WRITTEN_TOKENS = 300
"""A few sentences. Thinking comes on top, and may be many times as much."""


def estimate(
    rows: Sequence[Mapping[str, Any]],
    variant: str,
    known: Iterable[RecordedReply],
    most_written: int | None,
    prices: Prices | None,
) -> str:
    """Return a line for the user: tokens and cost of the questions about these rows.

    The tokens are the mean of the known replies, if there are any; else a guess from texts and sizes of pictures.
    `most_written` bounds a reply.
    """
    counts = [(r.sent, r.written) for r in known if r.sent is not None and r.written is not None]
    basis = "as the replies so far" if counts else "guessed, without thinking"
    if counts:
        sent, written = (round(sum(column) / len(counts) * len(rows)) for column in zip(*counts))
    else:
        sent = sum(_tokens(row, variant) for row in rows)
        written = min(WRITTEN_TOKENS, most_written or WRITTEN_TOKENS) * len(rows)
    tokens = f"{len(rows)} questions, about {sent:,} tokens sent and {written:,} written ({basis})"
    if prices is None:
        return f"{tokens}. Their cost: unknown, give --vlm-prices SENT,WRITTEN."
    return f"{tokens}. Their cost: about {prices.cost(sent, written):.2f} {prices.currency}."


def _tokens(row: Mapping[str, Any], variant: str) -> int:
    pictures = sum(_pixels(picture) for picture in sent_pictures(row)) // PIXELS_PER_TOKEN
    return pictures + len(prompt_text(row, variant)) // CHARACTERS_PER_TOKEN


def _pixels(picture: bytes) -> int:
    """Return the number of pixels by the file's header; 0 if it is not a picture."""
    try:
        with Image.open(BytesIO(picture)) as opened:
            return int(opened.width * opened.height)
    except OSError:
        return 0
