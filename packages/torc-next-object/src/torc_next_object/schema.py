"""One row of the data set: one decision, what may be chosen, and what each choice is worth."""

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, asdict, dataclass, fields
from typing import Any

NAME = "torc-next-object"
FORMAT = "torc-next-object/1"
SOURCES = ("torc40", "hard", "generated")
CATEGORIES = ("structured", "unstructured")
MOST_CHOICES = 35
"""Harnesses that turn choices into letters misread more."""
TARGET_NUMBER = 0
"""The target's mark, as in the prompts of torc's planners; nothing carries it while the target is out of sight."""
BEST_WITHIN = 0.05
"""Choices whose value is this near the best one's, in picks, are as good."""
_ROUNDING = 1e-6
_JPEG = b"\xff\xd8\xff"


@dataclass(frozen=True)
class NextObjectRow:
    """One decision.

    Attributes:
        id: a hash; it tells nothing of order or answer.
        split: "train", "test" or "hidden".
        scene: a hash that all decisions of one problem share: resample these, not rows.
        source, category: where the problem comes from, and whether its objects stand in order or lie in a pile.
        picks_taken: objects that are gone already.
        target_hidden: whether the target is out of sight.
        description: the target, in words.
        image, image_plain: the picture with outlines and numbers, and the same without, JPEG.
        references: pictures of the target alone, JPEG; may be empty.
        numbers: the marks in sight, rising: the choices. TARGET_NUMBER is the target's; the others are drawn anew for
            every decision and mean nothing.
        graspable: per number, whether the robot has a grasp for it.
        facts: what is graspable and what blocks what, as torc's VLM+GRASPS is told.
        relations: JSON, a list of {"source", "relation", "target"}: who seems to stand behind whom, by depth alone.
        relations_true: per relation, whether it is so.
        values: per number, the picks to be expected until the target is brought, if this is picked now.
        values_low, values_high: how sure that is; see `torc_next_object.making.valuing`.
        best: the numbers whose value is within BEST_WITHIN of the least.
        random_value: what is to be expected of one drawn from the graspable.
        baselines: JSON, what each baseline chooses, {name: number or null}.
        questions: version of pictures, facts and prompt; 1 where a file does not say.
        gripper, target_size: sentences of the second questions: how the gripper reaches in, and the target's size.
    """

    id: str
    split: str
    scene: str
    source: str
    category: str
    picks_taken: int
    target_hidden: bool
    description: str
    image: bytes
    image_plain: bytes
    references: tuple[bytes, ...]
    numbers: tuple[int, ...]
    graspable: tuple[bool, ...]
    facts: str
    relations: str
    relations_true: tuple[bool, ...]
    values: tuple[float, ...]
    values_low: tuple[float, ...]
    values_high: tuple[float, ...]
    best: tuple[int, ...]
    random_value: float
    baselines: str
    questions: int = 1
    gripper: str = ""
    target_size: str = ""

    @property
    def best_value(self) -> float:
        """The least value of all choices."""
        return min(self.values)

    def value_of(self, number: int) -> float:
        """A choice's value. Raises ValueError for a number that is no choice."""
        return self.values[self.numbers.index(number)]

    def to_dict(self) -> dict[str, Any]:
        """As plain data, with lists; pictures are bytes."""
        return {k: list(v) if isinstance(v, tuple) else v for k, v in asdict(self).items()}

    def facts_only(self) -> dict[str, Any]:
        """As data of JSON: all but the pictures."""
        return {k: v for k, v in self.to_dict().items() if k not in PICTURES}


PICTURES = ("image", "image_plain", "references")
COLUMNS = tuple(f.name for f in fields(NextObjectRow) if f.default is MISSING)
"""Those that every file has; the others are younger than some files."""


def _value(kind: str) -> dict[str, str]:
    return {"dtype": kind, "_type": "Value"}


def _list(of: dict[str, str]) -> dict[str, Any]:
    return {"feature": of, "_type": "List"}


