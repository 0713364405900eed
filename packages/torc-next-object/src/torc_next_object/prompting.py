"""Write the question about a row: one text for each variant, the same in every harness.

A row here is any mapping with the columns of `torc_next_object.schema`; only the standard library is needed.
"""

import hashlib
import json
from collections.abc import Mapping
from importlib.resources import files
from string import Template
from typing import Any

VARIANTS = ("image", "grasps", "relations")
"""A model gets the picture alone; or also what is graspable and what blocks what; or what seems to be behind what."""
VERSIONS = (1, 2)
"""Versions of prompts and pictures; a row's `questions` names its own, the first by default. A changed prompt is a new
file with the next number; results name theirs.
"""
_TARGET = 0
_MARKED = {
    1: "The picture is what the camera of a robot arm sees. Each object in it is outlined in a colour of its own, and "
    "carries its number in white on a black square, or beside it with a line that leads to it.",
    2: "The picture is what the camera of a robot arm sees, cut to the part with the objects. Each object in it is "
    "outlined in a colour that its neighbours do not have, and has its number in white on a black square, on it or "
    "beside it with a line to it. Where an object shows in several pieces, a dotted line in its colour joins them.",
}
_REFERENCE = " The second picture shows the target alone: look for it in the first."
_REFERENCES = " The further pictures show the target alone: look for it in the first."


def version_of(row: Mapping[str, Any]) -> int:
    """Return the version of a row's questions."""
    return int(row.get("questions") or 1)


def prompt_name(variant: str, version: int = 1) -> str:
    """Return the name of a variant's prompt, with its version. Raises ValueError if there is none."""
    if variant not in VARIANTS or version not in VERSIONS:
        raise ValueError(
            f"There is no prompt '{variant}', version {version}; there are {VARIANTS}, {VERSIONS}."
        )
    return f"next-object-{variant}-{version}"


def prompt_digest(variant: str, version: int = 1) -> str:
    """Return the SHA-256 of a variant's prompt before it is filled in."""
    return hashlib.sha256(_template(variant, version).encode()).hexdigest()


def prompt_text(row: Mapping[str, Any], variant: str) -> str:
    """Return the question about a row. It ends by asking for a last line "Answer: N"."""
    hidden = f"It is not in sight: nothing in the picture carries the number {_TARGET}."
    seen = f"It is in sight and carries the number {_TARGET}."
    version = version_of(row)
    return Template(_template(variant, version)).substitute(
        pictures=_pictures(_MARKED[version], len(row["references"] or ())),
        target_size=str(row.get("target_size") or "").strip(),
        gripper=str(row.get("gripper") or "").strip(),
        description=str(row["description"]).strip().rstrip(".") or "not described",
        target_state=hidden if row["target_hidden"] else seen,
        numbers=", ".join(str(int(n)) for n in row["numbers"]),
        facts=str(row["facts"]).strip() or "None.",
        relations=_relations(str(row["relations"])),
    )


def sent_pictures(row: Mapping[str, Any]) -> tuple[Any, ...]:
    """Return the pictures of the question, in the row's own type: the marked one, then those of the target."""
    return (row["image"], *(row["references"] or ()))


def _template(variant: str, version: int) -> str:
    file = files("torc_next_object") / "prompts" / f"{prompt_name(variant, version)}.txt"
    return file.read_text(encoding="utf-8").strip()


def _pictures(marked: str, references: int) -> str:
    if references == 0:
        return marked
    return marked.replace("The picture", "The first picture", 1) + (
        _REFERENCE if references == 1 else _REFERENCES
    )


def _relations(text: str) -> str:
    """Write one pair a line."""
    pairs = json.loads(text or "[]")
    return "[\n  " + ",\n  ".join(map(json.dumps, pairs)) + "\n]" if pairs else "None."
