"""The dependency graph: what must be removed before what (paper: Approach 2).

An edge a -> b means: b has to go before a can be picked. The weights of a node's edges sum to 1. A node without
edges is a sink: nothing known stands in its way.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np
from jaxtyping import Float, Int64, UInt64
from numba import njit

from torc.errors import InputError
from torc.records import TARGET_ID, OcclusionVolume, PlanningContext
from torc.task_planning.relations import Relation, RelationConfig, RelationKind, find_relations

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


@dataclass(frozen=True)
class DependencyNode:
    """An object, or the target that nobody has seen yet.

    Attributes:
        id: object id.
        hidden: True for the target while it is not visible.
        valid_grasps: grasps that could be executed now.
        blocked_grasps: grasps that other objects block.
    """

    id: int
    hidden: bool = False
    valid_grasps: int = 0
    blocked_grasps: int = 0

    @property
    def graspable(self) -> bool:
        """Whether the object could be picked now."""
        return self.valid_grasps > 0


@dataclass(frozen=True)
class DependencyEdge:
    """`target` has to be removed before `source`.

    Attributes:
        source, target: node ids.
        kind: see EdgeKind.
        weight: share among the source's edges, 0..1.
        evidence: numbers it rests on, JSON-compatible.
    """

    source: int
    target: int
    kind: EdgeKind
    weight: float
    evidence: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))


@dataclass(frozen=True)
class DependencyGraph:
    """Nodes by rising id, edges by rising source and target id.

    Attributes:
        nodes: all visible objects, and the target.
        edges: at most one from one node to another.
        target: id of the target's node.

    Raises InputError for edges between unknown nodes, doubled edges, and weights that do not sum to 1.
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
        """The node with that id. Raises KeyError if there is none."""
        for n in self.nodes:
            if n.id == node_id:
                return n
        raise KeyError(f"No node {node_id} in the dependency graph; nodes: {self.ids}.")

    def out_edges(self, node_id: int) -> tuple[DependencyEdge, ...]:
        """What the node waits for."""
        return tuple(e for e in self.edges if e.source == node_id)

    def weight_matrix(self) -> Float[np.ndarray, "n n"]:
        """[i, j]: weight of the edge from nodes[i] to nodes[j], 0 where there is none."""
        index = {k: i for i, k in enumerate(self.ids)}
        weights = np.zeros((len(self.nodes), len(self.nodes)))
        for e in self.edges:
            weights[index[e.source], index[e.target]] = e.weight
        return weights

    def to_dict(self) -> dict[str, Any]:
        """Plain data that `from_dict` takes back, JSON-compatible."""
        return {
            "version": _VERSION,
            "target": self.target,
            "nodes": [
                {
                    "id": n.id,
                    "hidden": n.hidden,
                    "valid_grasps": n.valid_grasps,
                    "blocked_grasps": n.blocked_grasps,
                }
                for n in self.nodes
            ],
            "edges": [
                {
                    "source": e.source,
                    "target": e.target,
                    "kind": e.kind.value,
                    "weight": e.weight,
                    "evidence": dict(e.evidence),
                }
                for e in self.edges
            ],
        }

    @staticmethod
    def from_dict(data: Mapping[str, Any]) -> "DependencyGraph":
        """The graph that `to_dict` wrote. Raises InputError for anything else."""
        try:
            if data["version"] != _VERSION:
                raise InputError(
                    f"Dependency graph of version {data['version']}; this torc reads version {_VERSION}."
                )
            nodes = tuple(
                DependencyNode(
                    int(n["id"]), bool(n["hidden"]), int(n["valid_grasps"]), int(n["blocked_grasps"])
                )
                for n in data["nodes"]
            )
            edges = tuple(
                DependencyEdge(
                    int(e["source"]),
                    int(e["target"]),
                    EdgeKind(e["kind"]),
                    float(e["weight"]),
                    MappingProxyType(dict(e["evidence"])),
                )
                for e in data["edges"]
            )
            return DependencyGraph(nodes, edges, int(data["target"]))
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(f"Not a dependency graph: {type(error).__name__} {error}.") from error


