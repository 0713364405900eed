"""DG-SELECT: pick the object that most probably makes progress, by the dependency graph (paper: Approach 2)."""

import heapq
import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from torc.occlusion.volume import hidden_volumes_m3
from torc.records import (
    Certainty,
    Decision,
    DependencyEdge,
    DependencyGraph,
    EdgeKind,
    Evidence,
    PlanningContext,
    SegmentedScene,
)
from torc.registry.kinds import TaskPlannerTraits
from torc.task_planning.graph_building import build_dependency_graph
from torc.task_planning.paths import PathConfig, SinkProbabilities, rehearse_paths, sink_probabilities
from torc.task_planning.relations import RelationConfig, find_relations

_TIE_DIGITS = 9
"""Probabilities that agree to this many digits are a tie: they differ only by rounding."""


@dataclass(frozen=True)
class DgSelectConfig:
    """Configuration of DG-SELECT.

    Attributes:
        relations: settings of the 'behind' and 'below' tests.
        paths: how much work the probabilities may take.
    """

    relations: RelationConfig = field(default_factory=RelationConfig)
    paths: PathConfig = field(default_factory=PathConfig)


class DgSelectPlanner(TaskPlannerTraits):
    """Builds the dependency graph and takes the most probable sink with a valid grasp."""

    name = "dg-select"
    reads_picture = False

    def __init__(self, config: DgSelectConfig | None = None) -> None:
        self.config = DgSelectConfig() if config is None else config

    def decide(self, context: PlanningContext, rng: np.random.Generator) -> Decision:
        """Return the next object to pick, or None if nothing visible has a valid grasp. Draws nothing from rng."""
        graph = build_dependency_graph(context, self.config.relations)
        return decide_by_graph(graph, context, self.config.paths)

    def warm_up(self, context: PlanningContext) -> None:
        """Run every compiled kernel once and discard the results."""
        find_relations(context.scene, self.config.relations)
        hidden_volumes_m3(context.volume, context.scene.ids)
        rehearse_paths()


def graph_probabilities(graph: DependencyGraph, config: PathConfig | None = None) -> SinkProbabilities:
    """Return p(sink) from the graph's target; its `sinks` are object ids."""
    by_index = sink_probabilities(graph.weight_matrix(), graph.ids.index(graph.target), config)
    return replace(by_index, sinks=tuple(graph.ids[i] for i in by_index.sinks))


def decide_by_graph(
    graph: DependencyGraph, context: PlanningContext, config: PathConfig | None = None
) -> Decision:
    """Return the choice that a dependency graph implies, whoever built it.

    In this order: the target, if it is a graspable sink; the most probable graspable sink (ties: more valid grasps,
    then nearer to the camera, then lower id); any graspable object (preferably not below another one, then as for
    ties); no object, if nothing visible is graspable.
    """
    probabilities = graph_probabilities(graph, config)
    graspable = context.graspable_ids
    preference = _preference(context)
    likely = [k for k in graspable if k in probabilities.sinks and probabilities[k] > 0]
    if not graspable:
        chosen, rule = None, "nothing graspable"
        reason = "No visible object has a valid grasp."
    elif not graph.node(graph.target).hidden and graph.target in graspable and graph.target in graph.sinks:
        chosen, rule = graph.target, "target"
        reason = (
            f"Pick {context.called(chosen)}: it is the target, it has a valid grasp and nothing lies on it."
        )
    elif likely:
        chosen = min(likely, key=lambda k: (-round(probabilities[k], _TIE_DIGITS), *preference[k]))
        rule, reason = "most probable sink", explain(graph, chosen, probabilities[chosen], context.called)
    else:
        below = {e.source for e in graph.edges if e.kind == EdgeKind.BELOW}
        chosen = min(graspable, key=lambda k: (k in below, *preference[k]))
        rule = "any graspable"
        reason = (
            f"Pick {context.called(chosen)}: nothing that the target waits for has a valid grasp; of the "
            f"{len(graspable)} objects that have one, it has the most or is the nearest."
        )
    certainty = Certainty(
        exact=probabilities.exact,
        decided=probabilities.decided_among(tuple(likely)),
        bound_hit=probabilities.bound_hit,
        upper=dict(zip(probabilities.sinks, probabilities.upper)),
        lost=probabilities.lost,
    )
    lower = dict(zip(probabilities.sinks, probabilities.lower))
    return Decision(chosen, reason, evidence=Evidence(rule, graph, lower, certainty))


