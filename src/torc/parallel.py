"""Independent work on all cores that this process may use, in threads.

Only kernels that release the interpreter's lock (`nogil`), and the larger functions of NumPy and SciPy, run side by
side. Every piece of work is done alone and in order, so no result depends on the number of threads.
"""

import os
import threading
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache, partial
from typing import TypeVar

import numpy as np

from torc.processes import threads

_T = TypeVar("_T")
_R = TypeVar("_R")
_PARTS_PER_THREAD = 4
"""Parts differ in effort: a thread that is done early takes another one."""
_here = threading.local()


def each(function: Callable[[_T], _R], items: Iterable[_T]) -> list[_R]:
    """Return the function's results in the order of the items, several at a time. Raises what the function raises.

    Within one of its own calls, it works through the items in the thread that called it. After an exception, items that
    have begun are still worked on.
    """
    todo = list(items)
    if len(todo) < 2 or threads() < 2 or getattr(_here, "working", False):
        return [function(item) for item in todo]
    return list(_pool(threads()).map(partial(_marked, function), todo))


def by_rows(
    kernel: Callable[..., object], columns: Sequence[np.ndarray], *shared: object, least: int = 8
) -> None:
    """Call a kernel that writes its results to some of its arguments for parts of its rows, several at a time.

    Args:
        kernel: called with the same rows of all columns, then with `shared`.
        columns: arrays of one length, its inputs and outputs.
        least: rows per call, at least.
    """
    parts = shares(len(columns[0]), _PARTS_PER_THREAD, least)
    each(lambda rows: kernel(*(column[rows] for column in columns), *shared), parts)


def shares(rows: int, per_thread: int = 1, least: int = 1) -> list[slice]:
    """Return slices that together cover all rows, about equally long: some per thread, one if there is one thread."""
    count = max(1, min(per_thread * threads(), rows // least)) if threads() > 1 else 1
    return [slice(rows * k // count, rows * (k + 1) // count) for k in range(count)]


@cache
def _pool(workers: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(workers, "torc")


def _marked(function: Callable[[_T], _R], item: _T) -> _R:
    """Call the function in a thread of the pool, which must not wait for others of the pool."""
    _here.working = True
    try:
        return function(item)
    finally:
        _here.working = False


def _forget() -> None:
    """Forget the threads, which a forked process does not have."""
    _pool.cache_clear()
    _here.working = False


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget)
