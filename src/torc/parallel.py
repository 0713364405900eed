"""Independent work on all cores that this process may use, in threads.

Only kernels that release the interpreter's lock (`nogil`), and the larger functions of NumPy and SciPy, run side by
side. Every piece of work is done alone and in order, so no result depends on the number of threads.
"""

import threading
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache, partial
from itertools import pairwise
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

    Within one of its own calls, it works through the items in the thread that called it.
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
    n = len(columns[0])
    parts = max(1, min(_PARTS_PER_THREAD * threads(), n // least)) if threads() > 1 else 1
    ends = [n * k // parts for k in range(parts + 1)]
    each(lambda rows: kernel(*(c[rows[0] : rows[1]] for c in columns), *shared), pairwise(ends))


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
