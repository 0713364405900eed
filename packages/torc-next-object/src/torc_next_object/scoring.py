"""Score answers without a simulator: plain functions of rows and numbers, the same in every harness.

A row here is any mapping with COLUMNS, which `torc_next_object.schema` explains. Only NumPy is needed.
"""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

COLUMNS = ("id", "scene", "source", "category", "target_hidden", "numbers", "values", "random_value")
"""The columns of a row that scoring needs."""
BEST_WITHIN = 0.05
"""Picks: choices this near the best are as good; rows whose random choice is do not count for the regret."""
DIFFICULTIES = (("easy", 1.5), ("medium", 2.5), ("hard", float("inf")))
"""Names and upper bounds, by the picks until the target is delivered with the best choice."""
CROWDS = (("1-8", 8), ("9-14", 14), ("15-35", float("inf")))
"""Names and upper bounds, by the number of choices."""
GROUPS = {"hard": "difficulty", "hidden": "target", "visible": "target"}
"""The groups whose regret is shown beside the whole, and their kinds in `Scores.by`."""
RESAMPLES = 1000
SEED = 0
DIGITS = 4
_TINY = 1e-6
Row = Mapping[str, Any]


@dataclass(frozen=True)
class Scored:
    """One answer.

    Attributes:
        number: the number that it names; None if it is invalid.
        lost: picks more than with the best choice; for an invalid answer, those that a random choice loses on average.
        spread: picks that a random choice loses on average.
        top1: whether it is one of the best choices.
        groups: kind and group, e.g. ("difficulty", "hard").
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
        """Whether the choice matters; if not, there is no regret."""
        return self.spread > BEST_WITHIN

    @property
    def regret(self) -> float | None:
        """0 for the best choice, 1 for a random one; None if the choice does not matter."""
        return self.lost / self.spread if self.counts else None


@dataclass(frozen=True)
class Scores:
    """Scores of a set of answers; intervals (95 %) resample scenes.

    Attributes:
        rows, scenes, counted: decisions, problems, and decisions that count for the regret.
        regret: picks lost in all rows that count, over those that random choices lose there: 0 best, 1 as RANDOM. (A
            mean of the rows' own regrets would depend on those in which hardly anything can be lost.)
        regret_low, regret_high, top1_low, top1_high: ends of the intervals.
        lost: picks lost per decision.
        top1: share of answers that are among the best; invalid ones are not.
        invalid: share of replies that name no visible number.
        by: all these by group: {"difficulty": {"easy": {...}}, ...}.
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
        """Return data for JSON, rounded to DIGITS."""
        return _rounded(asdict(self))


def score_answer(row: Row, number: int | None) -> Scored:
    """Score one answer; None, or a number that is not a choice, is invalid."""
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
    """Score rows with their answers, in any order. Raises ValueError if there are none, or a row occurs twice."""
    scored = sorted((score_answer(row, number) for row, number in answers), key=lambda s: s.id)
    if not scored:
        raise ValueError("There are no answers to score.")
    if len({s.id for s in scored}) < len(scored):
        raise ValueError("A decision was answered twice; score one answer of each.")
    return summary(scored)


def score_baselines(rows: Sequence[Row]) -> dict[str, dict[str, Any]]:
    """Score each baseline that has chosen in every row (the column `baselines`), best first."""
    chosen = [json.loads(row["baselines"] or "{}") for row in rows]
    names = set(chosen[0]).intersection(*chosen) if chosen else set()
    found = {
        name: score_answers((row, choices[name]) for row, choices in zip(rows, chosen)).to_dict()
        for name in names
    }
    order = sorted((scores["regret"] is None, scores["regret"], name) for name, scores in found.items())
    return {name: found[name] for *_, name in order}


def group_regrets(scores: Mapping[str, Any]) -> dict[str, float | None]:
    """Return the regret of each of GROUPS, from `Scores.to_dict`; None if no row counts."""
    return {group: scores["by"].get(kind, {}).get(group, {}).get("regret") for group, kind in GROUPS.items()}


def shown(value: float | None) -> str:
    """Return a regret as text; a dash for None."""
    return "-" if value is None else f"{value:.2f}"


def scores_table(scores: Mapping[str, Mapping[str, Any]]) -> str:
    """Return scores (`Scores.to_dict`) by name as a Markdown table with aligned columns."""
    heading = ["who", "regret", "95 %", "best choice", "picks lost", "invalid"]
    table = [[*heading, *(f"regret, {group}" for group in GROUPS)], ["---"] * (len(heading) + len(GROUPS))]
    for name, found in scores.items():
        interval = f"{shown(found['regret_low'])} to {shown(found['regret_high'])}"
        shares = [f"{found[key]:.2f}" for key in ("top1", "lost", "invalid")]
        parts = map(shown, group_regrets(found).values())
        table.append([name, shown(found["regret"]), interval, *shares, *parts])
    widths = [max(map(len, column)) for column in zip(*table)]
    lines = (" | ".join(cell.ljust(width) for cell, width in zip(line, widths)) for line in table)
    return "\n".join(f"| {line} |" for line in lines)


def summary(scored: Sequence[Scored]) -> Scores:
    """Return the scores of scored answers, each row once."""
    by: dict[str, dict[str, Any]] = {}
    for kind in dict(scored[0].groups):
        names = sorted({dict(s.groups)[kind] for s in scored})
        by[kind] = {name: _part([s for s in scored if dict(s.groups)[kind] == name]) for name in names}
    return Scores(**_part(scored), by=by)


def _part(scored: Sequence[Scored]) -> dict[str, Any]:
    ordered = sorted(scored, key=lambda s: s.id)
    scenes = sorted({s.scene for s in ordered})
    place = {scene: i for i, scene in enumerate(scenes)}
    sums = np.zeros((len(scenes), 5))
    for s in ordered:
        row = (1.0, float(s.top1), s.lost, s.counts * s.lost, s.counts * s.spread)
        sums[place[s.scene]] += row
    drawn = np.random.default_rng(SEED).integers(len(scenes), size=(RESAMPLES, len(scenes)))
    total, again = sums.sum(axis=0), sums[drawn].sum(axis=1)
    regret, regret_low, regret_high = _ratio(total, again, 3, 4)
    top1, top1_low, top1_high = _ratio(total, again, 1, 0)
    return {
        "rows": len(ordered),
        "scenes": len(scenes),
        "counted": sum(s.counts for s in ordered),
        "regret": regret,
        "regret_low": regret_low,
        "regret_high": regret_high,
        "lost": float(total[2] / total[0]),
        "top1": top1,
        "top1_low": top1_low,
        "top1_high": top1_high,
        "invalid": sum(s.number is None for s in ordered) / len(ordered),
    }


def _ratio(
    total: np.ndarray, again: np.ndarray, over: int, by: int
) -> tuple[float, float, float] | tuple[None, None, None]:
    """Return the ratio of two columns of sums, and its 2.5 % and 97.5 % quantiles over resampled sums."""
    if total[by] <= 0:
        return None, None, None
    counted = again[again[:, by] > 0]
    low, high = np.quantile(counted[:, over] / counted[:, by], (0.025, 0.975))
    return float(total[over] / total[by]), float(low), float(high)


def _group(bounds: Sequence[tuple[str, float]], value: float) -> str:
    return next(name for name, most in bounds if value <= most)


def _rounded(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {k: _rounded(v) for k, v in value.items()}
    return round(value, DIGITS) if isinstance(value, float) else value
