"""Scores of answers, without a simulator: plain functions of rows and numbers, the same in every harness.

A row here is any mapping with COLUMNS, which `torc_next_object.schema` explains. Nothing but NumPy is needed.
"""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

COLUMNS = ("id", "scene", "source", "category", "target_hidden", "numbers", "values", "random_value")
"""What scoring needs of a row."""
BEST_WITHIN = 0.05
"""In picks: choices that near the best are as good, and rows whose random choice is, do not count for the regret."""
DIFFICULTIES = (("easy", 1.5), ("medium", 2.5), ("hard", float("inf")))
"""Names and upper bounds: picks until the target is there, with the best choice."""
CROWDS = (("1-8", 8), ("9-14", 14), ("15-35", float("inf")))
"""The same for the number of choices."""
RESAMPLES = 1000
SEED = 0
DIGITS = 4
_TINY = 1e-6
Row = Mapping[str, Any]


@dataclass(frozen=True)
class Scored:
    """One answer.

    Attributes:
        number: that it names; None: no valid answer.
        lost: picks more than the best choice's; of an invalid answer, what a random choice loses on average.
        spread: what a random choice loses.
        top1: whether it is one of the best.
    """

    id: str
    scene: str
    number: int | None
    lost: float
    spread: float
    top1: bool
    groups: tuple[tuple[str, str], ...]

    @property
    def counts(self) -> bool:
        """Whether the choice matters, so that there is a regret."""
        return self.spread > BEST_WITHIN

    @property
    def regret(self) -> float | None:
        """0: as the best choice; 1: as a random one; None where it does not matter what is chosen."""
        return self.lost / self.spread if self.counts else None


@dataclass(frozen=True)
class Scores:
    """Scores of a set of answers; an interval (95 %) is of scenes drawn with replacement.

    Attributes:
        rows, scenes, counted: decisions, problems, and decisions that count for the regret.
        regret: the picks lost, over all rows that count, by the picks that random choices lose there: 0 best, 1 as
            RANDOM. (A mean of the rows' own regrets would hang on those in which hardly anything can be lost.)
        lost: picks lost per decision.
        top1: share of answers that are among the best; invalid ones are not.
        invalid: share of replies that name no number in sight.
        by: the same by group: {"difficulty": {"easy": {...}}, ...}.
    """

    rows: int
    scenes: int
    counted: int
    regret: float | None
    regret_low: float | None
    regret_high: float | None
    lost: float
    top1: float
    top1_low: float
    top1_high: float
    invalid: float
    by: Mapping[str, Mapping[str, Mapping[str, Any]]]

    def to_dict(self) -> dict[str, Any]:
        """As data of JSON, rounded to DIGITS."""
        return _rounded({name: getattr(self, name) for name in self.__dataclass_fields__})


def score_answer(row: Row, number: int | None) -> Scored:
    """What an answer is worth; None, or a number that is no choice, is an invalid one."""
    numbers, values = [int(n) for n in row["numbers"]], [float(v) for v in row["values"]]
    least, chance = min(values), float(row["random_value"])
    spread = chance - least
    valid = type(number) is int and number in numbers
    value = values[numbers.index(number)] if valid and number is not None else chance
    groups = (
        ("difficulty", _group(DIFFICULTIES, least)),
        ("target", "hidden" if row["target_hidden"] else "visible"),
        ("choices", _group(CROWDS, len(numbers))),
        ("category", str(row["category"])),
        ("source", str(row["source"])),
    )
    top1 = valid and value <= least + BEST_WITHIN + _TINY
    return Scored(
        str(row["id"]), str(row["scene"]), number if valid else None, value - least, spread, top1, groups
    )


def score_answers(answers: Iterable[tuple[Row, int | None]]) -> Scores:
    """Scores of rows with their answers, in any order. Raises ValueError where there are none, or one row is there
    twice.
    """
    scored = sorted((score_answer(row, number) for row, number in answers), key=lambda s: s.id)
    if not scored:
        raise ValueError("There are no answers to score.")
    if len({s.id for s in scored}) < len(scored):
        raise ValueError("A decision was answered twice; score one answer of each.")
    return summary(scored)


def score_baselines(rows: Sequence[Row]) -> dict[str, dict[str, Any]]:
    """Of each baseline that has chosen in every row (the column `baselines`), best first."""
    chosen = [json.loads(row["baselines"] or "{}") for row in rows]
    names = set(chosen[0]).intersection(*chosen) if chosen else set()
    found = {
        name: score_answers((row, choices[name]) for row, choices in zip(rows, chosen)).to_dict()
        for name in names
    }
    return dict(sorted(found.items(), key=lambda item: (_worst_last(item[1]["regret"]), item[0])))


def _worst_last(regret: float | None) -> float:
    return float("inf") if regret is None else regret


def summary(scored: Sequence[Scored]) -> Scores:
    """Scores of answers that are scored, each row once."""
    by: dict[str, dict[str, Any]] = {}
    for kind in dict(scored[0].groups):
        names = sorted({dict(s.groups)[kind] for s in scored})
        by[kind] = {name: _part([s for s in scored if dict(s.groups)[kind] == name]) for name in names}
    whole = _part(scored)
    return Scores(**whole, by=by)


def _part(scored: Sequence[Scored]) -> dict[str, Any]:
    ordered = sorted(scored, key=lambda s: s.id)
    scenes = sorted({s.scene for s in ordered})
    place = {scene: i for i, scene in enumerate(scenes)}
    sums = np.zeros((len(scenes), 5))
    for s in ordered:
        counts = float(s.counts)
        sums[place[s.scene]] += (1.0, float(s.top1), s.lost, counts * s.lost, counts * s.spread)
    drawn = np.random.default_rng(SEED).integers(len(scenes), size=(RESAMPLES, len(scenes)))
    again = sums[drawn].sum(axis=1)
    total = sums.sum(axis=0)
    regret_low, regret_high = _interval(_regret, again)
    top1_low, top1_high = _interval(_top1, again)
    return {
        "rows": len(ordered),
        "scenes": len(scenes),
        "counted": sum(s.counts for s in ordered),
        "regret": _regret(total),
        "regret_low": regret_low,
        "regret_high": regret_high,
        "lost": float(total[2] / total[0]),
        "top1": _top1(total),
        "top1_low": top1_low,
        "top1_high": top1_high,
        "invalid": sum(s.number is None for s in ordered) / len(ordered),
    }


def _regret(sums: np.ndarray) -> float | None:
    return float(sums[3] / sums[4]) if sums[4] > 0 else None


def _top1(sums: np.ndarray) -> float:
    return float(sums[1] / sums[0])


def _interval(
    measure: Callable[[np.ndarray], float | None], samples: np.ndarray
) -> tuple[float | None, float | None]:
    """Its 2.5 % and 97.5 % quantiles over resampled sums; None where it is not defined."""
    found = [value for value in map(measure, samples) if value is not None]
    if not found:
        return None, None
    low, high = np.quantile(found, (0.025, 0.975))
    return float(low), float(high)


def _group(bounds: Sequence[tuple[str, float]], value: float) -> str:
    return next(name for name, most in bounds if value <= most)


def _rounded(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {k: _rounded(v) for k, v in value.items()}
    return round(value, DIGITS) if isinstance(value, float) else value