def _preference(context: PlanningContext) -> dict[int, tuple[int, float, int]]:
    """Return, per visible object, what breaks ties, least first: valid grasps (more), distance to the camera, id."""
    valid = dict(zip(context.report.object_ids, context.report.valid_total.tolist()))
    return {k: (-valid.get(k, 0), round(d, 4), k) for k, d in distances_m(context.scene).items()}


def distances_m(scene: SegmentedScene) -> dict[int, float]:
    """Return, per visible object, the distance between the camera and the median of its points, metres."""
    camera = np.asarray(scene.observation.T_world_camera, dtype=float)[:3, 3]
    return {o.id: float(np.linalg.norm(np.median(o.points, axis=0) - camera)) for o in scene.objects}


def explain(
    graph: DependencyGraph, chosen: int, probability: float, called: Callable[[int], str] = str
) -> str:
    """Return a sentence that follows the most probable path back from the chosen object to the target.

    E.g. "Pick 3 (p = 0.62): it blocks 5 of 7 blocked grasps of 2, which stands in front of the target 0." `called`
    names an object by its id.
    """
    path = most_probable_path(graph, chosen)
    if not path:
        return f"Pick {called(chosen)}: it is the target."
    links = [_phrase(graph, edge, called) for edge in reversed(path)]
    return f"Pick {called(chosen)} (p = {probability:.2f}): it {', which '.join(links)}."


def most_probable_path(graph: DependencyGraph, node_id: int) -> tuple[DependencyEdge, ...]:
    """Return the path from the target to a node with the largest product of weights; empty if there is none."""
    best: dict[int, tuple[float, DependencyEdge | None]] = {graph.target: (0.0, None)}
    queue, done = [(0.0, graph.target)], set()
    while queue:
        cost, at = heapq.heappop(queue)
        if at in done:
            continue
        done.add(at)
        for edge in graph.out_edges(at):
            onward = cost - math.log(edge.weight)
            if edge.target not in best or onward < best[edge.target][0]:
                best[edge.target] = (onward, edge)
                heapq.heappush(queue, (onward, edge.target))
    path: list[DependencyEdge] = []
    step = best.get(node_id, (0.0, None))[1]
    while step is not None:
        path.append(step)
        step = best[step.source][1]
    return tuple(reversed(path))


def _phrase(graph: DependencyGraph, edge: DependencyEdge, called: Callable[[int], str]) -> str:
    """Describe what the edge's target does to its source."""
    source = called(edge.source)
    if edge.source == graph.target:
        source = f"the target {source}"
    if edge.kind == EdgeKind.HIDDEN_BY:
        if not edge.evidence.get("hidden_volume_m3", 0.0) > 0:
            return "may hide the target as much as any other object"
        where = "where the target may be" if graph.node(edge.source).hidden else f"around {source}"
        return f"hides {edge.evidence.get('hidden_share', edge.weight):.0%} of the space {where}"
    if edge.kind == EdgeKind.MAY_BE:
        return f"may be the target (p = {edge.evidence.get('target_p', edge.weight):.2f})"
    if edge.kind == EdgeKind.GRASP_BLOCKING:
        blocks, blocked = edge.evidence.get("blocks"), edge.evidence.get("blocked_grasps")
        if blocks is None or blocked is None:
            return f"blocks {edge.weight:.0%} of the grasps of {source}"
        return f"blocks {blocks} of {blocked} blocked grasps of {source}"
    return f"lies on {source}" if edge.kind == EdgeKind.BELOW else f"stands in front of {source}"
