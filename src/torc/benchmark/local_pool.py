"""Tasks over processes of this machine. A crash, a hang or too much memory ends one process, which is replaced."""

import os
import re
import signal
from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from multiprocessing import get_context
from typing import Any

from pebble import ProcessExpired, ProcessPool

from torc.benchmark.dispatch import Ending, Failure, FailureKind, Task, Work
from torc.benchmark.worker import carry_out, set_up
from torc.errors import TorcError
from torc.processes import one_thread_each

_TASKS_PER_PROCESS = 100
"""A process is replaced after so many, so that what libraries leak does not add up."""
_STARTS = 4
"""How often the pool may break down without any task having ended in between."""

_DUMP_BEGINS = re.compile(rb"Timeout \(\d+:\d\d:\d\d(\.\d+)?\)!\s*$")
"""With what faulthandler begins to write down where a process is that hangs, maybe behind an unfinished line."""


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


@dataclass(frozen=True)
class _Running:
    """A task that is being carried out, and how many bytes an earlier try left in its log."""

    task: Task
    logged: int


class LocalPool:
    """A `Backend` on this machine's cores.

    Args:
        config: how tasks are carried out.
        stay: the processes wait for the next `run`, until `close`.
    """

    def __init__(self, config: PoolConfig, stay: bool = False) -> None:
        self.config, self._stay = config, stay
        self._stack = ExitStack()
        self._pool: ProcessPool | None = None

    def run(self, work: Work, tasks: Iterable[Task]) -> Iterator[Ending]:
        """An ending per task, as they end.

        Raises:
            TorcError: processes end as soon as they start.
        """
        left, starts = deque(tasks), 0
        while left:
            starts += 1
            if starts > _STARTS:
                raise TorcError("The worker processes end as soon as they start. `torc doctor` may tell why.")
            for ending in self._until_it_breaks(work, left):
                starts = 0
                yield ending

    def close(self) -> None:
        """End the processes."""
        self._pool = None
        self._stack.close()

    def _until_it_breaks(self, work: Work, left: deque[Task]) -> Iterator[Ending]:
        """Endings until no tasks are left, or the pool broke down: unfinished tasks are back in `left` then."""
        pool = self._pool = self._pool or self._stack.enter_context(_open_pool(self.config))
        running: dict[Future[Any], _Running] = {}
        try:
            while left or running:
                # One task more than there are processes: none waits for work.
                while left and len(running) <= self.config.workers:
                    task = left.popleft()
                    before = task.log.stat().st_size if task.log.exists() else 0
                    running[self._schedule(pool, work, task)] = _Running(task, before)
                done, _ = wait(running, return_when=FIRST_COMPLETED)
                for future in done:
                    try:
                        outcome = self._outcome(future, running[future])
                    except BrokenProcessPool:
                        return
                    yield Ending(running.pop(future).task.key, outcome)
        finally:
            left.extendleft(r.task for r in running.values())
            if running or not self._stay:
                self.close()

    def _schedule(self, pool: ProcessPool, work: Work, task: Task) -> Future[Any]:
        arguments = (work, task.argument, task.log, self.config.limit_s)
        try:
            future: Future[Any] = pool.schedule(carry_out, args=arguments, timeout=self.config.limit_s)
        except RuntimeError as error:  # the pool's word for "broken down"
            future = Future()
            future.set_exception(BrokenProcessPool(str(error)))
        return future

    def _outcome(self, future: Future[Any], running: _Running) -> Any:
        """What the work returned, or a Failure. Raises BrokenProcessPool."""
        error = future.exception()
        if error is None:
            return future.result()
        if isinstance(error, BrokenProcessPool):
            raise error
        # The dump reads the stacks of threads that run on meanwhile, and now and then crashes by that.
        crashed_in_dump = isinstance(error, ProcessExpired) and error.exitcode < 0 and _dump_begun(running)
        if isinstance(error, TimeoutError) or crashed_in_dump:
            text = f"It was ended after {self.config.limit_s:g} s without an answer."
            return Failure(FailureKind.HUNG, text)
        if isinstance(error, ProcessExpired):
            return Failure(FailureKind.CRASHED, f"Its process {_death(error.exitcode)}.")
        return Failure(FailureKind.RAISED, f"{type(error).__name__}: {error}")


@contextmanager
def _open_pool(config: PoolConfig) -> Iterator[ProcessPool]:
    """Processes that wait for work; all end with the context."""
    with one_thread_each():
        pool = ProcessPool(
            config.workers,
            _TASKS_PER_PROCESS,
            initializer=set_up,
            initargs=(config.memory_bytes, os.getpid()),
            context=get_context("spawn"),
        )
        try:
            yield pool
        finally:
            pool.stop()
            pool.join()


def _dump_begun(running: _Running) -> bool:
    """Whether the log tells that its process was written down as hanging."""
    try:
        with open(running.task.log, "rb") as lines:
            lines.seek(running.logged)
            return any(_DUMP_BEGINS.search(line) for line in lines)
    except OSError:
        return False


def _death(code: int) -> str:
    if code < 0:
        try:
            return f"was ended by {signal.Signals(-code).name}"
        except ValueError:
            return f"was ended by signal {-code}"
    return f"ended with code {code}"
