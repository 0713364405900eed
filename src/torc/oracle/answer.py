"""The oracle's answer, as a record, in words and as JSON; and the orders that answer files and problems state."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from torc.episode.bound import Bound
from torc.episode.privileged import SimulatedState
from torc.errors import InputError
from torc.io.reading import read_plain_text
from torc.io.record_files import to_plain
from torc.io.strict_yaml import explain_faults
from torc.oracle.search import Found
from torc.oracle.tree import GIVE_UP
from torc.problems.problem import Problem
from torc.records import PickOutcome

PASS_NAME = "(nothing)"
ORDER_KEY = "oracle_order"
"""Key of a problem's origin that holds the order."""
_MAX_BYTES = 1_000_000
_WRITERS = "`torc problems solve PROBLEM --json` and benchmarks/oracle.py write such files"


@dataclass(frozen=True)
class ForeseenPick:
    """One pick of the order, of None if nothing can be picked, so that it passes; and the target's situation after it,
    in words (empty after the last).
    """

    object_id: int | None
    name: str
    outcome: PickOutcome
    after: str


@dataclass(frozen=True)
class OracleAnswer:
    """The best order of picks found for the problem with this seed; if not solved, the most promising one.

    Attributes:
        drops: objects other than the target that fall off the table.
        proved: no order needs fewer picks, or equally many with fewer drops; if not solved, no order (of at most
            `limit` picks) leads to the target.
        lower_bound: picks that every order needs; None if no valid order leads to the target.
        rough_bound, likely: lower bound, and optimality, if a pick only took its object away, as far as tried.
    """

    problem: str
    seed: int
    budget: float
    solved: bool
    foreseen: tuple[ForeseenPick, ...]
    drops: int
    proved: bool
    lower_bound: int | None
    rough_bound: int
    picks_tried: int
    looks: int
    limit: int | None = None
    likely: bool = False

    @property
    def bound(self) -> Bound:
        """How sure it is that no order needs fewer picks."""
        if self.proved:
            return Bound.PROVED
        return Bound.LIKELY if self.likely else Bound.FOUND

    @property
    def picks(self) -> int:
        return len(self.foreseen)

    @property
    def order(self) -> tuple[str, ...]:
        return tuple(pick.name for pick in self.foreseen)

    def to_dict(self) -> dict[str, Any]:
        return {"picks": self.picks, "order": list(self.order), "bound": self.bound.value, **to_plain(self)}

    def verdict(self) -> str:
        """Return the answer in a sentence."""
        if not self.solved:
            if self.proved:
                many = "" if self.limit is None else f"at most {self.limit} "
                return f"No order of {many}{'pick' if self.limit == 1 else 'picks'} leads to the target."
            return f"No order was found; {self.effort()}. A larger budget may find one."
        picks, drops = _count(self.picks, "pick"), _count(self.drops, "drop")
        at_least = f"every order needs at least {_count(self.lower_bound or 0, 'pick')}"
        how_good = {
            Bound.PROVED: "no order does with less (proved)",
            Bound.LIKELY: f"likely the best, not proved: {at_least}",
            Bound.FOUND: f"the best that was found, not proved: {at_least}",
        }[self.bound]
        return f"{picks}, {drops}; {how_good}."

    def effort(self) -> str:
        return f"{_count(self.picks_tried, 'pick')} tried, {_count(self.looks, 'look')}"

    def text(self) -> str:
        """Return the whole answer for people."""
        lines = [f"{self.problem}, seed {self.seed}: {self.verdict()}", ""]
        if self.foreseen and not self.solved:
            lines.append("The most promising beginning:")
        width = max((len(pick.name) for pick in self.foreseen), default=0)
        for number, pick in enumerate(self.foreseen, start=1):
            dropped = f", {_count(len(pick.outcome.dropped), 'drop')}" if pick.outcome.dropped else ""
            after = f"; then {pick.after}" if pick.after else ""
            lines.append(f"  {number:>2}  {pick.name:<{width}}  {pick.outcome.result.value}{dropped}{after}")
        return "\n".join([*lines, "", f"({self.effort()})"])


