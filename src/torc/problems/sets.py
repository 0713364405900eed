"""The shipped problem sets: `torc40` compares task planners, `validation` is for tuning them, and `validation-ur5e` and
`validation-panda` are made for other robots. Sets may form a group: `torc-hard/absent` is a set of harder problems,
`torc-hard` the group of all of them.
"""

import os
from functools import cache
from pathlib import Path

from torc.errors import InputError, UnknownNameError

_SHIPPED = Path(__file__).parent / "data"


@cache
def problem_sets() -> tuple[str, ...]:
    """Return the names of the shipped sets."""
    return tuple(sorted({_set_of(path) for path in _paths().values()}))


def is_problem_set(name: str) -> bool:
    """True if this is a shipped set, or a group of them."""
    return any(name in (known, known.split("/")[0]) for known in problem_sets())


def problem_names(problem_set: str | None = None) -> tuple[str, ...]:
    """Return the names of shipped problems.

    Args:
        problem_set: a set ("torc40"), a group of sets ("torc-hard"), or None for all problems.

    Raises:
        UnknownNameError: there is no such set.
    """
    if problem_set is not None and not is_problem_set(problem_set):
        raise UnknownNameError("problem set", problem_set, list(problem_sets()))
    wanted = [known for known in problem_sets() if problem_set in (None, known, known.split("/")[0])]
    return tuple(name for known in wanted for name, path in _paths().items() if _set_of(path) == known)


def shipped_path(name: str) -> Path | None:
    """Return the file of a shipped problem; None if there is none of that name."""
    return _paths().get(name)


def set_of(name: str) -> str | None:
    """Return the shipped set with the problem of that name, e.g. "torc-hard/absent"; None if there is none."""
    path = shipped_path(name)
    return None if path is None else _set_of(path)


def select_problems(selection: str) -> tuple[str, ...]:
    """Return the problems that a user selected, as names or paths for `load_problem`. Raises InputError.

    A selection holds, separated by commas, shipped sets, shipped problems, problem files, and directories of them.
    """
    chosen: list[str] = []
    for part in (p.strip() for p in selection.split(",") if p.strip()):
        if is_problem_set(part):
            chosen += problem_names(part)
        elif part in _paths() or os.path.isfile(part):  # False for names that no file can have
            chosen.append(part)
        elif os.path.isdir(part):
            files = sorted(str(p) for p in Path(part).glob("*.yaml"))
            if not files:
                raise InputError(f"There is no problem file (*.yaml) in '{part}'.")
            chosen += files
        else:
            raise UnknownNameError(
                "problem or problem set", part, [*problem_sets(), *_paths()], lister="torc problems list"
            )
    if not chosen:
        raise InputError(f"No problems are named in '{selection}'. `torc problems list` shows what there is.")
    return tuple(dict.fromkeys(chosen))


@cache
def _paths() -> dict[str, Path]:
    return {p.stem: p for p in sorted(_SHIPPED.rglob("*.yaml"), key=lambda p: (p.parent, p.stem))}


def _set_of(path: Path) -> str:
    """Return the name of a file's set, e.g. "torc40" or "torc-hard/absent"."""
    return path.parent.relative_to(_SHIPPED).as_posix()
