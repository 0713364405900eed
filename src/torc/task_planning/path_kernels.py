"""Compiled sums over simple paths inside one strongly connected part of a graph.

All kernels solve the same problem: mass enters the part at its nodes; F[v] is the sum over all simple paths that
start at a node with mass and end at v, of that mass times the product of the weights on the path. Node sets are
64-bit masks. Every integer is kept unsigned on purpose: numba turns a mixture of int64 and uint64 into floats.
"""

import numpy as np
from jaxtyping import Float, UInt64
from numba import njit

MAX_NODES = 64
"""A part with more nodes does not fit the masks."""

_ZERO, _ONE = np.uint64(0), np.uint64(1)
_M1, _M2 = np.uint64(0x5555555555555555), np.uint64(0x3333333333333333)
_M4, _H01 = np.uint64(0x0F0F0F0F0F0F0F0F), np.uint64(0x0101010101010101)
_MIX = np.uint64(0x9E3779B97F4A7C15)


@njit(cache=True, inline="always")
def _signed(x: np.uint64) -> int:
    return np.int64(x)  # type: ignore[return-value]


@njit(cache=True, inline="always")
def _popcount(x: np.uint64) -> int:
    x = x - ((x >> _ONE) & _M1)
    x = (x & _M2) + ((x >> np.uint64(2)) & _M2)
    x = (x + (x >> np.uint64(4))) & _M4
    return _signed((x * _H01) >> np.uint64(56))


@njit(cache=True, inline="always")
def _lowest(x: np.uint64) -> int:
    """Return the index of the lowest set bit."""
    return _popcount((x & (~x + _ONE)) - _ONE)


@njit(cache=True)
def _closure(start: np.uint64, adjacent: UInt64[np.ndarray, "n"], allowed: np.uint64) -> np.uint64:
    """Return the nodes of `allowed` that can be reached from the set `start`, which is included."""
    reached = start
    todo = start
    while todo != _ZERO:
        v = _lowest(todo)
        todo &= todo - _ONE
        new = adjacent[v] & allowed & ~reached
        reached |= new
        todo |= new
    return reached


@njit(cache=True)
def _still_useful(
    w: int,
    free: np.uint64,
    successors: UInt64[np.ndarray, "n"],
    predecessors: UInt64[np.ndarray, "n"],
    exits: np.uint64,
) -> np.uint64:
    """Return the free nodes that a simple path from w to an exit may still visit, including w; 0 without an exit."""
    ahead = _closure(_ONE << np.uint64(w), successors, free)
    if ahead & exits == _ZERO:
        return _ZERO
    return _closure(ahead & exits, predecessors, ahead)


@njit(cache=True)
def subset_sums(
    weights: Float[np.ndarray, "n n"], successors: UInt64[np.ndarray, "n"], entry: Float[np.ndarray, "n"]
) -> tuple[Float[np.ndarray, "n"], int]:
    """Compute F by dynamic programming over all subsets of nodes, and count the additions. For few nodes, dense."""
    n = len(entry)
    size = 1 << n
    mass = np.zeros((size, n))
    total = np.zeros(n)
    work = 0
    for v in range(n):
        mass[1 << v, v] = entry[v]
    for subset in range(1, size):
        visited = np.uint64(subset)
        members = visited
        while members != _ZERO:
            v = _lowest(members)
            members &= members - _ONE
            m = mass[subset, v]
            if m == 0.0:
                continue
            total[v] += m
            onward = successors[v] & ~visited
            while onward != _ZERO:
                w = _lowest(onward)
                onward &= onward - _ONE
                mass[subset | (1 << w), w] += m * weights[v, w]
                work += 1
    return total, work


@njit(cache=True)
def _slot(node: int, rest: np.uint64, nodes: np.ndarray, rests: np.ndarray, capacity: int) -> int:
    """Return the slot of the state (node, rest) in the open-addressing table: its own or a free one (node -1)."""
    key = (rest ^ (np.uint64(node + 1) * _MIX)) * _MIX
    i = _signed((key ^ (key >> np.uint64(29))) & np.uint64(capacity - 1))
    while nodes[i] >= 0 and (nodes[i] != node or rests[i] != rest):
        i += 1
        if i == capacity:
            i = 0
    return i


