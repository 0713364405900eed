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


def reach(start: int, adjacent: Bits) -> int:
    """Return all nodes that can be reached from the set `start`, which is included."""
    reached = todo = start
    while todo:
        low = todo & -todo
        new = adjacent[low.bit_length() - 1] & ~reached
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


def dominators(root: int, order: Sequence[int], backward: Bits) -> Bits:
    """Return, per node of `order`, the nodes that lie on every path from the root to it, itself included.

    Args:
        root: node from which all nodes in `order` can be reached.
        order: the nodes to consider, in any order; close to breadth-first converges fastest.
        backward: predecessors, none outside of `order`.
    """
    everything = sum(1 << v for v in order)
    result = [everything] * len(backward)
    result[root] = 1 << root
    changed = True
    while changed:
        changed = False
        for v in order:
            if v == root:
                continue
            common = everything
            for u in members(backward[v]):
                common &= result[u]
            common |= 1 << v
            if common != result[v]:
                result[v] = common
                changed = True
    return result


def trim(weights: Float[np.ndarray, "n n"], source: int, sinks: Sequence[int]) -> Float[np.ndarray, "n n"]:
    """Zero every edge that no simple path from the source to a sink can use, judged by reachability and dominators.

    An edge goes if one of its ends is out of the source's reach or cannot reach a sink. The edge u -> d goes if d is on
    every way from the source to u: a path that came to u has already been at d. The edge d -> u goes if d is on every
    way from u to a sink: the path would have to come back to d. Repeated until nothing changes. (A complete test is
    NP-hard: two disjoint paths.)
    """
    w = weights.copy()
    while True:
        forward, backward = neighbours(w)
        ends = sum(1 << t for t in sinks)
        kept = reach(1 << source, forward) & reach(ends, backward)
        if not kept >> source & 1:
            return np.zeros_like(w)
        before = np.count_nonzero(w)
        gone = np.array([not kept >> v & 1 for v in range(len(w))])
        w[gone], w[:, gone] = 0.0, 0.0
        _drop_edges_to_dominators(w, source, kept)
        _drop_edges_from_post_dominators(w, ends & kept, kept)
        if np.count_nonzero(w) == before:
            return w


def _drop_edges_to_dominators(w: np.ndarray, source: int, kept: int) -> None:
    forward, backward = neighbours(w)
    result = dominators(source, _breadth_first(source, forward), backward)
    for u in members(kept):
        for d in members(result[u] & forward[u]):
            w[u, d] = 0.0


def _drop_edges_from_post_dominators(w: np.ndarray, ends: int, kept: int) -> None:
    n = len(w)
    forward, backward = neighbours(w)
    # A virtual node n behind all sinks turns this into dominators of the reversed graph.
    backward, forward = [*backward, ends], [*forward, 0]
    for t in members(ends):
        forward[t] |= 1 << n
    if reach(1 << n, backward) & kept != kept:
        return  # the edges dropped just now cut something off; the next round trims it first
    result = dominators(n, _breadth_first(n, backward), forward)
    for u in members(kept):
        for d in members(result[u] & backward[u]):
            w[d, u] = 0.0


def _breadth_first(root: int, adjacent: Bits) -> list[int]:
    order, reached = [root], 1 << root
    for v in order:
        new = adjacent[v] & ~reached
        reached |= new
        order.extend(members(new))
    return order


def strong_parts(weights: Float[np.ndarray, "n n"], nodes: int) -> list[list[int]]:
    """Return the strongly connected parts of the nodes, each before all parts that it leads to."""
    forward, backward = neighbours(weights)
    ahead = {v: reach(1 << v, forward) & nodes for v in members(nodes)}
    parts, left = [], nodes
    # A node that reaches more comes no later than what it reaches; equals belong to one part or are unrelated.
    for v in sorted(ahead, key=lambda v: (-ahead[v].bit_count(), v)):
        if left >> v & 1:
            part = ahead[v] & reach(1 << v, backward) & left
            parts.append(members(part))
            left &= ~part
    return parts
