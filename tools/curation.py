"""Choosing the problems of a set by measured difficulty: how the shipped sets were made, for anyone to make again.

python -m benchmarks.generation --count 200 --keep candidates
python -m benchmarks.oracle --problems candidates --seeds 1 --budget 12 --likely --out answers
torc bench --problems candidates --planners random --repeats 3 --out measured
python -m tools.curation --candidates candidates --answers answers --trials measured/trials --out chosen
"""

import json
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import get_args

import numpy as np
import tyro

from torc.errors import InputError
from torc.generation.generator import inspector_for
from torc.generation.inspection import difficulty_of
from torc.oracle.answer import ORDER_KEY
from torc.problems.problem import Problem, load_problem, save_problem
from torc.problems.schema import Category
from torc.problems.sets import select_problems
from torc.robots.names import DEFAULT_ROBOT

HIDDENNESS = ("hidden", "partly")
BANDS = ((8, 11), (12, 15), (16, 20))
"""Numbers of objects; every band is filled alike."""


@dataclass(frozen=True)
class Candidate:
    """A problem and what was measured of it.

    Attributes:
        problem: with the facts of its generation in `origin`.
        oracle_picks: picks of the best order that ORACLE found; None if it found none.
        oracle_drops: objects that fall off the table in that order.
        random_picks: picks of RANDOM's trials, in any order.
        oracle_order: names of the objects in ORACLE's order.
    """

    problem: Problem
    oracle_picks: int | None
    oracle_drops: int
    random_picks: tuple[int, ...]
    oracle_order: tuple[str, ...] = ()

    @property
    def random_median(self) -> float:
        """RANDOM's median picks."""
        return float(np.median(self.random_picks))

    @property
    def target_model(self) -> str:
        """The object model of the target."""
        return next(o.model for o in self.problem.objects if o.name == self.problem.target)


@dataclass(frozen=True)
class Wanted:
    """What a set is to be like.

    Attributes:
        each: problems per category.
        random_picks, oracle_picks: the medians to come near to: the paper's RANDOM, and room below it.
        fewest_picks: ORACLE's at least: the paper's problems need two.
        room: picks by which RANDOM's median exceeds ORACLE's at least.
        repeat_cost: how many picks further from those medians a problem may be, rather than have a target of a model
            that another one has already.
    """

    each: int = 20
    random_picks: float = 5.0
    oracle_picks: float = 3.0
    fewest_picks: int = 2
    room: float = 1.0
    repeat_cost: float = 1.0


def is_eligible(candidate: Candidate, wanted: Wanted) -> bool:
    """Solved without a drop in enough picks, hidden at least partly, and with room between RANDOM and ORACLE."""
    return (
        candidate.oracle_picks is not None
        and candidate.oracle_picks >= wanted.fewest_picks
        and candidate.oracle_drops == 0
        and candidate.random_median >= candidate.oracle_picks + wanted.room
        and _cell(candidate.problem) is not None
    )


def choose(
    candidates: Iterable[Candidate], wanted: Wanted, taken: Sequence[Candidate] = ()
) -> list[Candidate]:
    """The candidates that make a set, besides those that are in it already.

    Per category as many hidden as partly hidden targets, and as many of each band of object counts, as far as the
    candidates allow; within such a cell the problem comes first whose ORACLE and RANDOM picks are nearest to those
    that are wanted.

    Returns:
        The chosen ones in the order of choice; fewer than wanted where the candidates do not suffice.
    """
    pool = [c for c in candidates if is_eligible(c, wanted)]
    chosen: list[Candidate] = []
    for category in get_args(Category):
        have = [c for c in taken if c.problem.category == category]
        left = [c for c in pool if c.problem.category == category]
        while len(have) < wanted.each and left:
            cells = [_cell(c.problem) for c in have]
            totals, filled = Counter(cell[0] for cell in cells if cell), Counter(cells)
            possible = {cell for c in left if (cell := _cell(c.problem))}
            cell = min(sorted(possible), key=lambda cell: (totals[cell[0]], filled[cell]))
            targets = Counter(c.target_model for c in [*taken, *chosen])
            best = min(
                (c for c in left if _cell(c.problem) == cell),
                key=lambda c: (
                    _distance(c, wanted) + wanted.repeat_cost * targets[c.target_model],
                    c.problem.name,
                ),
            )
            left.remove(best)
            have.append(best)
            chosen.append(best)
    return chosen


def named(chosen: Iterable[Candidate], taken: Iterable[str], prefix: str = "") -> list[Problem]:
    """The chosen problems under the names of a set: prefix, category and a number that is free; facts in `origin`."""
    used, problems = set(taken), []
    for candidate in chosen:
        stem = f"{prefix}{candidate.problem.category}"
        name = next(n for k in range(1, 1000) if (n := f"{stem}-{k:02d}") not in used)
        used.add(name)
        origin = {
            **candidate.problem.origin,
            "oracle_picks": candidate.oracle_picks or 0,
            ORDER_KEY: ", ".join(candidate.oracle_order),
            "random_picks_median": candidate.random_median,
        }
        problems.append(replace(candidate.problem, name=name, origin=origin))
    return problems


