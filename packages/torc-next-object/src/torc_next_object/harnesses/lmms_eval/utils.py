"""What the tasks of lmms-eval call. Nothing of lmms-eval is imported; torc must be importable, without its other
dependencies: pip install --no-deps torc-retrieval.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from torc_next_object.prompting import prompt_text, sent_pictures
from torc_next_object.replies import read_number
from torc_next_object.scoring import COLUMNS, score_answers

METRICS = ("regret", "regret_low", "regret_high", "top1", "lost", "invalid")
Doc = Mapping[str, Any]


def image_text(doc: Doc, *_: Any, **__: Any) -> str:
    """The question, by the picture alone."""
    return prompt_text(doc, "image")


def grasps_text(doc: Doc, *_: Any, **__: Any) -> str:
    """The question with what can be grasped."""
    return prompt_text(doc, "grasps")


def relations_text(doc: Doc, *_: Any, **__: Any) -> str:
    """The question with who seems to stand behind whom."""
    return prompt_text(doc, "relations")


def visuals(doc: Doc, *_: Any, **__: Any) -> list[Any]:
    """The marked picture, and those of the target, as PIL images."""
    return [picture.convert("RGB") for picture in sent_pictures(doc)]


def target(doc: Doc) -> str:
    """The best choices, for people who read logs."""
    return ", ".join(str(int(number)) for number in doc["best"])


def results(doc: Doc, replies: Sequence[str]) -> dict[str, Any]:
    """What the measures are made of, once for each of them."""
    row = {name: doc[name] for name in COLUMNS}
    number = read_number(replies[0], [int(n) for n in doc["numbers"]])
    return {name: {"row": row, "number": number} for name in METRICS}


def regret(found: Sequence[Doc]) -> float | None:
    """Picks lost by those of random choices."""
    return _measure(found, "regret")


def regret_low(found: Sequence[Doc]) -> float | None:
    """Lower end of its interval, over problems."""
    return _measure(found, "regret_low")


def regret_high(found: Sequence[Doc]) -> float | None:
    """Upper end of its interval."""
    return _measure(found, "regret_high")


def top1(found: Sequence[Doc]) -> float | None:
    """Share of choices that are among the best."""
    return _measure(found, "top1")


def lost(found: Sequence[Doc]) -> float | None:
    """Picks lost per decision."""
    return _measure(found, "lost")


def invalid(found: Sequence[Doc]) -> float | None:
    """Share of replies without a valid number."""
    return _measure(found, "invalid")


def _measure(found: Sequence[Doc], name: str) -> float | None:
    value: float | None = score_answers((one["row"], one["number"]) for one in found).to_dict()[name]
    return value
