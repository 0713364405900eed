"""Check whether rows may be published: complete, consistent, and without signs that give the answer away."""

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from torc_next_object.data.tables import declared, parquet_files, read_rows
from torc_next_object.schema import FEATURES, TARGET_NUMBER, NextObjectRow, row_faults
from torc_next_object.scoring import score_answers

SIGNS = 4.0
"""Standard errors from chance at which something counts as a sign; one of 16,000 fair sets goes beyond."""
_OPAQUE = re.compile(r"[0-9a-f]{16,64}")
_FEW = 8


def check_directory(directory: Path) -> tuple[list[NextObjectRow], list[str]]:
    """Return all rows, and their faults. Raises InputError if nothing can be read."""
    rows = read_rows(directory)
    undeclared = [file.name for file in parquet_files(directory) if declared(file) != FEATURES]
    faults = [f"{name} does not declare the features of the format" for name in undeclared]
    return rows, [*faults, *set_faults(rows)]


def set_faults(rows: Sequence[NextObjectRow]) -> Iterator[str]:
    """Yield the faults of rows, each by itself and together."""
    for row in rows:
        for fault in row_faults(row):
            yield f"row {row.id}: {fault}"
        if not (_OPAQUE.fullmatch(row.id) and _OPAQUE.fullmatch(row.scene)):
            yield f"row {row.id}: id or scene is not a hash"
    twice = [key for key, count in Counter(row.id for row in rows).items() if count > 1]
    if twice:
        yield f"ids that occur twice: {', '.join(twice[:_FEW])}"
    splits: dict[str, set[str]] = {}
    for row in rows:
        splits.setdefault(row.scene, set()).add(row.split)
    if any(len(found) > 1 for found in splits.values()):
        yield "a problem is in two splits"
    for what, signs in leaks(rows).items():
        if abs(signs) > SIGNS:
            yield f"{what} reveals the answer ({signs:+.1f} standard errors)"


def leaks(rows: Sequence[NextObjectRow]) -> dict[str, float]:
    """Return what may give the answer away, in standard errors from chance.

    Whether the best choices have low or high numbers among those that are not the target's; whether the order of ids
    correlates with that, with the picks taken, and with the picks that can be lost.
    """
    places, spread = [], []
    by_id = sorted(rows, key=lambda row: row.id)
    for row in by_id:
        others = [n for n in row.numbers if n != TARGET_NUMBER]
        best = [others.index(n) for n in row.best if n != TARGET_NUMBER]
        n, k = len(others), len(best)
        some = 0 < k < n
        places.append((float(np.mean(best)) + 0.5) / n - 0.5 if some else 0.0)
        spread.append((n * n - 1) / (12 * n * n) / k * (n - k) / (n - 1) if some else 0.0)
    total = float(np.sqrt(np.sum(spread)))
    lost = [row.random_value - row.best_value for row in by_id]
    return {
        "the size of the number": float(np.sum(places)) / total if total else 0.0,
        "the order of ids (best number)": _trend(places),
        "the order of ids (picks taken)": _trend([row.picks_taken for row in by_id]),
        "the order of ids (picks to lose)": _trend(lost),
    }


def blind_scores(rows: Sequence[NextObjectRow]) -> dict[str, dict[str, Any]]:
    """Score answers without the picture, from the prompt of the variant "image" alone, or with another decision's.

    All must be as good as random choices: regrets of 1 within their intervals.
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
    """Return the correlation with the order, in standard errors."""
    if len(values) < 3 or np.std(values) == 0:
        return 0.0
    r = float(np.corrcoef(np.arange(len(values)), values)[0, 1])
    return r * float(np.sqrt(len(values) - 1))
