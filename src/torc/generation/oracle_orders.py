"""ORACLE's orders of picks as they were kept: in answer files, and in the origin of problems chosen by them."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from torc.episode.oracle.answer import PASS_NAME, OracleAnswer
from torc.errors import InputError
from torc.files.reading import read_bytes
from torc.problems.problem import Problem

ORDER_KEY = "oracle_order"
"""Where a problem's origin holds the order."""
_MAX_BYTES = 1_000_000
_WRITERS = "`torc problems solve PROBLEM --json` and benchmarks/oracle.py write such files"


@dataclass(frozen=True)
class OracleOrder:
    """An order of picks for a problem.

    Attributes:
        names: what is picked, in order; PASS_NAME where nothing can be.
        verdict: how good it is, in words.
    """

    names: tuple[str, ...]
    verdict: str


def join_order(names: Iterable[str]) -> str:
    """As an order is written into a problem's origin."""
    return ", ".join(names)


def stated_order(problem: Problem) -> OracleOrder | None:
    """The order that a problem's origin states; None if it states none, or one to another target."""
    names = tuple(name for name in str(problem.origin.get(ORDER_KEY, "")).split(", ") if name)
    if not names or not _is_of(problem, names) or names[-1] != problem.target:
        return None
    return OracleOrder(names, f"{len(names)} pick{'' if len(names) == 1 else 's'}.")


def orders_from(answers: Path, problems: Iterable[Problem]) -> dict[str, OracleOrder]:
    """The orders in a directory of answer files, by the problem's name; of several seeds the first.

    Args:
        answers: its *.json files are answers; those to other problems are passed over.
        problems: whose orders are wanted.

    Raises:
        InputError: no such directory, a file that is no answer, an answer to a problem that had other objects or
            another target, or no answer to any of these problems.
    """
    if not answers.is_dir():
        raise InputError(f"There is no directory '{answers}' of answers; {_WRITERS}.")
    wanted = {problem.name: problem for problem in problems}
    found: dict[str, OracleAnswer] = {}
    for path in sorted(answers.glob("*.json")):
        answer = _read(path)
        problem = wanted.get(answer.problem)
        if problem is None:
            continue
        if not _is_of(problem, answer.order):
            raise InputError(
                f"{path} names objects that '{problem.name}' does not have: it was changed since. Solve it again."
            )
        if answer.solved and answer.order[-1] != problem.target:
            raise InputError(
                f"{path} ends with '{answer.order[-1]}', but the target of '{problem.name}' is '{problem.target}': it "
                "was changed since. Solve it again."
            )
        if answer.problem not in found or answer.seed < found[answer.problem].seed:
            found[answer.problem] = answer
    if not found:
        raise InputError(f"No answer in '{answers}' is to one of these problems; {_WRITERS}.")
    return {name: OracleOrder(a.order if a.solved else (), a.verdict()) for name, a in found.items()}


def _is_of(problem: Problem, names: Iterable[str]) -> bool:
    return set(names) <= {placement.name for placement in problem.objects} | {PASS_NAME}


def _read(path: Path) -> OracleAnswer:
    content = read_bytes(path, _MAX_BYTES, "an answer of the oracle")
    try:
        return TypeAdapter(OracleAnswer).validate_json(content)
    except ValidationError as error:
        fault = error.errors()[0]
        where = ".".join(map(str, fault["loc"]))
        raise InputError(
            f"{path} is not an answer of the oracle ({where + ': ' if where else ''}{fault['msg']}); {_WRITERS}."
        ) from None