def build_dependency_graph(
    context: PlanningContext,
    config: RelationConfig | None = None,
    relations: Sequence[Relation] | None = None,
) -> DependencyGraph:
    """The dependency graph of a scene, with the authors' precedence of edges.

    A node keeps its 'below' edges only, if it has any; else none if it has a valid grasp; else those of the objects
    that block its grasps, if any are blocked; else its 'behind' edges. An object whose grasps fail only for other
    reasons (out of reach, into the table) has no blocking edges: no removal would help them.

    Args:
        context: scene, occlusion volume and grasp report.
        config: of the relation test; not used with `relations`.
        relations: 'behind' and 'below' pairs from elsewhere (a model that corrected them); found here if None.

    Raises InputError for relations between objects that are not visible.
    """
    scene, report = context.scene, context.report
    hidden = scene.target_id is None
    if hidden and TARGET_ID in scene.ids:
        raise InputError(
            f"Object {TARGET_ID} is visible, but the scene's target is not. Id {TARGET_ID} is the target's."
        )
    if relations is None:
        relations = find_relations(scene, config)
    _check(relations, scene.ids)
    totals = {
        k: (int(v), int(b)) for k, v, b in zip(report.object_ids, report.valid_total, report.blocked_total)
    }
    nodes = [DependencyNode(k, False, *totals.get(k, (0, 0))) for k in scene.ids]
    edges: list[DependencyEdge] = []
    for node in nodes:
        edges += _edges_of(node, relations, context)
    if hidden:
        nodes.insert(0, DependencyNode(TARGET_ID, hidden=True))
        edges = _hidden_by(context) + edges
    target = TARGET_ID if scene.target_id is None else scene.target_id
    return DependencyGraph(tuple(nodes), tuple(sorted(edges, key=lambda e: (e.source, e.target))), target)


def _check(relations: Sequence[Relation], ids: tuple[int, ...]) -> None:
    for r in relations:
        if r.source not in ids or r.target not in ids or r.source == r.target:
            raise InputError(
                f"Relation {r.source} {r.kind} {r.target}: both must be different visible objects of {ids}."
            )


def _edges_of(
    node: DependencyNode, relations: Sequence[Relation], context: PlanningContext
) -> list[DependencyEdge]:
    below = _related(node.id, relations, RelationKind.BELOW, EdgeKind.BELOW)
    if below or node.graspable:
        return below
    blocking = _blocking(node, context)
    return blocking or _related(node.id, relations, RelationKind.BEHIND, EdgeKind.BEHIND)


def _related(
    source: int, relations: Sequence[Relation], kind: RelationKind, edge_kind: EdgeKind
) -> list[DependencyEdge]:
    found = {r.target: r for r in relations if r.source == source and r.kind == kind}
    return [DependencyEdge(source, k, edge_kind, 1 / len(found), r.evidence) for k, r in found.items()]


def _blocking(node: DependencyNode, context: PlanningContext) -> list[DependencyEdge]:
    report = context.report
    if node.blocked_grasps == 0:
        return []
    row = report.blocking[report.object_ids.index(node.id)]
    counts = {
        k: int(n) for k, n in zip(report.object_ids, row) if n > 0 and k != node.id and k in context.scene.ids
    }
    total = sum(counts.values())
    return [
        DependencyEdge(
            node.id,
            k,
            EdgeKind.GRASP_BLOCKING,
            n / total,
            MappingProxyType({"blocks": n, "blocked_grasps": node.blocked_grasps}),
        )
        for k, n in counts.items()
    ]


def _hidden_by(context: PlanningContext) -> list[DependencyEdge]:
    """Edges of the hidden target: by hidden volume; equal ones if no visible object hides anything."""
    ids = context.scene.ids
    volumes = hidden_volumes_m3(context.volume, ids)
    if volumes.sum() <= 0:
        volumes = np.ones(len(ids))
        evidence = [{"hidden_volume_m3": 0.0} for _ in ids]
    else:
        evidence = [{"hidden_volume_m3": round(float(v), 9)} for v in volumes]
    return [
        DependencyEdge(TARGET_ID, k, EdgeKind.HIDDEN_BY, float(v / volumes.sum()), MappingProxyType(e))
        for k, v, e in zip(ids, volumes, evidence)
        if v > 0
    ]


def hidden_volumes_m3(volume: OcclusionVolume, ids: Iterable[int]) -> Float[np.ndarray, "n"]:
    """OcclusionVolume.hidden_volume_m3 of many objects in one pass."""
    counts = _count_bits(volume.hidden_by.ravel())
    return counts[list(ids)] * volume.grid.voxel_size_m**3


@njit(cache=True)
def _count_bits(masks: UInt64[np.ndarray, "n"]) -> Int64[np.ndarray, "64"]:
    """How many of the masks have each bit set."""
    counts = np.zeros(64, np.int64)
    for mask in masks:
        bit = 0
        while mask != np.uint64(0):
            if mask & np.uint64(1):
                counts[bit] += 1
            mask >>= np.uint64(1)
            bit += 1
    return counts
