"""A tiny set of decisions, made up: small pictures, three choices or four, values that are easy to reckon with."""

import hashlib
import json
from pathlib import Path

import numpy as np

from torc.io.pictures import jpeg_bytes
from torc_next_object.data.tables import write_rows
from torc_next_object.schema import NextObjectRow, best_numbers, random_value

REPLIES = (
    "Answer: {best}",
    "The {worst} stands before it.\n\nAnswer: {worst}",
    '```json\n{{"thoughts": "?", "plan": [{{"action": "remove", "input": {worst}}}]}}\n```',
    "",
    "I cannot help with that.",
    "Answer: 99",
    "<html><body>502</body></html>",
    "{best}",
    "Answer: {best} or {worst}",
    "thoughts " * 20_000 + "\nAnswer: {best}",
    "**Answer:** {worst}\u0000\u202e",
    "Answer: NaN",
)
"""What a model may write, odd or not; {best} and {worst} stand for numbers of the row."""


def tiny_rows(count: int = 12, split: str = "test") -> list[NextObjectRow]:
    """Rows of three problems."""
    rng = np.random.default_rng(7)
    return [_row(i, split, rng) for i in range(count)]


def tiny_replies(rows: list[NextObjectRow]) -> dict[str, str]:
    """A reply for each row, by id."""
    replies = {}
    for i, row in enumerate(rows):
        worst = row.numbers[int(np.argmax(row.values))]
        replies[row.id] = REPLIES[i % len(REPLIES)].format(best=row.best[0], worst=worst)
    return replies


def write_tiny(directory: Path, rows: list[NextObjectRow]) -> Path:
    """The rows as Parquet, as `torc next-object make` writes them; the directory."""
    for split in {row.split for row in rows}:
        write_rows(directory / f"{split}.parquet", [row for row in rows if row.split == split])
    return directory


def _row(i: int, split: str, rng: np.random.Generator) -> NextObjectRow:
    hidden = i % 3 == 0
    numbers = (4, 7, 11) if hidden else (0, 3, 8, 9)
    values = tuple(float(v) for v in np.round(rng.uniform(1, 5, len(numbers)), 3))
    graspable = tuple(n != 11 for n in numbers)
    pictures = [jpeg_bytes(rng.integers(0, 256, (24, 32, 3), dtype=np.uint8)) for _ in range(3)]
    relations = [{"source": numbers[0], "relation": "behind", "target": numbers[1]}]
    return NextObjectRow(
        id=hashlib.sha256(f"row {i}".encode()).hexdigest()[:16],
        split=split,
        scene=hashlib.sha256(f"scene {i % 5}".encode()).hexdigest()[:16],
        source="generated",
        category="structured" if i % 2 else "unstructured",
        picks_taken=i % 4,
        target_hidden=hidden,
        description="a red can",
        image=pictures[0],
        image_plain=pictures[1],
        references=tuple(pictures[2:]) if i % 4 == 1 else (),
        numbers=numbers,
        graspable=graspable,
        facts="\n".join(f"Object {n} is graspable." for n in numbers if n != 11),
        relations=json.dumps(relations),
        relations_true=(True,),
        values=values,
        values_low=values,
        values_high=values,
        best=best_numbers(numbers, values),
        random_value=random_value(graspable, values),
        baselines=json.dumps({"random": numbers[0], "dg-select": numbers[1], "oracle": None}),
    )
