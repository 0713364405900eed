"""Build the dependency graph from what a task planner sees, with the authors' precedence (paper: Approach 2)."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from torc.errors import InputError
from torc.occlusion.volume import hidden_near_m3, hidden_volumes_m3
from torc.records import PlanningContext, SegmentedScene
from torc.records.derived import once
from torc.records.graph import DependencyEdge, DependencyGraph, DependencyNode, EdgeKind
from torc.task_planning.relations import RelationConfig, find_relations

REACH_M = 0.05
"""How far around the visible part of the target its hidden part may be."""
WORTH = 0.01
"""Objects less likely than this to be the target are not suspected."""


def build_dependency_graph(
    context: PlanningContext,
    config: RelationConfig | None = None,
    relations: Sequence[DependencyEdge] | None = None,
) -> DependencyGraph:
    """Build the dependency graph of a scene with the authors' precedence of edges (paper: Approach 2).

    A node keeps only its 'below' edges if it has any. Otherwise it keeps none if it has a valid grasp; else edges to
    the objects that block its grasps, if any grasp is blocked; else its 'behind' edges. An object whose grasps fail for
    other reasons (out of reach, into the table) gets no blocking edges, since no removal would help them. Grasps held
    back as unlikely (`Pipeline.min_score`) do not count as valid.

    Two rules go beyond the paper. A visible target without a valid grasp and without edges gets 'hidden by' edges to
    whatever hides the space around it, since too little of it is in sight. An unrecognised target may be in sight: it
    'may be' each visible object with the probability that perception gives (`KnownObject.target_p`), and is hidden with
    the remaining probability.

    Args:
        context: what a planner sees. The graph is built once per context and config.
        config: settings of the relation test; ignored if `relations` are given.
        relations: 'behind' and 'below' pairs, e.g. corrected by a model; found here if None.

    Returns:
        The graph: one node per visible object, and one for the target if it is hidden.

    Raises:
        InputError: a relation names an object that is not visible.
    """
    if relations is not None:
        return _built(context, relations)
    config = RelationConfig() if config is None else config
    return once(context, ("graph", config), lambda: _built(context, find_relations(context.scene, config)))


def _built(context: PlanningContext, relations: Sequence[DependencyEdge]) -> DependencyGraph:
    scene, report = context.scene, context.report
    target, hidden = scene.target_number, scene.target_id is None
    if hidden and target in scene.ids:
        raise InputError(
            f"Object {target} is visible, but the scene's target is not. Id {target} is the target's."
        )
    for r in relations:
        if r.source not in scene.ids or r.target not in scene.ids or r.source == r.target:
            raise InputError(
                f"Relation {r.source} {r.kind} {r.target}: both must be different visible objects of {scene.ids}."
            )
    totals = dict(zip(report.object_ids, zip(report.valid_total.tolist(), report.blocked_total.tolist())))
    nodes = [DependencyNode(k, False, *totals.get(k, (0, 0))) for k in scene.ids]
    edges = [edge for node in nodes for edge in _edges_of(node, relations, context)]
    if hidden:
        nodes.insert(0, DependencyNode(target, hidden=True))
        edges = _or_in_sight(_hidden_by(context), context.scene) + edges
    elif all(n.id != target or not n.graspable for n in nodes) and all(e.source != target for e in edges):
        edges += _hides_more_of(target, context)
    return DependencyGraph(tuple(nodes), tuple(sorted(edges, key=lambda e: (e.source, e.target))), target)


def _edges_of(
    node: DependencyNode, relations: Sequence[DependencyEdge], context: PlanningContext
) -> list[DependencyEdge]:
    below = _related(node.id, relations, EdgeKind.BELOW)
    if below or node.graspable:
        return below
    return _blocking(node, context) or _related(node.id, relations, EdgeKind.BEHIND)


def _related(source: int, relations: Sequence[DependencyEdge], kind: EdgeKind) -> list[DependencyEdge]:
    found = {r.target: r for r in relations if r.source == source and r.kind == kind}
    return [replace(r, kind=kind, weight=1 / len(found)) for r in found.values()]


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
            {"blocks": n, "blocked_grasps": node.blocked_grasps},
        )
        for k, n in counts.items()
    ]


def _hidden_by(context: PlanningContext) -> list[DependencyEdge]:
    """Return the edges of the hidden target, by hidden volume; equal ones if no visible object hides anything."""
    ids, target = context.scene.ids, context.scene.target_number
    volumes = hidden_volumes_m3(context.volume, ids)
    if volumes.sum() > 0:
        return _by_volume(target, ids, volumes)
    nothing = {"hidden_volume_m3": 0.0}
    return [DependencyEdge(target, k, EdgeKind.HIDDEN_BY, 1 / len(ids), nothing) for k in ids]


def _or_in_sight(edges: list[DependencyEdge], scene: SegmentedScene) -> list[DependencyEdge]:
    """Return the edges of a hidden target that may also be an object in sight: one to each, of the likelier kind."""
    p, hidden = suspects_of(scene)
    if not p:
        return edges
    by_id = {e.target: e for e in edges}
    found = []
    for k in scene.ids:
        share = hidden * by_id[k].weight if k in by_id else 0.0
        both = share + p.get(k, 0.0)
        if both == 0:
            continue
        evidence = dict(by_id[k].evidence) | {"hidden_share": by_id[k].weight} if share > 0 else {}
        if k in p:
            evidence["target_p"] = round(p[k], 4)
        kind = EdgeKind.HIDDEN_BY if share > p.get(k, 0.0) else EdgeKind.MAY_BE
        found.append(DependencyEdge(scene.target_number, k, kind, both, evidence))
    return found


def suspects_of(scene: SegmentedScene) -> tuple[dict[int, float], float]:
    """Return the probability that each suspected object in sight is the unrecognised target, and that none is."""
    p = {k.id: k.target_p for k in scene.known if k.id in scene.ids and k.target_p >= WORTH}
    total = sum(p.values())
    return {k: v / max(total, 1.0) for k, v in p.items()}, max(1.0 - total, 0.0)


def _hides_more_of(target: int, context: PlanningContext) -> list[DependencyEdge]:
    """Return the edges of a target of which too little is in sight: by the volume around it that others hide."""
    others = tuple(k for k in context.scene.ids if k != target)
    points = context.scene.object(target).points
    if len(points) == 0:
        return []
    return _by_volume(target, others, hidden_near_m3(context.volume, others, points, REACH_M))


def _by_volume(target: int, ids: tuple[int, ...], volumes: np.ndarray) -> list[DependencyEdge]:
    """Return edges in proportion to volumes."""
    return [
        DependencyEdge(
            target,
            k,
            EdgeKind.HIDDEN_BY,
            float(v / volumes.sum()),
            {"hidden_volume_m3": round(float(v), 9)},
        )
        for k, v in zip(ids, volumes)
        if v > 0
    ]
