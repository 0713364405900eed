"""Tasks over processes of this machine. A crash, a hang or too much memory ends one process, which is replaced."""

import os
import re
import signal
from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from pebble import ProcessExpired, ProcessPool

from torc.benchmark.dispatch import Ending, Failure, FailureKind, Task, Work
from torc.benchmark.worker import carry_out, set_up
from torc.errors import TorcError
from torc.processes import one_thread_each

_TASKS_PER_PROCESS = 100
"""A process is replaced after so many, so that what libraries leak does not add up."""
STARTS = 4
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


class LocalPool:
    """A `Backend` on this machine's cores."""

    def __init__(self, config: PoolConfig) -> None:
        self.config = config

    def run(self, work: Work, tasks: Iterable[Task]) -> Iterator[Ending]:
        """An ending per task, as they end.

        Raises:
            TorcError: processes end as soon as they start.
        """
        left, starts = deque(tasks), 0
        while left:
            starts += 1
            if starts > STARTS:
                raise no_start()
            for ending in self._one_pool(work, left):
                starts = 0
                yield ending

    def _one_pool(self, work: Work, left: deque[Task]) -> Iterator[Ending]:
        """Endings until no tasks are left, or the pool broke down: unfinished tasks are back in `left` then."""
        with open_processes(self.config) as processes:
            running: dict[Future[Any], Task] = {}
            try:
                while left or running:
                    # One task more than there are processes: none waits for work.
                    while left and len(running) <= self.config.workers:
                        task = left.popleft()
                        running[processes.schedule(work, task)] = task
                    done, _ = wait(running, return_when=FIRST_COMPLETED)
                    for future in done:
                        try:
                            outcome = processes.outcome(future)
                        except BrokenProcessPool:
                            return
                        yield Ending(running.pop(future).key, outcome)
            finally:
                left.extendleft(running.values())


class Processes:
    """A pool that is open: until it breaks down, it answers every task or says why there is no answer."""

    def __init__(self, config: PoolConfig, pool: ProcessPool) -> None:
        self._config, self._pool = config, pool
        self._logs: dict[Future[Any], tuple[Path, int]] = {}
        """Per task its log, and how much of it was there before."""

    def schedule(self, work: Work, task: Task) -> Future[Any]:
        """What `outcome` takes, once it is done."""
        before = task.log.stat().st_size if task.log.exists() else 0  # of an earlier try
        arguments = (work, task.argument, task.log, self._config.limit_s)
        try:
            future: Future[Any] = self._pool.schedule(carry_out, args=arguments, timeout=self._config.limit_s)
        except RuntimeError as error:  # the pool's word for "broken down"
            future = Future()
            future.set_exception(BrokenProcessPool(str(error)))
        self._logs[future] = task.log, before
        return future

    def outcome(self, future: Future[Any]) -> Any:
        """What the work returned, or a Failure; waits for it. Raises BrokenProcessPool: open another."""
        error, log = future.exception(), self._logs.pop(future)
        if error is None:
            return future.result()
        if isinstance(error, BrokenProcessPool):
            raise error
        # The dump reads the stacks of threads that run on meanwhile, and now and then crashes by that.
        crashed_in_dump = isinstance(error, ProcessExpired) and error.exitcode < 0 and _dump_begun(*log)
        if isinstance(error, TimeoutError) or crashed_in_dump:
            text = f"It was ended after {self._config.limit_s:g} s without an answer."
            return Failure(FailureKind.HUNG, text)
        if isinstance(error, ProcessExpired):
            return Failure(FailureKind.CRASHED, f"Its process {_death(error.exitcode)}.")
        return Failure(FailureKind.RAISED, f"{type(error).__name__}: {error}")


@contextmanager
def open_processes(config: PoolConfig) -> Iterator[Processes]:
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
            yield Processes(config, pool)
        finally:
            pool.stop()
            pool.join()


def no_start() -> TorcError:
    """Why a pool is given up after STARTS breakdowns."""
    return TorcError("The worker processes end as soon as they start. `torc doctor` may tell why.")


def _dump_begun(log: Path, start: int) -> bool:
    """Whether the log tells, after so many bytes, that its process was written down as hanging."""
    try:
        with open(log, "rb") as lines:
            lines.seek(start)
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
