"""Tasks over processes of this machine. A crash, a hang or too much memory ends one process, which is replaced."""

import contextlib
import faulthandler
import io
import os
import signal
import sys
import traceback
from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from pebble import ProcessExpired, ProcessPool

from torc.benchmark.dispatch import Ending, Failure, FailureKind, Task, Work
from torc.errors import TorcError
from torc.processes import end_with, one_thread_each

_TASKS_PER_PROCESS = 100
"""A process is replaced after so many, so that what libraries leak does not add up."""
_STARTS = 4
"""How often the pool may break down without any task having ended in between."""


@dataclass(frozen=True)
class PoolConfig:
    """How tasks are carried out.

    Attributes:
        workers: processes, of one thread each.
        limit_s: a task that takes longer is ended.
        memory_bytes: bound on the address space of a process, where the system has one; None for none.
    """

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
        """An ending per task, as they end. Raises TorcError: processes end as soon as they start."""
        left, starts = deque(tasks), 0
        while left:
            starts += 1
            if starts > _STARTS:
                raise TorcError("The worker processes end as soon as they start. `torc doctor` may tell why.")
            for ending in self._until_it_breaks(work, left):
                starts = 0
                yield ending

    def _until_it_breaks(self, work: Work, left: deque[Task]) -> Iterator[Ending]:
        """Endings until no tasks are left, or the pool broke down: unfinished tasks are back in `left` then."""
        pool, limit_s = self._opened(), self.config.limit_s
        running: dict[Future[Any], Task] = {}
        try:
            while left or running:
                # One task more than there are processes: none waits for work.
                while left and len(running) <= self.config.workers:
                    arguments = (work, left[0].argument, left[0].log, limit_s)
                    future = pool.schedule(_carry_out, args=arguments, timeout=limit_s)
                    running[future] = left.popleft()
                done, _ = wait(running, return_when=FIRST_COMPLETED)
                for ended in done:
                    outcome = self._outcome(ended)
                    yield Ending(running.pop(ended).key, outcome)
        except (BrokenProcessPool, RuntimeError):  # the latter from `schedule`
            pass
        finally:
            left.extendleft(running.values())
            if running or not self._stay:
                self.close()

    def close(self) -> None:
        """End the processes."""
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
        """What the work returned, or a Failure. Raises BrokenProcessPool."""
        error = future.exception()
        if error is None:
            return future.result()
        if isinstance(error, BrokenProcessPool):
            raise error
        if isinstance(error, TimeoutError):
            text = f"It was ended after {self.config.limit_s:g} s without an answer."
            return Failure(FailureKind.HUNG, text)
        if isinstance(error, ProcessExpired):
            return Failure(FailureKind.CRASHED, f"Its process {_death(error.exitcode)}.")
        return Failure(FailureKind.RAISED, f"{type(error).__name__}: {error}")


def _death(code: int) -> str:
    known = {s.value: s.name for s in signal.Signals}
    return f"ended with code {code}" if code >= 0 else f"was ended by {known.get(-code, f'signal {-code}')}"


def _set_up(memory_bytes: int | None, parent: int) -> None:
    """Called once in every worker: a bound on the address space, and no life without the parent process."""
    end_with(parent)
    if memory_bytes is None:
        return
    with contextlib.suppress(ImportError, ValueError, OSError):  # Windows has no limit, macOS by name only
        import resource

        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        limit = memory_bytes if hard == resource.RLIM_INFINITY else min(memory_bytes, hard)
        resource.setrlimit(resource.RLIMIT_AS, (limit, hard))


def _carry_out(work: Work, argument: Any, log: Path, limit_s: float) -> Any:
    """The answer of the work, or the Failure of what it raised: strangers' exceptions may not survive the way back.

    All that it prints, natively too, goes to the log, and so do the tracebacks of crashes.
    """
    with _output_to(log):
        faulthandler.enable()
        # Shortly before the pool ends a process that hangs: the log tells where it hung.
        faulthandler.dump_traceback_later(max(0.5 * limit_s, limit_s - 5.0))
        try:
            return work(argument)
        except (Exception, SystemExit) as error:  # somebody's code: anything may come
            traceback.print_exc()
            if isinstance(error, MemoryError):
                return Failure(FailureKind.MEMORY, "It asked for more memory than it may have.")
            text = str(error) if isinstance(error, TorcError) else f"{type(error).__name__}: {error}"
            return Failure(FailureKind.RAISED, text)
        finally:
            faulthandler.cancel_dump_traceback_later()


@contextlib.contextmanager
def _output_to(path: Path) -> Iterator[None]:
    """Standard output and errors of the process into a file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    kept = os.dup(1), os.dup(2)
    if isinstance(sys.stdout, io.TextIOWrapper):
        # Python keeps back what is not printed to a terminal: a crash would swallow it.
        sys.stdout.reconfigure(line_buffering=True)
    with open(path, "ab", buffering=0) as log:
        os.dup2(log.fileno(), 1)
        os.dup2(log.fileno(), 2)
        try:
            yield
        finally:
            for stream in (sys.stdout, sys.stderr):
                with contextlib.suppress(OSError, ValueError):
                    stream.flush()
            os.dup2(kept[0], 1)
            os.dup2(kept[1], 2)
            os.close(kept[0])
            os.close(kept[1])
