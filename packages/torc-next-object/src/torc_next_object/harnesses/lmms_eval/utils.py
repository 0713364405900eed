"""Functions that the tasks of lmms-eval call. Nothing of lmms-eval is imported; torc must be importable, without its
other dependencies: pip install --no-deps torc-retrieval.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from torc_next_object.prompting import prompt_text, sent_pictures
from torc_next_object.replies import read_number
from torc_next_object.scoring import COLUMNS, score_answers

METRICS = ("regret", "regret_low", "regret_high", "top1", "lost", "invalid")
Doc = Mapping[str, Any]


def _question(variant: str) -> Callable[..., str]:
    def question(doc: Doc, *_: Any, **__: Any) -> str:
        return prompt_text(doc, variant)

    return question


def _measure(name: str) -> Callable[[Sequence[Doc]], float | None]:
    def measure(found: Sequence[Doc]) -> float | None:
        value: float | None = score_answers((one["row"], one["number"]) for one in found).to_dict()[name]
        return value

    return measure


image_text, grasps_text, relations_text = map(_question, ("image", "grasps", "relations"))
regret, regret_low, regret_high, top1, lost, invalid = map(_measure, METRICS)


def visuals(doc: Doc, *_: Any, **__: Any) -> list[Any]:
    """Return the marked picture, and those of the target, as PIL images."""
    return [picture.convert("RGB") for picture in sent_pictures(doc)]


def target(doc: Doc) -> str:
    """Return the best choices, for people who read logs."""
    return ", ".join(str(int(number)) for number in doc["best"])


def results(doc: Doc, replies: Sequence[str]) -> dict[str, Any]:
    """Return what each measure is computed from."""
    row = {name: doc[name] for name in COLUMNS}
    number = read_number(replies[0], [int(n) for n in doc["numbers"]])
    return {name: {"row": row, "number": number} for name in METRICS}
