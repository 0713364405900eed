"""Whether a directory of rows may be published: whole, consistent, and without a sign that gives the answer away."""

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from torc_next_object.data.tables import declared, read_rows
from torc_next_object.schema import FEATURES, TARGET_NUMBER, NextObjectRow, row_faults
from torc_next_object.scoring import score_answers

SIGNS = 4.0
"""Standard errors from chance at which something counts as a sign: one of 16,000 fair sets goes beyond."""
_OPAQUE = re.compile(r"[0-9a-f]{16,64}")
_FEW = 8


def check_directory(directory: Path) -> tuple[list[NextObjectRow], list[str]]:
    """All rows, and what is wrong with them. Raises InputError where nothing can be read."""
    rows, faults = read_rows(directory), list[str]()
    files = [directory] if directory.is_file() else sorted(directory.rglob("*.parquet"))
    wanted = {name: dict(feature) for name, feature in FEATURES.items()}
    for file in files:
        if declared(file) != wanted:
            faults.append(f"{file.name} does not declare the features of the format")
    return rows, [*faults, *set_faults(rows)]


def set_faults(rows: Sequence[NextObjectRow]) -> Iterator[str]:
    """What is wrong with rows, each and together."""
    for row in rows:
        for fault in row_faults(row):
            yield f"row {row.id}: {fault}"
        if not (_OPAQUE.fullmatch(row.id) and _OPAQUE.fullmatch(row.scene)):
            yield f"row {row.id}: id or scene is no hash"
    twice = [key for key, count in Counter(row.id for row in rows).items() if count > 1]
    if twice:
        yield f"ids that are there twice: {', '.join(twice[:_FEW])}"
    splits: dict[str, set[str]] = {}
    for row in rows:
        splits.setdefault(row.scene, set()).add(row.split)
    if any(len(found) > 1 for found in splits.values()):
        yield "a problem is in two splits"
    for what, signs in leaks(rows).items():
        if abs(signs) > SIGNS:
            yield f"{what} tells of the answer ({signs:+.1f} standard errors)"


def leaks(rows: Sequence[NextObjectRow]) -> dict[str, float]:
    """How many standard errors from chance: whether the best choices have low or high numbers among those that are not
    the target's; whether the order of ids goes with them, with the picks taken, and with what can be lost.
    """
    places, spread = [], []
    by_id = sorted(rows, key=lambda row: row.id)
    for row in by_id:
        others = [n for n in row.numbers if n != TARGET_NUMBER]
        best = [others.index(n) for n in row.best if n != TARGET_NUMBER]
        n, k = len(others), len(best)
        if k and n > k:
            places.append((float(np.mean(best)) + 0.5) / n - 0.5)
            spread.append((n * n - 1) / (12 * n * n) / k * (n - k) / (n - 1))
        else:
            places.append(0.0)
            spread.append(0.0)
    total = float(np.sqrt(np.sum(spread)))
    lost = [row.random_value - row.best_value for row in by_id]
    return {
        "the size of the number": float(np.sum(places)) / total if total else 0.0,
        "the order of ids (best number)": _trend(places),
        "the order of ids (picks taken)": _trend([row.picks_taken for row in by_id]),
        "the order of ids (picks to lose)": _trend(lost),
    }


def blind_scores(rows: Sequence[NextObjectRow]) -> dict[str, dict[str, Any]]:
    """Scores of what one may answer without the picture, from the prompt of the variant "image" alone, and of one who
    is shown the picture of another decision. All must be as random choices: 1 within their intervals.
    """
    rng = np.random.default_rng(0)
    others = [rows[i] for i in rng.permutation(len(rows))]
    drawn = [int(rng.choice(row.numbers)) for row in rows]
    answers: dict[str, list[int]] = {
        "the target's number, else any": [
            TARGET_NUMBER if TARGET_NUMBER in row.numbers else d for row, d in zip(rows, drawn)
        ],
        "any number": drawn,
        "the lowest": [row.numbers[0] for row in rows],
        "the highest": [row.numbers[-1] for row in rows],
        "the best of another picture": [
            other.best[0] if other.best[0] in row.numbers else d for row, other, d in zip(rows, others, drawn)
        ],
    }
    plain = [row.to_dict() for row in rows]
    return {name: score_answers(zip(plain, given)).to_dict() for name, given in answers.items()}


def _trend(values: Sequence[float]) -> float:
    """Correlation with the order, in standard errors."""
    if len(values) < 3 or np.std(values) == 0:
        return 0.0
    r = float(np.corrcoef(np.arange(len(values)), values)[0, 1])
    return r * float(np.sqrt(len(values) - 1))
