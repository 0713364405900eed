"""The dependency graph: what must be removed before what (paper: Approach 2).

An edge a -> b means: b has to go before a can be picked. The weights of a node's edges sum to 1. A node without
edges is a sink: nothing known stands in its way. `graph_building` makes the graph of a scene.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float
from pydantic import TypeAdapter

from torc.errors import InputError
from torc.io.record_files import to_plain

_VERSION = 1


class EdgeKind(StrEnum):
    """Why the edge's target has to go before its source."""

    BELOW = "below"
    """The source lies below the target."""
    GRASP_BLOCKING = "grasp blocking"
    """The target is in the way of the source's grasps."""
    BEHIND = "behind"
    """The source is behind the target."""
    HIDDEN_BY = "hidden by"
    """The source, the hidden target, may be in the space that the edge's target hides."""
    MAY_BE = "may be"
    """The source, the unrecognised target, may be the edge's target."""


@dataclass(frozen=True)
class DependencyNode:
    """An object, or the target before anyone has seen it.

    Attributes:
        id: object id.
        hidden: True for the target while it is not visible.
        valid_grasps: grasps that could be executed now, likely enough to hold (`Pipeline.min_score`).
        blocked_grasps: grasps that other objects block.
    """

    id: int
    hidden: bool = False
    valid_grasps: int = 0
    blocked_grasps: int = 0

    @property
    def graspable(self) -> bool:
        """True if the object can be picked now."""
        return self.valid_grasps > 0


@dataclass(frozen=True)
class DependencyEdge:
    """`target` has to be removed before `source`.

    Attributes:
        source, target: object ids.
        kind: why.
        weight: in a graph, share among the source's edges, 0..1; 1 for a relation that is not in a graph yet.
        evidence: JSON-compatible numbers that it rests on.
    """

    source: int
    target: int
    kind: EdgeKind
    weight: float = 1.0
    evidence: Mapping[str, Any] = field(default_factory=dict)


_NODES, _EDGES = TypeAdapter(tuple[DependencyNode, ...]), TypeAdapter(tuple[DependencyEdge, ...])


@dataclass(frozen=True)
class DependencyGraph:
    """A dependency graph (paper: Approach 2). An edge a -> b means that b must be removed before a.

    Attributes:
        nodes: all visible objects and the target, by rising id.
        edges: at most one from one node to another, by rising source and target id. The weights of a node's edges sum
            to 1.
        target: id of the target's node.

    Raises:
        InputError: an edge joins unknown nodes, edges are doubled, or weights do not sum to 1.
    """

    nodes: tuple[DependencyNode, ...]
    edges: tuple[DependencyEdge, ...]
    target: int

    def __post_init__(self) -> None:
        ids = self.ids
        if len(set(ids)) != len(ids) or self.target not in ids:
            raise InputError(
                f"A dependency graph needs distinct node ids and its target {self.target}; it has {ids}."
            )
        pairs = [(e.source, e.target) for e in self.edges]
        for source, target in pairs:
            if source not in ids or target not in ids or source == target:
                raise InputError(f"Edge {source} -> {target} does not join two nodes of {ids}.")
        if len(set(pairs)) != len(pairs):
            raise InputError("A dependency graph has at most one edge from one node to another.")
        for source in {e.source for e in self.edges}:
            weights = [e.weight for e in self.edges if e.source == source]
            if min(weights) <= 0 or abs(sum(weights) - 1) > 1e-9:
                raise InputError(
                    f"The weights of node {source}'s edges must be positive and sum to 1, not {weights}."
                )

    @cached_property
    def ids(self) -> tuple[int, ...]:
        """Node ids, in the order of the nodes."""
        return tuple(n.id for n in self.nodes)

    @cached_property
    def sinks(self) -> tuple[int, ...]:
        """Ids of the nodes that depend on nothing."""
        sources = {e.source for e in self.edges}
        return tuple(i for i in self.ids if i not in sources)

    def node(self, node_id: int) -> DependencyNode:
        """Return the node with that id. Raises KeyError if there is none."""
        for n in self.nodes:
            if n.id == node_id:
                return n
        raise KeyError(f"No node {node_id} in the dependency graph; nodes: {self.ids}.")

    def out_edges(self, node_id: int) -> tuple[DependencyEdge, ...]:
        """Return the edges to what the node waits for."""
        return tuple(e for e in self.edges if e.source == node_id)

    def weight_matrix(self) -> Float[np.ndarray, "n n"]:
        """Return the weights: [i, j] is that of the edge from nodes[i] to nodes[j], 0 if there is none."""
        index = {k: i for i, k in enumerate(self.ids)}
        weights = np.zeros((len(self.nodes), len(self.nodes)))
        for e in self.edges:
            weights[index[e.source], index[e.target]] = e.weight
        return weights

    def to_dict(self) -> dict[str, Any]:
        """Return JSON-compatible data for `from_dict`."""
        facts = {"target": self.target, "nodes": self.nodes, "edges": self.edges}
        return {"version": _VERSION, **to_plain(facts)}

    @staticmethod
    def from_dict(data: Mapping[str, Any]) -> "DependencyGraph":
        """Read what `to_dict` returned. Raises InputError for anything else."""
        try:
            if data["version"] != _VERSION:
                raise InputError(
                    f"Dependency graph of version {data['version']}; this torc reads version {_VERSION}."
                )
            nodes, edges = _NODES.validate_python(data["nodes"]), _EDGES.validate_python(data["edges"])
            return DependencyGraph(nodes, edges, int(data["target"]))
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(f"Not a dependency graph: {type(error).__name__} {error}.") from error
