"""The sets of harder problems: which candidates are in them, by rules that were fixed before any planner was played.

torc problems generate --family absent --structured --objects 8-14 --seed 7100000 --count 14 --out candidates
torc problems generate --family absent-twin --structured --objects 8-14 --seed 7100000 --count 14 --out candidates
python -m benchmarks.oracle --problems candidates --seeds 1 --budget 16 --likely --out answers
python -m tools.hard_sets --family absent --candidates candidates --answers answers --out chosen
"""

import json
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Literal

import tyro

from torc.errors import InputError
from torc.oracle.answer import ORDER_KEY
from torc.problems.problem import Problem, load_problem, save_problem
from torc.problems.sets import select_problems


@dataclass(frozen=True)
class Rule:
    """What a set takes: the first `each` candidates of a category by seed whose ORACLE needs from `fewest` to `most`
    picks with seed 0; with `twins`, pairs of which ORACLE also solves the twin, in two picks at least. `family` is that
    of the candidates, where it is not the set's name.
    """

    each: Mapping[str, int]
    fewest: int = 2
    most: int = 15
    twins: bool = False
    family: str | None = None


RULES = MappingProxyType(
    {
        "absent": Rule({"structured": 10}, most=14, twins=True),
        "look-alikes": Rule({"structured": 10, "unstructured": 10}),
        "ungraspable": Rule({"structured": 10, "unstructured": 10}),
        "deep": Rule({"structured": 10, "unstructured": 10}, family=""),
        "fragile": Rule({"structured": 20}),
        "large": Rule({"unstructured": 20}, fewest=4),
        "cupboard": Rule({"structured": 20}),
    }
)
_FEWEST_OF_TWIN = 2


@dataclass(frozen=True)
class Answered:
    """A problem with ORACLE's picks and order; None where it found no order."""

    problem: Problem
    picks: int | None
    order: tuple[str, ...] = ()

    @property
    def seed(self) -> int:
        """It was made from."""
        return int(self.problem.origin["seed"])


def choose(set_name: str, candidates: Iterable[Answered], rule: Rule) -> list[tuple[Answered, ...]]:
    """The candidates of a set in the order of their seeds, each with its twin if the rule wants twins."""
    found = sorted(candidates, key=lambda c: (c.seed, c.problem.name))
    twins = {(c.problem.category, c.seed): c for c in found if _family(c) == "absent-twin"}
    wanted = set_name if rule.family is None else rule.family
    taken: Counter[str] = Counter()
    chosen: list[tuple[Answered, ...]] = []
    for c in found:
        category = c.problem.category
        if _family(c) != wanted or taken[category] == rule.each.get(category, 0):
            continue
        twin = twins.get((category, c.seed)) if rule.twins else None
        if not _between(c, rule.fewest, rule.most):
            continue
        if rule.twins and (twin is None or not _between(twin, _FEWEST_OF_TWIN, rule.most)):
            continue
        taken[category] += 1
        chosen.append((c,) if twin is None else (c, twin))
    return chosen


def named(set_name: str, chosen: Iterable[tuple[Answered, ...]]) -> list[Problem]:
    """The chosen problems under the names of the set, ORACLE's order in their origin."""
    problems = []
    for number, group in enumerate(chosen, start=1):
        for member, suffix in zip(group, ("", "-twin")):
            origin = {
                **member.problem.origin,
                "oracle_picks": member.picks or 0,
                ORDER_KEY: ", ".join(member.order),
            }
            problems.append(replace(member.problem, name=f"{set_name}-{number:02d}{suffix}", origin=origin))
    return problems


def read_answered(selection: str, answers: Path) -> list[Answered]:
    """Candidates with what benchmarks/oracle.py wrote of them; those without an answer are left out. Raises InputError
    if none has one.
    """
    found = []
    for name in select_problems(selection):
        path = answers / f"{Path(name).stem}-0.json"
        if path.is_file():
            answer = json.loads(path.read_text())
            picks = answer["picks"] if answer["solved"] else None
            found.append(Answered(load_problem(name), picks, tuple(answer["order"])))
    if not found:
        raise InputError(
            f"No answer in '{answers}' is to one of {selection}: benchmarks/oracle.py writes them."
        )
    return found


def _family(candidate: Answered) -> str:
    return str(candidate.problem.origin.get("family", ""))


def _between(candidate: Answered, fewest: int, most: int) -> bool:
    return candidate.picks is not None and fewest <= candidate.picks <= most


@dataclass(frozen=True)
class _Args:
    """Choose the problems of a set of harder ones and write them under new names."""

    family: Literal["absent", "look-alikes", "ungraspable", "deep", "fragile", "large", "cupboard"]
    """Which set."""
    candidates: str
    """Problem files or directories, with commas between."""
    answers: Path
    """Output of benchmarks/oracle.py for the candidates."""
    out: Path
    """Where the chosen problems are written."""


def main() -> None:
    """Choose, write, and say what was chosen."""
    args = tyro.cli(_Args)
    candidates = read_answered(args.candidates, args.answers)
    chosen = choose(args.family, candidates, RULES[args.family])
    args.out.mkdir(parents=True, exist_ok=True)
    for problem in named(args.family, chosen):
        save_problem(problem, args.out / f"{problem.name}.yaml")
        facts = f"seed {problem.origin['seed']}, {len(problem.objects)} objects"
        print(f"{problem.name:<18} {problem.category:<13} {facts}, ORACLE {problem.origin['oracle_picks']}")
    wanted = sum(RULES[args.family].each.values())
    print(f"{len(chosen)} of {wanted} chosen, of {len(candidates)} candidates with an answer.")


if __name__ == "__main__":
    main()
