"""From what a task planner sees to the dependency graph, with the authors' precedence of edges (paper: Approach 2)."""

from collections.abc import Sequence
from types import MappingProxyType

import numpy as np

from torc.errors import InputError
from torc.occlusion.hidden_space import hidden_volumes_m3
from torc.records import TARGET_ID, PlanningContext
from torc.task_planning.graph import DependencyEdge, DependencyGraph, DependencyNode, EdgeKind
from torc.task_planning.relations import Relation, RelationConfig, RelationKind, find_relations


def build_dependency_graph(
    context: PlanningContext,
    config: RelationConfig | None = None,
    relations: Sequence[Relation] | None = None,
) -> DependencyGraph:
    """The dependency graph of a scene, with the authors' precedence of edges.

    A node keeps its 'below' edges only, if it has any; else none if it has a valid grasp; else those of the objects
    that block its grasps, if any are blocked; else its 'behind' edges. An object whose grasps fail only for other
    reasons (out of reach, into the table) has no blocking edges: no removal would help them. Grasps that are held
    back as unlikely (`Pipeline.min_score`) are no valid ones here either.

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
