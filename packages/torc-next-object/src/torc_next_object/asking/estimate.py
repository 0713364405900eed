"""What an evaluation will take, before it begins: a guess, or the mean of the replies that are there."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from io import BytesIO
from typing import Any

from PIL import Image

from torc.vlm.prices import Prices
from torc_next_object.asking.recorded_replies import RecordedReply
from torc_next_object.prompting import prompt_text, sent_pictures

CHARACTERS_PER_TOKEN = 4
PIXELS_PER_TOKEN = 750
"""Models count pictures differently; most are near this."""
WRITTEN_TOKENS = 300
"""A few sentences. Thinking comes on top of it, and may be many times as much."""


@dataclass(frozen=True)
class Estimate:
    """Tokens of all questions that are still to be asked.

    Attributes:
        measured: whether it is from replies to other questions; else it is guessed from texts and sizes of pictures.
    """

    questions: int
    sent: int
    written: int
    measured: bool

    def words(self, prices: Prices | None) -> str:
        """A line for the user."""
        basis = "as the replies so far" if self.measured else "guessed, without thinking"
        told = f"{self.questions} questions, about {self.sent:,} tokens sent and {self.written:,} written ({basis})"
        if prices is None:
            return f"{told}. Their cost: unknown, give --vlm-prices SENT,WRITTEN."
        cost = prices.cost(self.sent, self.written)
        return f"{told}. Their cost: about {cost:.2f} {prices.currency}."


def estimate(
    rows: Iterable[Mapping[str, Any]],
    variant: str,
    known: Iterable[RecordedReply],
    most_written: int | None = None,
) -> Estimate:
    """For these questions, given the replies that are known; `most_written` bounds a reply."""
    asked = list(rows)
    told = [(r.sent, r.written) for r in known if r.sent is not None and r.written is not None]
    if told:
        sent, written = (sum(column) / len(told) * len(asked) for column in zip(*told))
        return Estimate(len(asked), round(sent), round(written), True)
    guessed = sum(_tokens(row, variant) for row in asked)
    each = min(WRITTEN_TOKENS, most_written or WRITTEN_TOKENS)
    return Estimate(len(asked), guessed, each * len(asked), False)


def _tokens(row: Mapping[str, Any], variant: str) -> int:
    pictures = sum(_pixels(picture) for picture in sent_pictures(row)) // PIXELS_PER_TOKEN
    return pictures + len(prompt_text(row, variant)) // CHARACTERS_PER_TOKEN


def _pixels(picture: bytes) -> int:
    """From the file's header; 0 of what is no picture."""
    try:
        with Image.open(BytesIO(picture)) as opened:
            return int(opened.width * opened.height)
    except OSError:
        return 0
