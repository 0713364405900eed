"""Who carries out tasks: a protocol with one method. `local_pool` does it on this machine."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any, Protocol

Work = Callable[[Any], Any]
"""A function at the top level of a module; argument and answer can be pickled."""


@dataclass(frozen=True)
class Task:
    """One call of a `Work`.

    Attributes:
        key: unique among the tasks.
        argument: what it is called with.
        log: file that takes what the task prints, and where it was when it crashed or hung.
    """

    key: str
    argument: Any
    log: Path


class FailureKind(StrEnum):
    """Why there is no answer."""

    CRASHED = "crashed"
    """The process ended: a segmentation fault, an abort, an exit, or killed from outside."""
    HUNG = "hung"
    """It took longer than it may."""
    MEMORY = "memory"
    """It asked for more memory than it may have."""
    RAISED = "raised"
    """It raised an exception."""


@dataclass(frozen=True)
class Failure:
    """Why a task gave no answer.

    Attributes:
        kind: see FailureKind.
        text: a sentence for people.
    """

    kind: FailureKind
    text: str


@dataclass(frozen=True)
class Ending:
    """A task has ended: its answer, or why there is none.

    Attributes:
        key: the task's.
        outcome: what the work returned, or a Failure.
    """

    key: str
    outcome: Any

    @property
    def failure(self) -> Failure | None:
        """Why there is no answer; None where there is one."""
        return self.outcome if isinstance(self.outcome, Failure) else None


class Backend(Protocol):
    """Carries out tasks, several at a time. A failing task costs nothing but itself."""

    def run(self, work: Work, tasks: Iterable[Task]) -> Iterator[Ending]:
        """An ending per task, as they end. When the caller stops asking, what still runs is stopped."""
        ...
