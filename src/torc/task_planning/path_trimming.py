"""Find the edges that a simple path from a source to a sink can use, and the parts that remain.

Node sets are Python integers used as bit sets, so graphs may have any size.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

Bits = list[int]
"""Per node, the set of its neighbours; bit k for node k."""


def members(bits: int) -> list[int]:
    """Return the nodes of a set, rising."""
    out = []
    while bits:
        low = bits & -bits
        out.append(low.bit_length() - 1)
        bits ^= low
    return out


def reach(start: int, adjacent: Bits, allowed: int) -> int:
    """Return all nodes of `allowed` that can be reached within it from the set `start`."""
    reached = todo = start & allowed
    while todo:
        low = todo & -todo
        new = adjacent[low.bit_length() - 1] & allowed & ~reached
        reached |= new
        todo = (todo ^ low) | new
    return reached


def neighbours(weights: Float[np.ndarray, "n n"]) -> tuple[Bits, Bits]:
    """Return successors and predecessors per node."""
    n = len(weights)
    forward, backward = [0] * n, [0] * n
    for i, j in zip(*np.nonzero(weights)):
        forward[i] |= 1 << int(j)
        backward[j] |= 1 << int(i)
    return forward, backward


def trim(weights: Float[np.ndarray, "n n"], source: int, sinks: Sequence[int]) -> Float[np.ndarray, "n n"]:
    """Zero edges that no simple path from the source to a sink can use.

    An edge goes if one of its ends is out of the source's reach or cannot reach a sink. The edge u -> d goes if d is on
    every way from the source to u: a path that came to u has already been at d. The edge d -> u goes if d is on every
    way from u to a sink: the path would have to come back to d. Repeated until nothing changes. (A complete test is
    NP-hard: two disjoint paths.)
    """
    w = weights.copy()
    start, ends, everything = 1 << source, sum(1 << t for t in sinks), (1 << len(w)) - 1
    while True:
        forward, backward = neighbours(w)
        kept = reach(start, forward, everything) & reach(ends, backward, everything)
        before = np.count_nonzero(w)
        for d in range(len(w)):
            others = kept & ~(1 << d) if kept >> d & 1 else 0
            w[members(backward[d] & ~reach(start, forward, others)), d] = 0.0
            w[d, members(forward[d] & ~reach(ends, backward, others))] = 0.0
        if np.count_nonzero(w) == before:
            return w


def strong_parts(weights: Float[np.ndarray, "n n"], nodes: int) -> list[list[int]]:
    """Return the strongly connected parts of the nodes, each before all parts that it leads to."""
    forward, backward = neighbours(weights)
    ahead = {v: reach(1 << v, forward, nodes) for v in members(nodes)}
    parts, left = [], nodes
    # A node that reaches more comes no later than what it reaches; equals belong to one part or are unrelated.
    for v in sorted(ahead, key=lambda v: (-ahead[v].bit_count(), v)):
        if left >> v & 1:
            part = ahead[v] & reach(1 << v, backward, left)
            parts.append(members(part))
            left &= ~part
    return parts
