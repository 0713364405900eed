"""Spread independent work of one process over its threads."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from torc.processes import threads

T = TypeVar("T")
R = TypeVar("R")


def side_by_side(function: Callable[[T], R], items: Sequence[T]) -> list[R]:
    """Return function(item) per item, in order, computed in as many threads as this process may use.

    Threads gain time only where the function releases Python's lock, as numpy, OpenCV, onnxruntime and kernels with
    `nogil` do. The first exception passes through.
    """
    count = min(threads(), len(items))
    if count < 2:
        return [function(item) for item in items]
    with ThreadPoolExecutor(count) as pool:
        return list(pool.map(function, items))


def shares(n: int) -> list[slice]:
    """Return one slice of n rows per thread, about equally long."""
    count = min(threads(), n)
    return [slice(n * k // count, n * (k + 1) // count) for k in range(count)]