def read_candidates(selection: str, answers: Path, trials: Path) -> list[Candidate]:
    """Problems with what was measured of them; those without are left out.

    Args:
        selection: as `select_problems` takes it.
        answers: what `benchmarks/oracle.py` wrote; the answer for the first seed counts.
        trials: what `torc bench` wrote (DIR/trials); RANDOM's completed trials count.

    Raises:
        InputError: a problem cannot be read, or nothing was measured.
    """
    found = []
    for name in select_problems(selection):
        stem = Path(name).stem
        answer = _read(answers / f"{stem}-0.json")
        results = [_read(path) for path in sorted(trials.glob(f"{stem}-random-*/result.json"))]
        picks = tuple(r["picks"] for r in results if r is not None and r["status"] == "completed")
        if answer is not None and picks:
            solved = answer["picks"] if answer["solved"] else None
            problem, order = _with_facts(load_problem(name)), tuple(answer["order"])
            found.append(Candidate(problem, solved, answer["drops"], picks, order))
    if not found:
        raise InputError(f"Nothing was measured of {selection}: see {answers} and {trials}.")
    return found


def _with_facts(problem: Problem) -> Problem:
    """With its difficulty in `origin`, measured if it is not there."""
    if "hiddenness" in problem.origin:
        return problem
    facts = difficulty_of(problem, inspector_for(DEFAULT_ROBOT)).facts()
    return replace(problem, origin={**problem.origin, **facts})


def _read(path: Path) -> Mapping | None:  # type: ignore[type-arg]
    return json.loads(path.read_text()) if path.is_file() else None


def _cell(problem: Problem) -> tuple[str, tuple[int, int]] | None:
    """Hiddenness and band of a problem; None if it is in no cell."""
    hidden, count = str(problem.origin.get("hiddenness", "")), len(problem.objects)
    band = next((b for b in BANDS if b[0] <= count <= b[1]), None)
    return (hidden, band) if hidden in HIDDENNESS and band else None


def _distance(candidate: Candidate, wanted: Wanted) -> float:
    oracle = abs((candidate.oracle_picks or 0) - wanted.oracle_picks)
    return oracle + abs(candidate.random_median - wanted.random_picks)


@dataclass(frozen=True)
class _Args:
    """Choose problems out of measured candidates and write them under new names."""

    candidates: str
    """Problem files, directories or sets, with commas between."""
    answers: Path
    """Output of benchmarks/oracle.py for the candidates."""
    trials: Path
    """DIR/trials of `torc bench --out DIR` for the candidates, RANDOM among the planners."""
    out: Path
    """Where the chosen problems are written."""
    keep: str = ""
    """Problems that are in the set already, measured like the candidates; those that are not eligible are named."""
    each: int = 20
    """Problems per category, those kept included."""
    prefix: str = ""
    """Of the names."""


def main() -> None:
    """Choose, write, and say what was chosen."""
    args = tyro.cli(_Args)
    wanted = Wanted(args.each)
    kept = read_candidates(args.keep, args.answers, args.trials) if args.keep else []
    taken = [c for c in kept if is_eligible(c, wanted)]
    for candidate in kept:
        if candidate not in taken:
            print(f"not eligible: {_line(candidate)}")
    candidates = read_candidates(args.candidates, args.answers, args.trials)
    chosen = choose(candidates, wanted, taken)
    args.out.mkdir(parents=True, exist_ok=True)
    for candidate, problem in zip(
        chosen, named(chosen, [c.problem.name for c in taken], args.prefix), strict=True
    ):
        save_problem(problem, args.out / f"{problem.name}.yaml")
        print(f"{problem.name:<18} {_line(candidate)}")
    eligible = sum(is_eligible(c, wanted) for c in candidates)
    print(f"{len(chosen)} chosen of {eligible} eligible of {len(candidates)} candidates, {len(taken)} kept.")
    everything = [*taken, *chosen]
    for what, values in (
        ("RANDOM", [c.random_median for c in everything]),
        ("ORACLE", [float(c.oracle_picks or 0) for c in everything]),
    ):
        print(f"{what} picks: median {np.median(values):g}, mean {np.mean(values):.2f}")


def _line(candidate: Candidate) -> str:
    cell = _cell(candidate.problem)
    return (
        f"{candidate.problem.name}: {len(candidate.problem.objects)} objects, {cell[0] if cell else 'visible'}, "
        f"ORACLE {candidate.oracle_picks}, RANDOM {candidate.random_median:g} {list(candidate.random_picks)}, "
        f"target {candidate.target_model}"
    )


if __name__ == "__main__":
    main()
