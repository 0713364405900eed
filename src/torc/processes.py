"""Child processes that share the cores."""

import contextlib
import ctypes
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import get_context

from torc.errors import TorcError

_PR_SET_PDEATHSIG = 1
_THREADS = "OMP_NUM_THREADS"
_ALONE = {
    _THREADS: "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "NUMBA_NUM_THREADS": "1",
    "OPENCV_FOR_THREADS_NUM": "1",
    "LP_NUM_THREADS": "0",  # of Mesa, drawing in software: beside the calling one
}
"""Variables by which libraries use one thread."""


def threads() -> int:
    """Return how many threads this process may use: 1 in a worker, else one per core that it may run on.

    The environment variable OMP_NUM_THREADS sets another number: say so where a container may use fewer cores than it
    sees. No result depends on it. While a pool of workers is open, this process, too, uses one.
    """
    given = os.environ.get(_THREADS, "").partition(",")[0]
    if given.isdecimal():
        return max(1, int(given))
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1


@contextmanager
def one_thread_each() -> Iterator[None]:
    """Provide an environment in which child processes use one thread each.

    They share the cores: threads of the linear algebra would only wait for each other, which costs a third of the time.
    Sums also no longer depend on the number of cores. The libraries read the environment when they are loaded.
    """
    before = {name: os.environ[name] for name in _ALONE if name in os.environ}
    os.environ.update(_ALONE)
    try:
        yield
    finally:
        for name in _ALONE:
            os.environ.pop(name, None)
        os.environ.update(before)


@contextmanager
def open_pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Provide processes of one thread each, which end with this one, even if it is killed.

    Raises:
        TorcError: one of them was ended from outside.
    """
    context, here = get_context("spawn"), os.getpid()
    with one_thread_each(), ProcessPoolExecutor(workers, context, end_with, (here,)) as pool:
        try:
            yield pool
        except BrokenProcessPool:
            raise TorcError(
                "A worker process was ended from outside, perhaps for lack of memory. What was finished is kept: call "
                "the same again, if need be with fewer --workers."
            ) from None


def end_with(parent: int) -> None:
    """End this process when its parent, of that id, is gone, even killed: nobody would read its answers."""
    if sys.platform == "linux":
        with contextlib.suppress(OSError, AttributeError):
            ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    threading.Thread(target=_watch, args=(parent,), daemon=True).start()


def _watch(parent: int) -> None:
    # For systems without a signal for it, and parents that were gone before it was requested.
    while os.getppid() == parent:
        time.sleep(1.0)
    os._exit(1)
