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
    """One call of a `Work`: `log` takes what it prints, and where it was when it crashed or hung."""

    key: str
    argument: Any
    log: Path


class FailureKind(StrEnum):
    """Why there is no answer: the process ended, took too long, asked for too much memory, or raised."""

    CRASHED = "crashed"
    HUNG = "hung"
    MEMORY = "memory"
    RAISED = "raised"


@dataclass(frozen=True)
class Failure:
    """Why a task gave no answer; `text` is a sentence for people."""

    kind: FailureKind
    text: str


@dataclass(frozen=True)
class Ending:
    """A task has ended: with what the work returned, or a Failure."""

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
