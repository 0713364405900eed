"""From what the score promised in whole trials, with the arm, to what came of it.

Trials of the floating gripper teach which grasps are better than others. How often a grasp of some probability is
delivered by the arm, chosen as the best of an object, is measured in trials. Three numbers bring the promise in line:

    log-odds of delivered = shift + slope * log-odds promised, up to a promise of .9; from there on with another slope.

Two slopes, since the best of many doubtful candidates is promised too much, and a sure one too little.
"""

import csv
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float
from scipy.optimize import minimize
from scipy.special import expit, logit

from torc.errors import InputError
from torc.grasping.trees import TreeModel
from torc.records import PickResult

_LEAST = 1e-4
"""Promises are taken to be at least this far from 0 and 1."""
_PRIOR = 1.0
"""Weight of "the promise holds as it is", in tries: few tries change it little."""
_BEND = float(logit(0.9))


@dataclass(frozen=True)
class Tries:
    """Grasps that were carried out, each the first try with its object.

    Attributes:
        p: what the score promised.
        delivered: what came of it.
    """

    p: Float[np.ndarray, "n"]
    delivered: Bool[np.ndarray, "n"]

    def __len__(self) -> int:
        return len(self.p)


@dataclass(frozen=True)
class Promise:
    """The three numbers of the module's docstring."""

    shift: float
    slope: float
    slope_above: float

    def kept(self, p: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
        """How probable delivery is where p was promised."""
        x = logit(np.clip(p, _LEAST, 1 - _LEAST))
        return expit(
            self.shift + self.slope * np.minimum(x, _BEND) + self.slope_above * np.maximum(x - _BEND, 0)
        )


def read_tries(paths: Sequence[Path]) -> Tries:
    """The first tries in tables of picks, as `torc report` writes them (picks.csv).

    A later try with an object that failed before is promised less by the pipeline, and says nothing of the score.

    Raises InputError for a file that is no such table.
    """
    p, delivered = [], []
    for path in paths:
        failed: set[tuple[str, str, str, str]] = set()
        for row in _rows(path):
            result, key = (
                PickResult(row["result"]),
                (row["planner"], row["problem"], row["seed"], row["object_id"]),
            )
            if not result.grasp_tried or not row["p"]:
                continue
            good = result in (PickResult.RETRIEVED, PickResult.REMOVED)
            if key not in failed:
                p.append(float(row["p"]))
                delivered.append(good)
            if not good:
                failed.add(key)
    return Tries(np.array(p), np.array(delivered, dtype=bool))


def fit_promise(p: Float[np.ndarray, "n"], delivered: Bool[np.ndarray, "n"]) -> Promise:
    """The likeliest three numbers. Raises InputError without tries."""
    if len(p) == 0:
        raise InputError(
            "There are no tries to learn from. Play trials with `torc bench`, then `torc report` them."
        )

    def loss(numbers: Float[np.ndarray, "3"]) -> float:
        q = np.clip(_promise(numbers).kept(p), 1e-12, 1 - 1e-12)
        miss = -np.sum(np.where(delivered, np.log(q), np.log1p(-q)))
        return float(miss + _PRIOR * np.sum(numbers**2))

    return _promise(
        minimize(
            loss, np.zeros(3), method="Nelder-Mead", options={"xatol": 1e-6, "fatol": 1e-9, "maxiter": 4000}
        ).x
    )


def _promise(numbers: Float[np.ndarray, "3"]) -> Promise:
    """From numbers without bounds: slopes are positive."""
    return Promise(float(numbers[0]), float(np.exp(numbers[1])), float(np.exp(numbers[2])))


def recalibrated(model: TreeModel, promise: Promise, notes: str, rough: bool = False) -> TreeModel:
    """The model with its calibration brought in line, or only that for `rough` depth; ranks stay as they were."""
    changed = replace(model, notes=f"{model.notes}; {notes}")
    if rough:
        return replace(changed, knots_rough=promise.kept(model.for_rough_depth().knots_held))
    return replace(changed, knots_held=promise.kept(model.knots_held))


def _rows(path: Path) -> list[dict[str, str]]:
    try:
        with open(path, newline="", encoding="utf-8") as f:
            rows = list(csv.DictReader(f))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path} cannot be read: {error}") from None
    needed = {"planner", "problem", "seed", "object_id", "result", "p"}
    if not rows or not needed <= set(rows[0]):
        raise InputError(
            f"{path} is no table of picks with what was promised. `torc report` writes one, picks.csv."
        )
    return rows
