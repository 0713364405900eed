"""Run tasks in several processes. A crash, a hang or too much memory ends one process, which is replaced."""

import contextlib
import faulthandler
import io
import os
import signal
import sys
import traceback
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from enum import StrEnum
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Protocol

from pebble import ProcessExpired, ProcessPool

from torc.errors import TorcError
from torc.processes import end_with, one_thread_each

_TASKS_PER_PROCESS = 100
"""A process is replaced after this many, so that leaks of libraries do not add up."""
_STARTS = 4
"""How often the pool may break down in a row without a task having ended."""
Work = Callable[[Any], Any]
"""A function at the top level of a module; argument and answer can be pickled."""


@dataclass(frozen=True)
class Task:
    """One call of a `Work`. `log` receives what it prints, and where it was when it crashed or hung."""

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
    """The end of a task: what the work returned, or a Failure."""

    key: str
    outcome: Any

    @property
    def failure(self) -> Failure | None:
        """Why there is no answer; None if there is one."""
        return self.outcome if isinstance(self.outcome, Failure) else None


class Backend(Protocol):
    """Runs tasks, several at a time. A failing task affects no other."""

    def run(self, work: Work, tasks: Iterable[Task]) -> Iterator[Ending]:
        """Yield an ending per task, as they end. If the caller stops iterating, running tasks are stopped."""
        ...


class ThisProcess:
    """A `Backend` that runs one task after another in this process."""

    def run(self, work: Work, tasks: Iterable[Task]) -> Iterator[Ending]:
        """Yield an ending per task, in order. Exceptions of a task pass through."""
        for task in tasks:
            task.log.parent.mkdir(parents=True, exist_ok=True)
            yield Ending(task.key, work(task.argument))


@dataclass(frozen=True)
class PoolConfig:
    """Processes of one thread each, seconds after which a task is ended, and bytes of address space of a process."""

    workers: int = 1
    limit_s: float = 1800.0
    memory_bytes: int | None = 8 * 2**30


class LocalPool:
    """A `Backend` on this machine's cores. With `stay` the processes wait for the next `run`, until `close`."""

    def __init__(self, config: PoolConfig, stay: bool = False) -> None:
        self.config, self._stay = config, stay
        self._stack = contextlib.ExitStack()
        self._pool: ProcessPool | None = None

    def run(self, work: Work, tasks: Iterable[Task]) -> Iterator[Ending]:
        """Yield an ending per task, as they end. Raises TorcError if processes end as soon as they start."""
        left, starts, limit_s = {task.key: task for task in tasks}, 0, self.config.limit_s
        while left:
            starts += 1
            if starts > _STARTS:
                raise TorcError("The worker processes end as soon as they start. `torc doctor` may tell why.")
            pool = self._opened()
            try:
                running: dict[Future[Any], str] = {}
                for key, task in left.items():
                    arguments = (work, task.argument, task.log, limit_s)
                    running[pool.schedule(_carry_out, args=arguments, timeout=limit_s)] = key
                for ended in as_completed(running):
                    outcome, starts = self._outcome(ended), 0
                    del left[running[ended]]
                    yield Ending(running[ended], outcome)
            except (BrokenProcessPool, RuntimeError):  # the latter from `schedule`
                pass
            finally:
                if left or not self._stay:
                    self.close()

    def close(self) -> None:
        self._pool = None
        self._stack.close()

    def _opened(self) -> ProcessPool:
        if self._pool is not None:
            return self._pool
        self._stack.enter_context(one_thread_each())
        pool = self._pool = ProcessPool(
            self.config.workers,
            _TASKS_PER_PROCESS,
            initializer=_set_up,
            initargs=(self.config.memory_bytes, os.getpid()),
            context=get_context("spawn"),
        )
        self._stack.callback(pool.join)
        self._stack.callback(pool.stop)
        return pool

    def _outcome(self, future: Future[Any]) -> Any:
        """Return what the work returned, or a Failure. Raises BrokenProcessPool."""
        try:
            return future.result()
        except BrokenProcessPool:
            raise
        except TimeoutError:
            text = f"It was ended after {self.config.limit_s:g} s without an answer."
            return Failure(FailureKind.HUNG, text)
        except ProcessExpired as error:
            code, names = error.exitcode, {-s.value: s.name for s in signal.Signals}
            by = names.get(code, f"signal {-code}")
            death = f"was ended by {by}" if code < 0 else f"ended with code {code}"
            return Failure(FailureKind.CRASHED, f"Its process {death}.")
        except Exception as error:
            return Failure(FailureKind.RAISED, f"{type(error).__name__}: {error}")


def _set_up(memory_bytes: int | None, parent: int) -> None:
    """Bound the address space of a worker, and end it with the parent process. Called once in every worker."""
    end_with(parent)
    if memory_bytes is None:
        return
    with contextlib.suppress(ImportError, ValueError, OSError):  # Windows has no limit, macOS by name only
        import resource

        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        limit = memory_bytes if hard == resource.RLIM_INFINITY else min(memory_bytes, hard)
        resource.setrlimit(resource.RLIMIT_AS, (limit, hard))


def _carry_out(work: Work, argument: Any, log: Path, limit_s: float) -> Any:
    """Return the work's answer, or a Failure if it raised: user-defined exceptions may not survive pickling.

    Everything it prints, also from native code, goes to the log, and so do the tracebacks of crashes.
    """
    with _output_to(log):
        faulthandler.enable()
        # Shortly before the pool ends a process that hangs: the log shows where it hung.
        faulthandler.dump_traceback_later(max(0.5 * limit_s, limit_s - 5.0))
        try:
            return work(argument)
        except (Exception, SystemExit) as error:  # user-defined code may raise anything
            traceback.print_exc()
            if isinstance(error, MemoryError):
                return Failure(FailureKind.MEMORY, "It asked for more memory than it may have.")
            text = str(error) if isinstance(error, TorcError) else f"{type(error).__name__}: {error}"
            return Failure(FailureKind.RAISED, text)
        finally:
            faulthandler.cancel_dump_traceback_later()


@contextlib.contextmanager
def _output_to(path: Path) -> Iterator[None]:
    """Redirect standard output and errors of the process into a file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    kept = os.dup(1), os.dup(2)
    if isinstance(sys.stdout, io.TextIOWrapper):
        # Python buffers what is not printed to a terminal: a crash would lose it.
        sys.stdout.reconfigure(line_buffering=True)
    with open(path, "ab", buffering=0) as log:
        for number in (1, 2):
            os.dup2(log.fileno(), number)
        try:
            yield
        finally:
            for stream, number, before in ((sys.stdout, 1, kept[0]), (sys.stderr, 2, kept[1])):
                with contextlib.suppress(OSError, ValueError):
                    stream.flush()
                os.dup2(before, number)
                os.close(before)
