"""Common parts of the conformance suites."""

import difflib
import pickle
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from torc.errors import TorcError
from torc.registry.context import BuildContext
from torc.registry.kinds import Kind, declarable
from torc.registry.loading import trait_faults as registry_faults


class NonConformanceError(TorcError, AssertionError):
    """A part broke its protocol's rules; the text lists case and rule."""


@dataclass(frozen=True)
class Case:
    """A situation that a part must handle; `build` makes the part's input."""

    name: str
    build: Callable[[], Any]


def require(part: str, broken: Iterable[str]) -> None:
    """Raise NonConformanceError with everything that was broken, if anything was."""
    listed = "\n- ".join(dict.fromkeys(broken))
    if listed:
        raise NonConformanceError(f"This {part} does not conform:\n- {listed}")


def called_twice(call: Callable[[], Any], given: object, what: str) -> tuple[list[Any], list[str]]:
    """Call a part twice; return the results and the rules that it broke. `what` names its input, `given`."""
    before, drawn = pickle.dumps(given), str(np.random.get_state())
    try:
        results = [call(), call()]
    except (Exception, SystemExit) as error:  # any exception of a user's part is the finding
        return [], [f"it raised {type(error).__name__}: {error}"]
    found = []
    if pickle.dumps(given) != before:
        found.append(f"it changed {what}")
    if str(np.random.get_state()) != drawn:
        found.append("it drew from numpy's global random generator")
    return results, found


def made(make: Callable[..., Any], context: BuildContext) -> Any:
    """Make a part with what it takes of a context, like the `torc` command."""
    return make(**context.given_to(make))


def trait_faults(kind: Kind[Any], part: object) -> list[str]:
    """Return the faults of the traits that a part declares, misspelt names included."""
    found = list(registry_faults(kind, part))
    known = [name for name, default in declarable(kind.base).items() if isinstance(default, bool)]
    theirs = [vars(c) for c in type(part).__mro__ if not c.__module__.startswith(("torc.", "builtins"))]
    for name in sorted({name for names in theirs for name in names} - {*declarable(kind.base)}):
        near = [] if name.startswith("_") else difflib.get_close_matches(name, known, n=1, cutoff=0.85)
        found += [f"it has an attribute `{name}`, which nobody reads: did you mean `{n}`?" for n in near]
    return found


def unit_faults(depth_m: np.ndarray) -> list[str]:
    """Return the faults of the readings of a depth image of a table."""
    good = np.isfinite(depth_m) & (depth_m > 0)
    if not good.any():
        return ["no pixel has a depth"]
    far = np.median(depth_m[good]) > 20
    return ["depths are above 20 m: they must be metres, not millimetres"] if far else []