@njit(cache=True)
def merged_sums(
    weights: Float[np.ndarray, "n n"],
    successors: UInt64[np.ndarray, "n"],
    predecessors: UInt64[np.ndarray, "n"],
    exits: np.uint64,
    entry: Float[np.ndarray, "n"],
    work_limit: int,
    capacity: int,
) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"], int]:
    """Compute F by extending paths, merging those with equal futures.

    Two paths that stand at the same node and may still visit the same nodes before an exit have the same future,
    whatever they visited before: they are one state, and their masses add. States are processed by falling number of
    nodes still to visit, which shrinks with each step, so each state is expanded once, with its full mass.

    Returns:
        F; the mass left unexpanded at each node when the limit (extensions) or the table (states, half of `capacity`, a
        power of two) is exhausted, otherwise all zero; and the extensions done.
    """
    n = len(entry)
    total = np.zeros(n)
    waiting = np.zeros(n)
    nodes = np.full(capacity, -1, dtype=np.int8)
    rests = np.zeros(capacity, dtype=np.uint64)
    mass = np.zeros(capacity)
    following = np.full(capacity, -1, dtype=np.int32)
    heads = np.full(n + 1, -1, dtype=np.int32)
    everything = (~_ZERO) if n == 64 else (_ONE << np.uint64(n)) - _ONE
    states, work, stopped = 0, 0, False
    for v in range(n):
        if entry[v] > 0.0:
            rest = _still_useful(v, everything, successors, predecessors, exits)
            if rest == _ZERO:
                continue
            i = _slot(v, rest, nodes, rests, capacity)
            nodes[i], rests[i], mass[i] = v, rest, entry[v]
            level = _popcount(rest)
            following[i] = heads[level]
            heads[level] = i
            states += 1
    for level in range(n, 0, -1):
        i = heads[level]
        while i >= 0:
            v = int(nodes[i])
            m = mass[i]
            if stopped:
                waiting[v] += m
                i = following[i]
                continue
            total[v] += m
            free = rests[i] & ~(_ONE << np.uint64(v))
            onward = successors[v] & free
            while onward != _ZERO:
                w = _lowest(onward)
                onward &= onward - _ONE
                rest = _still_useful(w, free, successors, predecessors, exits)
                work += 1
                if rest == _ZERO:
                    continue
                j = _slot(w, rest, nodes, rests, capacity)
                if nodes[j] < 0:
                    nodes[j], rests[j] = w, rest
                    below = _popcount(rest)
                    following[j] = heads[below]
                    heads[below] = j
                    states += 1
                mass[j] += m * weights[v, w]
            stopped = work >= work_limit or states + n >= capacity // 2
            i = following[i]
    return total, waiting, work


@njit(cache=True)
def _sift_down(heap: np.ndarray, size: int, keys: np.ndarray) -> None:
    i = 0
    while True:
        child = 2 * i + 1
        if child >= size:
            return
        if child + 1 < size and keys[heap[child + 1]] > keys[heap[child]]:
            child += 1
        if keys[heap[i]] >= keys[heap[child]]:
            return
        heap[i], heap[child] = heap[child], heap[i]
        i = child


@njit(cache=True)
def _sift_up(heap: np.ndarray, i: int, keys: np.ndarray) -> None:
    while i > 0:
        parent = (i - 1) // 2
        if keys[heap[parent]] >= keys[heap[i]]:
            return
        heap[i], heap[parent] = heap[parent], heap[i]
        i = parent


@njit(cache=True)
def best_first_sums(
    weights: Float[np.ndarray, "n n"],
    successors: UInt64[np.ndarray, "n"],
    predecessors: UInt64[np.ndarray, "n"],
    exits: np.uint64,
    entry: Float[np.ndarray, "n"],
    work_limit: int,
) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"], int]:
    """Compute F of the paths with the largest mass: path prefixes are extended in that order, without merging.

    Returns as `merged_sums` does; the sums are complete when no mass is left unexpanded.
    """
    n = len(entry)
    total = np.zeros(n)
    waiting = np.zeros(n)
    room = work_limit + 2 * n + 1
    nodes = np.zeros(room, dtype=np.int8)
    rests = np.zeros(room, dtype=np.uint64)
    mass = np.zeros(room)
    heap = np.zeros(room, dtype=np.int32)
    everything = (~_ZERO) if n == 64 else (_ONE << np.uint64(n)) - _ONE
    made, size, work = 0, 0, 0
    for v in range(n):
        rest = _still_useful(v, everything, successors, predecessors, exits)
        if entry[v] > 0.0 and rest != _ZERO:
            nodes[made], rests[made], mass[made], heap[size] = v, rest, entry[v], made
            _sift_up(heap, size, mass)
            made += 1
            size += 1
    while size > 0 and work < work_limit:
        i = heap[0]
        size -= 1
        heap[0] = heap[size]
        _sift_down(heap, size, mass)
        v = int(nodes[i])
        total[v] += mass[i]
        free = rests[i] & ~(_ONE << np.uint64(v))
        onward = successors[v] & free
        while onward != _ZERO:
            w = _lowest(onward)
            onward &= onward - _ONE
            rest = _still_useful(w, free, successors, predecessors, exits)
            work += 1
            if rest != _ZERO:
                nodes[made], rests[made], mass[made], heap[size] = w, rest, mass[i] * weights[v, w], made
                _sift_up(heap, size, mass)
                made += 1
                size += 1
    for k in range(size):
        waiting[nodes[heap[k]]] += mass[heap[k]]
    return total, waiting, work
