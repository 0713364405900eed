"""Compute the probability of each sink: the sum over all simple paths from the target of the product of edge weights.

That is the paper's measure of progress (Approach 2). Enumerating simple paths takes time exponential in the size of the
graph; the general problem is #P-hard. Here the same sum is found without enumeration:

1. edges that no simple path can use are dropped (`trim`), which breaks most
   cycles;
2. a simple path goes through the remaining strongly connected parts one after another and never comes back, so the
   parts are solved one by one, each with the mass that flows in;
3. inside a part, paths with the same future are merged (`path_kernels`).

If a part is too large for the stated amount of work, the answer is an interval that certainly holds the sum, and is
marked as one. It is never an approximation passed off as the sum.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from torc.errors import InputError
from torc.geometry.transforms import kernel_array
from torc.task_planning.path_kernels import MAX_NODES, best_first_sums, merged_sums, subset_sums

Bits = list[int]
"""Per node, the set of its neighbours; bit k for node k. Node sets are Python integers, so graphs may have any size."""
_ROUNDING = 1e-12
"""Added to bounds that come from a linear solve."""
_ADDITION = 0.1
"""Cost of an addition in the sum over subsets, in path extensions (measured)."""


@dataclass(frozen=True)
class PathConfig:
    """How much work the sum may take, in amounts, not times, so that a result never depends on the machine.

    Attributes:
        work_limit: path extensions in all (about 0.1-0.3 us each). Raise it if answers come back inexact and time does
            not matter.
        state_capacity: table size for merged states of one part, a power of two; half of it is used, 21 bytes per
            state.
        subset_nodes: dense parts of up to this many nodes are solved over all their subsets (2**n * n numbers).
    """

    work_limit: int = 150_000
    state_capacity: int = 1 << 17
    subset_nodes: int = 16

    def __post_init__(self) -> None:
        if (
            self.work_limit < 1
            or self.state_capacity < 256
            or self.state_capacity & (self.state_capacity - 1)
        ):
            raise InputError("work_limit must be positive and state_capacity a power of two of at least 256.")
        if not 0 <= self.subset_nodes <= 20:
            raise InputError(
                f"subset_nodes must lie in 0..20, not {self.subset_nodes}: memory grows as 2**n."
            )


@dataclass(frozen=True)
class SinkProbabilities:
    """p(sink) for each sink of a graph; `lower` and `upper` are equal where the sum is exact.

    Attributes:
        sinks: node indices without outgoing edges, rising.
        lower, upper: certain bounds of each sink's sum.
        exact: True if the sums are exact (to rounding).
        bound_hit: which limit was hit, in words; empty if exact.
        work: path extensions done.
    """

    sinks: tuple[int, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    exact: bool
    bound_hit: str
    work: int

    def __getitem__(self, sink: int) -> float:
        """Return the sum of one sink; its lower bound if it is not exact."""
        return self.lower[self.sinks.index(sink)]

    @property
    def lost(self) -> float:
        """Mass of simple paths into a cycle without a way out; an upper bound if the sums are inexact."""
        return max(0.0, 1.0 - sum(self.lower))

    def decided_among(self, sinks: tuple[int, ...]) -> bool:
        """Check whether the most probable of these sinks is certain; True if there are none."""
        index = [self.sinks.index(s) for s in sinks]
        if self.exact or len(index) < 2:
            return True
        best = max(index, key=lambda i: self.lower[i])
        return all(self.upper[i] <= self.lower[best] for i in index if i != best)


def sink_probabilities(
    weights: Float[np.ndarray, "n n"], source: int, config: PathConfig | None = None
) -> SinkProbabilities:
    """Return the sum over all simple paths from the source to each sink of the product of the weights on the path.

    Args:
        weights: weights[i, j] of the edge i -> j, 0 for no edge; each row sums to at most 1. Rows without weight are
            sinks.
        source: where all paths start; a source without edges is itself the sink, with probability 1.
        config: limits; see PathConfig.

    Raises:
        InputError: weights are negative, not finite, or sum to more than 1.
    """
    config = PathConfig() if config is None else config
    weights = _checked(weights, source)
    sinks = [int(v) for v in np.flatnonzero(~weights.any(axis=1))]
    w = trim(weights, source, sinks)
    lower, upper = np.zeros(len(w)), np.zeros(len(w))
    lower[source] = upper[source] = 1.0
    work, hits = 0, []
    kept = (1 << source) | sum(1 << int(v) for v in np.flatnonzero(w.any(axis=0)))
    for part in strong_parts(w, kept):
        through, through_upper, done, hit = _through_part(
            w, part, lower, upper, config, config.work_limit - work
        )
        lower[part], upper[part] = through, through_upper
        work += done
        hits += [hit] if hit else []
        onward = w[part].copy()
        onward[:, part] = 0.0
        lower += through @ onward
        upper += through_upper @ onward
    low = lower[sinks]
    high = np.maximum(upper[sinks], low) if hits else low
    return SinkProbabilities(
        tuple(sinks), tuple(low.tolist()), tuple(high.tolist()), not hits, "; ".join(hits), work
    )


def rehearse_paths() -> None:
    """Run every kernel once, on a cycle in which the first method gives up and each of the other two takes over."""
    weights = np.full((6, 6), 0.2)
    np.fill_diagonal(weights, 0.0)
    weights[5] = 0.0
    for subset_nodes in (5, 0):
        sink_probabilities(weights, 0, PathConfig(work_limit=20, subset_nodes=subset_nodes))


def _checked(weights: np.ndarray, source: int) -> np.ndarray:
    w = np.array(weights, dtype=float)
    if w.ndim != 2 or w.shape[0] != w.shape[1] or not 0 <= source < len(w):
        raise InputError(
            f"Weights of shape {w.shape} with source {source}: need a square matrix and one of its nodes."
        )
    if not np.isfinite(w).all() or (w < 0).any() or (w.sum(axis=1) > 1 + 1e-9).any():
        raise InputError("Edge weights must be finite, not negative, and sum to at most 1 per node.")
    return w


def _through_part(
    w: np.ndarray, part: list[int], lower: np.ndarray, upper: np.ndarray, config: PathConfig, work_left: int
) -> tuple[np.ndarray, np.ndarray, int, str]:
    """Return bounds of the mass of all simple paths to each node of the part, the work done, and the bound hit.

    `lower` and `upper` hold, at the part's nodes, the mass that flows in.
    """
    if len(part) == 1:
        return lower[part], upper[part], 0, ""
    inner = kernel_array(w[np.ix_(part, part)])
    leaves = w[part].any(axis=1) & (w[part].sum(axis=1) - inner.sum(axis=1) > 0)
    entry = lower[part]
    total, waiting, work, hit = _sums(inner, leaves, entry, config, work_left)
    top = total + waiting @ _first_visits(inner) if hit else total
    if np.any(upper[part] > entry):
        # The sums are linear in the mass that flows in, so uncertain inflow is sent through separately.
        more, more_waiting, more_work, more_hit = _sums(
            inner, leaves, upper[part] - entry, config, work_left - work
        )
        top = top + more + (more_waiting @ _first_visits(inner) if more_hit else 0.0)
        work, hit = work + more_work, hit or more_hit
    return total, top, work, hit


def _sums(
    inner: np.ndarray, leaves: np.ndarray, entry: np.ndarray, config: PathConfig, work_left: int
) -> tuple[np.ndarray, np.ndarray, int, str]:
    """Return the sums inside one part, the mass left waiting, the work, and the bound hit in words."""
    n = len(inner)
    nothing = np.zeros(n)
    if n > MAX_NODES:
        return nothing, entry, 0, f"a cycle of {n} objects is larger than the {MAX_NODES} that fit a bit mask"
    successors, predecessors = (np.array(bits, dtype=np.uint64) for bits in neighbours(inner))
    exits = np.uint64(sum(1 << int(v) for v in np.flatnonzero(leaves)))
    by_subsets = int(n * 2.0 ** (n - 1) * np.count_nonzero(inner) / (2 * n) * _ADDITION)
    limit = max(1, min(work_left // 2, by_subsets))
    total, waiting, work = merged_sums(
        inner, successors, predecessors, exits, entry, limit, config.state_capacity
    )
    if waiting.any() and n <= config.subset_nodes and by_subsets <= work_left - work:
        total, additions = subset_sums(inner, successors, entry)
        return total, nothing, work + int(additions * _ADDITION), ""
    if waiting.any():
        # Large masses first bounds the rest best; merging no longer helps.
        limit = max(1, work_left - work)
        total, waiting, more = best_first_sums(inner, successors, predecessors, exits, entry, limit)
        work += more
    if not waiting.any():
        return total, nothing, work, ""
    return (
        total,
        waiting,
        work,
        (
            f"work limit of {config.work_limit} path extensions hit in a cycle of {n} objects, "
            f"with {waiting.sum():.2g} of the probability unexplored"
        ),
    )


def _first_visits(inner: np.ndarray) -> Float[np.ndarray, "n n"]:
    """Return [v, x]: the probability that a random walk from v ever visits x, inside the part.

    It is at least the sum over the simple paths from v to x, which are the walks that visit no node twice.
    """
    visits = np.linalg.inv(np.eye(len(inner)) - inner)
    return np.clip(visits / np.diag(visits), 0.0, 1.0) + _ROUNDING


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
