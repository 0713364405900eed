"""What is published about GraspClutter6D's scenes and objects beside the data: the paper's problems, labels, names.

The files in data/graspclutter6d name their sources.
"""

import csv
import re
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import cast

from torc.errors import InputError
from torc.generation.graspclutter6d.reading import MAX_ID, object_stem
from torc.problems.schema import Category

LABELLED_SCENES = 1000


@dataclass(frozen=True)
class PaperProblem:
    """One of the 40 problems of the retrieval paper: the authors' label, the scene's number, and the wanted object,
    e.g. obj_000044_1."""

    category: Category
    scene: int
    target: str


@cache
def paper_problems() -> tuple[PaperProblem, ...]:
    """The 40 problems, structured first, by scene."""
    rows = csv.DictReader(_lines("paper_problems.csv"))
    return tuple(PaperProblem(cast(Category, r["category"]), int(r["scene"]), r["target"]) for r in rows)


def published_category(scene: int) -> Category | None:
    """The authors' label of a scene, made by hand; None for a scene that they did not have."""
    if not 0 <= scene < LABELLED_SCENES:
        return None
    return "structured" if scene in _structured_scenes() else "unstructured"


def object_words(object_id: int) -> str:
    """An object in words: "the can of peaches", or "object 42 of GraspClutter6D"."""
    name = _object_names().get(object_id)
    return f"the {name}" if name else f"object {object_id} of GraspClutter6D"


def parse_object_name(text: str) -> tuple[int, int | None]:
    """Object id and instance (None if not given) of "obj_000044_1", "44_1" or "44". Raises InputError."""
    found = re.fullmatch(r"(?:obj_)?(\d{1,6})(?:_(\d{1,3}))?", text, re.ASCII)
    if found is None or not 0 < int(found.group(1)) <= MAX_ID:
        raise InputError(
            f"'{text[:60]}' is no object of a scene. Write 44_1 or {object_stem(44)}_1 (object, instance)."
        )
    return int(found.group(1)), None if found.group(2) is None else int(found.group(2))


@cache
def _structured_scenes() -> frozenset[int]:
    return frozenset(int(word) for line in _lines("structured_scenes.txt") for word in line.split())


@cache
def _object_names() -> dict[int, str]:
    return {int(row["id"]): row["name"] for row in csv.DictReader(_lines("object_names.csv"))}


def _lines(name: str) -> list[str]:
    """The lines of a data file that are no comments."""
    text = (files("torc.generation.graspclutter6d") / "data" / name).read_text(encoding="utf-8")
    return [line for line in text.splitlines() if not line.startswith("#")]
