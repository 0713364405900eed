"""Lay out a dependency graph on paper: layers from the target downwards, few crossings.

The usual layered scheme: break cycles, layer by longest path, put invisible waypoints where an edge skips layers, order
each layer by the mean place of its neighbours, and spread the columns.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import TypeAlias

import numpy as np
from scipy.optimize import isotonic_regression

from torc.records.graph import DependencyGraph

_Item: TypeAlias = int | tuple[int, int, int]
_Links: TypeAlias = dict[_Item, tuple[list[_Item], list[_Item]]]
_SWEEPS = 12


@dataclass(frozen=True)
class Layout:
    """The (column, row) of each node id, row 0 at the top; the waypoints of each edge (source, target), ends included;
    and the extent.
    """

    places: dict[int, tuple[float, int]]
    routes: dict[tuple[int, int], tuple[tuple[float, int], ...]]
    columns: float
    rows: int


def lay_out(graph: DependencyGraph) -> Layout:
    """Return the layout of a graph: the target on top, every other node below those that wait for it."""
    edges = [(e.source, e.target) for e in graph.edges]
    backward = _backward_edges(graph, edges)
    forward = [(b, a) if (a, b) in backward else (a, b) for a, b in edges]
    layer = _layers(graph, forward)
    # An edge's items from layer to layer: its ends, and a waypoint (a, b, row) on each layer between.
    chains: dict[tuple[int, int], list[_Item]] = {
        (a, b): [a, *((a, b, row) for row in range(layer[a] + 1, layer[b])), b]
        for a, b in sorted(set(forward))
    }
    rows: list[list[_Item]] = [[] for _ in range(max(layer.values()) + 1)]
    for node in sorted(graph.ids, key=lambda k: (k != graph.target, k)):
        rows[layer[node]].append(node)
    for (a, _), chain in chains.items():
        for row, way in enumerate(chain[1:-1], start=layer[a] + 1):
            rows[row].append(way)
    links: _Links = {}
    for chain in chains.values():
        for above, below in pairwise(chain):
            links.setdefault(above, ([], []))[1].append(below)
            links.setdefault(below, ([], []))[0].append(above)
    column = _columns(rows, links)
    place = {item: (column[item], row) for row, items in enumerate(rows) for item in items}
    routes = {}
    for a, b in edges:
        chain = chains[(a, b)] if (a, b) not in backward else chains[(b, a)][::-1]
        routes[(a, b)] = tuple(place[item] for item in chain)
    widest = max((c for c, _ in place.values()), default=0.0) + 1
    return Layout({k: place[k] for k in graph.ids}, routes, widest, len(rows))


def _backward_edges(graph: DependencyGraph, edges: list[tuple[int, int]]) -> set[tuple[int, int]]:
    """Return the edges into the target, and those that close a cycle on a depth-first walk from it and the others."""
    backward = {(a, b) for a, b in edges if b == graph.target}
    following = {k: sorted(b for a, b in edges if a == k and b != graph.target) for k in graph.ids}
    path: list[int] = []
    done: set[int] = set()

    def walk(node: int) -> None:
        path.append(node)
        for onward in following[node]:
            if onward in path:
                backward.add((node, onward))
            elif onward not in done:
                walk(onward)
        done.add(path.pop())

    for root in (graph.target, *graph.ids):
        if root not in done:
            walk(root)
    return backward


def _layers(graph: DependencyGraph, forward: list[tuple[int, int]]) -> dict[int, int]:
    """Return each node's longest path from any node without a predecessor; only the target is kept on top."""
    layer = _pushed_down(dict.fromkeys(graph.ids, 0), forward)
    for k in graph.ids:
        below = [layer[b] for a, b in forward if a == k]
        if k != graph.target and layer[k] == 0:
            layer[k] = max(1, min(below, default=2) - 1)
    return _pushed_down(layer, forward)


def _pushed_down(layer: dict[int, int], forward: list[tuple[int, int]]) -> dict[int, int]:
    """Move each node at least one layer below those that lead to it."""
    for _ in layer:
        for a, b in forward:
            layer[b] = max(layer[b], layer[a] + 1)
    return layer


def _columns(rows: list[list[_Item]], links: _Links) -> dict[_Item, float]:
    """Return a column per item: ordered by the neighbours' mean column above or below, alternately, kept apart."""
    column = {item: float(i) for row in rows for i, item in enumerate(row)}
    for sweep in range(_SWEEPS):
        down = sweep % 2 == 0
        for row in rows if down else rows[::-1]:
            wish = {}
            for item in row:
                linked = links.get(item, ([], []))[0 if down else 1]
                wish[item] = sum(column[n] for n in linked) / len(linked) if linked else column[item]
            row.sort(key=lambda item: (round(wish[item], 9), str(item)))
            column.update(_spread([wish[item] for item in row], row))
    least = min(column.values(), default=0.0)
    return {item: c - least for item, c in column.items()}


def _spread(wishes: list[float], items: list[_Item]) -> dict[_Item, float]:
    """Return columns as close to the wishes as the gaps allow, in the given order; waypoints take less room."""
    gaps = [1.0 if isinstance(a, int) and isinstance(b, int) else 0.6 for a, b in pairwise(items)]
    offsets = np.concatenate([[0.0], np.cumsum(gaps)])[: len(items)]
    placed = isotonic_regression(np.array(wishes) - offsets).x if items else offsets
    return dict(zip(items, (placed + offsets).tolist()))