FEATURES: Mapping[str, Mapping[str, Any]] = {
    "id": _value("string"),
    "split": _value("string"),
    "scene": _value("string"),
    "source": _value("string"),
    "category": _value("string"),
    "picks_taken": _value("int32"),
    "target_hidden": _value("bool"),
    "description": _value("string"),
    "image": {"_type": "Image"},
    "image_plain": {"_type": "Image"},
    "references": _list({"_type": "Image"}),
    "numbers": _list(_value("int32")),
    "graspable": _list(_value("bool")),
    "facts": _value("string"),
    "relations": _value("string"),
    "relations_true": _list(_value("bool")),
    "values": _list(_value("float64")),
    "values_low": _list(_value("float64")),
    "values_high": _list(_value("float64")),
    "best": _list(_value("int32")),
    "random_value": _value("float64"),
    "baselines": _value("string"),
    "questions": _value("int32"),
    "gripper": _value("string"),
    "target_size": _value("string"),
}
"""The columns' types, as the library `datasets` writes them."""


def row_from(data: Mapping[str, Any]) -> NextObjectRow:
    """A row from plain data: of `to_dict`, or a line of a Parquet file, whose pictures are {"bytes", "path"}. Raises
    ValueError for a column that is missing.
    """
    missing = [name for name in COLUMNS if name not in data]
    if missing:
        raise ValueError(f"A row of {NAME} has no {', '.join(missing)}.")
    plain = {f.name: _plain(data[f.name]) for f in fields(NextObjectRow) if f.name in data}
    return NextObjectRow(**plain)


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping) and "bytes" in value:
        return value["bytes"]
    return tuple(map(_plain, value)) if isinstance(value, list | tuple) else value


def best_numbers(numbers: tuple[int, ...], values: tuple[float, ...]) -> tuple[int, ...]:
    """The numbers whose value is within BEST_WITHIN of the least."""
    least = min(values)
    return tuple(n for n, v in zip(numbers, values, strict=True) if v <= least + BEST_WITHIN + _ROUNDING)


def random_value(graspable: tuple[bool, ...], values: tuple[float, ...]) -> float:
    """The mean value of what is graspable; of all where nothing is."""
    counted = [v for g, v in zip(graspable, values, strict=True) if g] or list(values)
    return sum(counted) / len(counted)


def row_faults(row: NextObjectRow) -> Iterator[str]:
    """Why a row is none that may be published."""
    n = len(row.numbers)
    per_number = ("graspable", "values", "values_low", "values_high")
    if not 1 <= n <= MOST_CHOICES:
        yield f"it has {n} choices; 1 to {MOST_CHOICES} are allowed"
    if tuple(sorted(set(row.numbers))) != row.numbers or min(row.numbers, default=0) < 0:
        yield "numbers are not rising"
    if any(len(getattr(row, name)) != n for name in per_number):
        yield f"{', '.join(per_number)} must have one entry per number"
        return
    if n == 0:
        return
    if row.target_hidden == (TARGET_NUMBER in row.numbers):
        yield "target_hidden does not agree with the numbers"
    if not all(math.isfinite(v) and v >= 0 for v in (*row.values, row.random_value)):
        yield "a value is no number of picks"
    elif row.best != best_numbers(row.numbers, row.values):
        yield "best are not the numbers with the least values"
    elif abs(row.random_value - random_value(row.graspable, row.values)) > BEST_WITHIN / 10:
        yield "random_value is not the mean of what is graspable"
    if not all(a <= v <= b for a, v, b in zip(row.values_low, row.values, row.values_high, strict=True)):
        yield "a value lies outside its own interval"
    if row.source not in SOURCES or row.category not in CATEGORIES:
        yield "source or category is none of those declared"
    if not all(p.startswith(_JPEG) for p in (row.image, row.image_plain, *row.references)):
        yield "a picture is no JPEG"
    yield from _text_faults(row)


def _text_faults(row: NextObjectRow) -> Iterator[str]:
    try:
        relations, chosen = json.loads(row.relations), json.loads(row.baselines)
    except ValueError:
        yield "relations or baselines are not JSON"
        return
    if len(relations) != len(row.relations_true):
        yield "relations_true must have one entry per relation"
    if any(r["source"] not in row.numbers or r["target"] not in row.numbers for r in relations):
        yield "a relation names what is not in sight"
    if any(k is not None and k not in row.numbers for k in chosen.values()):
        yield "a baseline chooses what is not in sight"
