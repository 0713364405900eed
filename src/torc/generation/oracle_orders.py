"""ORACLE's recorded orders of picks: in answer files, and in the origin of problems chosen by them."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from torc.errors import InputError
from torc.io.reading import read_plain_text
from torc.io.strict_yaml import explain_faults
from torc.oracle.answer import PASS_NAME, OracleAnswer
from torc.problems.problem import Problem

ORDER_KEY = "oracle_order"
"""Key of a problem's origin that holds the order."""
_MAX_BYTES = 1_000_000
_WRITERS = "`torc problems solve PROBLEM --json` and benchmarks/oracle.py write such files"


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
    return OracleOrder(names, f"{len(names)} pick{'' if len(names) == 1 else 's'}.")


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
