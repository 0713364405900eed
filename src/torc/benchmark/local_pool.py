"""Tasks over processes of this machine. A crash, a hang or too much memory ends one process, which is replaced."""

import os
import signal
from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack
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
        self._stack = ExitStack()
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
                    running[pool.schedule(carry_out, args=arguments, timeout=limit_s)] = left.popleft()
                done, _ = wait(running, return_when=FIRST_COMPLETED)
                for future in done:
                    outcome = self._outcome(future)
                    yield Ending(running.pop(future).key, outcome)
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
            initializer=set_up,
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
