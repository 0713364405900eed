"""A row of the data set: one decision, its choices, and the value of each."""

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, asdict, dataclass, fields
from typing import Any, get_args, get_type_hints

from torc_next_object.scoring import BEST_WITHIN

NAME = "torc-next-object"
FORMAT = "torc-next-object/1"
SOURCES = ("torc40", "hard", "generated")
CATEGORIES = ("structured", "unstructured")
MOST_CHOICES = 35
"""Harnesses that turn choices into letters misread more."""
TARGET_NUMBER = 0
"""The target's mark, as in the prompts of torc's planners; no object has it while the target is not visible."""
_ROUNDING = 1e-6
_JPEG = b"\xff\xd8\xff"


@dataclass(frozen=True)
class NextObjectRow:
    """One decision.

    Attributes:
        id: a hash that reveals neither order nor answer.
        split: "train", "test" or "hidden".
        scene: a hash that all decisions of one problem share: resample these, not rows.
        source: where the problem comes from, one of SOURCES.
        category: whether the problem's objects stand in order or lie in a pile, one of CATEGORIES.
        picks_taken: number of objects removed before.
        target_hidden: the target is not visible.
        description: the target, in words.
        image: the picture with outlines and numbers, JPEG.
        image_plain: the picture without them, JPEG.
        references: pictures of the target alone, JPEG; may be empty.
        numbers: the visible marks, rising: the choices. TARGET_NUMBER is the target's; the others are drawn anew for
            every decision and mean nothing.
        graspable: per number, whether the robot has a grasp for it.
        facts: what is graspable and what blocks what, as for torc's VLM+GRASPS.
        relations: JSON, a list of {"source", "relation", "target"}: what seems to stand behind what, by depth alone.
        relations_true: per relation, whether it holds.
        values: per number, the expected picks until the target is delivered, if this is picked now.
        values_low, values_high: interval of each value; see `torc_next_object.making.valuing`.
        best: the numbers whose value is within BEST_WITHIN of the least.
        random_value: mean value of the graspable numbers.
        baselines: JSON, the choice of each baseline, {name: number or null}.
        questions: version of pictures, facts and prompt; 1 if a file does not say.
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

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, with lists; pictures are bytes."""
        return {k: list(v) if isinstance(v, tuple) else v for k, v in asdict(self).items()}


PICTURES = ("image", "image_plain", "references")
COLUMNS = tuple(f.name for f in fields(NextObjectRow) if f.default is MISSING)
"""The columns that every file has; the others are younger than some files."""
_DTYPES = {str: "string", int: "int32", bool: "bool", float: "float64"}


def _feature(kind: Any) -> dict[str, Any]:
    if parts := get_args(kind):
        return {"feature": _feature(parts[0]), "_type": "List"}
    return {"_type": "Image"} if kind is bytes else {"dtype": _DTYPES[kind], "_type": "Value"}


FEATURES: Mapping[str, Mapping[str, Any]] = {
    name: _feature(kind) for name, kind in get_type_hints(NextObjectRow).items()
}
"""The columns' types, as the library `datasets` writes them."""


def row_from(data: Mapping[str, Any]) -> NextObjectRow:
    """Make a row from the data of `to_dict`."""
    plain: dict[str, Any] = {f.name: data[f.name] for f in fields(NextObjectRow) if f.name in data}
    lists = {name: tuple(value) for name, value in plain.items() if isinstance(value, list)}
    return NextObjectRow(**plain | lists)


def best_numbers(numbers: tuple[int, ...], values: tuple[float, ...]) -> tuple[int, ...]:
    """Return the numbers whose value is within BEST_WITHIN of the least."""
    least = min(values)
    return tuple(n for n, v in zip(numbers, values, strict=True) if v <= least + BEST_WITHIN + _ROUNDING)


def random_value(graspable: tuple[bool, ...], values: tuple[float, ...]) -> float:
    """Return the mean value of the graspable choices; of all if none is."""
    counted = [v for g, v in zip(graspable, values, strict=True) if g] or list(values)
    return sum(counted) / len(counted)


def row_faults(row: NextObjectRow) -> Iterator[str]:
    """Yield the reasons why a row may not be published."""
    n = len(row.numbers)
    if not 1 <= n <= MOST_CHOICES:
        yield f"it has {n} choices; 1 to {MOST_CHOICES} are allowed"
        return
    if any(len(column) != n for column in (row.graspable, row.values, row.values_low, row.values_high)):
        yield "graspable, values, values_low, values_high must have one entry per number"
        return
    if tuple(sorted(set(row.numbers))) != row.numbers or row.numbers[0] < 0:
        yield "numbers are not rising"
    if row.target_hidden == (TARGET_NUMBER in row.numbers):
        yield "target_hidden does not agree with the numbers"
    if not all(math.isfinite(v) and v >= 0 for v in (*row.values, row.random_value)):
        yield "a value is not a number of picks"
    elif row.best != best_numbers(row.numbers, row.values):
        yield "best are not the numbers with the least values"
    elif abs(row.random_value - random_value(row.graspable, row.values)) > BEST_WITHIN / 10:
        yield "random_value is not the mean of what is graspable"
    if not all(a <= v <= b for a, v, b in zip(row.values_low, row.values, row.values_high, strict=True)):
        yield "a value lies outside its own interval"
    if row.source not in SOURCES or row.category not in CATEGORIES:
        yield "source or category is unknown"
    if not all(p.startswith(_JPEG) for p in (row.image, row.image_plain, *row.references)):
        yield "a picture is not a JPEG"
    try:
        relations, chosen = json.loads(row.relations), json.loads(row.baselines)
    except ValueError:
        yield "relations or baselines are not JSON"
        return
    if len(relations) != len(row.relations_true):
        yield "relations_true must have one entry per relation"
    named = [r[end] for r in relations for end in ("source", "target")] + [*chosen.values()]
    if not set(named) <= {*row.numbers, None}:
        yield "a relation or a baseline names what is not visible"