def answer_from(found: Found[SimulatedState], problem: Problem, seed: int, budget: float) -> OracleAnswer:
    """Make the record of a search's result."""
    path, names = found.best or found.outlook, [placement.name for placement in problem.ordered()]
    # Giving up is not a pick.
    free = int(GIVE_UP in path.choices)
    foreseen = tuple(
        ForeseenPick(choice, PASS_NAME if choice is None else names[choice], state.episode.outcomes[-1], note)
        for choice, state, note in zip(path.choices, path.states[1:], path.notes[1:], strict=True)
        if choice != GIVE_UP
    )
    return OracleAnswer(
        problem=problem.name,
        seed=seed,
        budget=budget,
        solved=found.best is not None,
        foreseen=foreseen,
        drops=path.cost.drops,
        proved=found.proved,
        lower_bound=None if found.bound is None else found.bound.picks - free,
        rough_bound=found.rough_bound - free,
        picks_tried=found.spent.picks,
        looks=found.spent.looks,
        limit=None if found.limit is None else found.limit - problem.absent,
        likely=found.likely,
    )


def _count(number: int, thing: str) -> str:
    return f"{number} {thing}{'' if number == 1 else 's'}"


@dataclass(frozen=True)
class OracleOrder:
    """An order of picks (PASS_NAME where nothing can be picked), and how good it is, in words."""

    names: tuple[str, ...]
    verdict: str


def stated_order(problem: Problem) -> OracleOrder | None:
    """Return the order that a problem's origin states; None if it states none, or one to another target."""
    names = tuple(name for name in str(problem.origin.get(ORDER_KEY, "")).split(", ") if name)
    if not names or not _is_of(problem, names) or not _ends_well(problem, names):
        return None
    return OracleOrder(names, f"{_count(len(names), 'pick')}.")


def orders_from(answers: Path, problems: Iterable[Problem]) -> dict[str, OracleOrder]:
    """Return the orders in a directory of answer files (*.json), by the problem's name; of several seeds the first.

    Answers to other problems are skipped. Raises InputError for invalid or outdated files, or if none fits.
    """
    if not answers.is_dir():
        raise InputError(f"There is no directory '{answers}' of answers; {_WRITERS}.")
    wanted = {problem.name: problem for problem in problems}
    found: list[OracleAnswer] = []
    for path in sorted(answers.glob("*.json")):
        try:
            answer = TypeAdapter(OracleAnswer).validate_json(read_plain_text(path, _MAX_BYTES, "an answer"))
        except ValidationError as error:
            raise InputError(
                f"{path} is not an answer of the oracle; {_WRITERS}:\n{explain_faults(error)}"
            ) from None
        problem = wanted.get(answer.problem)
        if problem is None:
            continue
        if not _is_of(problem, answer.order) or (answer.solved and not _ends_well(problem, answer.order)):
            raise InputError(
                f"{path} names objects that '{problem.name}' does not have, or ends with another target: it was "
                "changed since. Solve it again."
            )
        found.append(answer)
    if not found:
        raise InputError(f"No answer in '{answers}' is to one of these problems; {_WRITERS}.")
    first = {answer.problem: answer for answer in sorted(found, key=lambda a: a.seed, reverse=True)}
    return {name: OracleOrder(a.order if a.solved else (), a.verdict()) for name, a in first.items()}


def _ends_well(problem: Problem, names: tuple[str, ...]) -> bool:
    """True if the order ends with the target; an absent target allows any end."""
    return problem.absent or names[-1:] == (problem.target,)


def _is_of(problem: Problem, names: Iterable[str]) -> bool:
    return set(names) <= {placement.name for placement in problem.objects} | {PASS_NAME}
