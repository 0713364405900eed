"""DG-SELECT: the object that most probably makes progress, by the dependency graph (paper: Approach 2)."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from torc.occlusion.hidden_space import hidden_volumes_m3
from torc.records import Decision, PlanningContext
from torc.task_planning.explanation import explain
from torc.task_planning.graph import DependencyGraph, EdgeKind
from torc.task_planning.graph_building import build_dependency_graph
from torc.task_planning.paths import PathConfig, SinkProbabilities, rehearse_paths, sink_probabilities
from torc.task_planning.random_choice import graspable_ids
from torc.task_planning.relations import RelationConfig, find_relations

_TIE_DIGITS = 9
"""Probabilities that agree to this many digits are a tie: they differ by rounding only."""


@dataclass(frozen=True)
class DgSelectConfig:
    """Configuration of DG-SELECT.

    Attributes:
        relations: how 'behind' and 'below' are found.
        paths: how much work the probabilities may take.
    """

    relations: RelationConfig = field(default_factory=RelationConfig)
    paths: PathConfig = field(default_factory=PathConfig)


class DgSelectPlanner:
    """Builds the dependency graph and takes the most probable sink with a valid grasp."""

    name = "dg-select"

    def __init__(self, config: DgSelectConfig | None = None) -> None:
        self.config = DgSelectConfig() if config is None else config

    def decide(self, context: PlanningContext, rng: np.random.Generator) -> Decision:
        """The next object to pick, or None if nothing visible has a valid grasp. Draws nothing from rng."""
        graph = build_dependency_graph(context, self.config.relations)
        return decide_by_graph(graph, context, self.config.paths)

    def warm_up(self, context: PlanningContext) -> None:
        """Use every compiled kernel once, to no effect."""
        find_relations(context.scene, self.config.relations)
        hidden_volumes_m3(context.volume, context.scene.ids)
        rehearse_paths()


def graph_probabilities(graph: DependencyGraph, config: PathConfig | None = None) -> SinkProbabilities:
    """p(sink) from the graph's target; its `sinks` are object ids."""
    by_index = sink_probabilities(graph.weight_matrix(), graph.ids.index(graph.target), config)
    return replace(by_index, sinks=tuple(graph.ids[i] for i in by_index.sinks))


def decide_by_graph(
    graph: DependencyGraph, context: PlanningContext, config: PathConfig | None = None
) -> Decision:
    """The choice that a dependency graph implies, whoever made the graph.

    In this order: the target, if it is a graspable sink; the most probable sink that is graspable (ties: more
    valid grasps, then nearer to the camera, then lower id); any graspable object (none that lies below another if
    possible, then as for ties); no object, if nothing visible is graspable.
    """
    probabilities = graph_probabilities(graph, config)
    graspable = graspable_ids(context)
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
    return Decision(chosen, reason, evidence=_evidence(graph, probabilities, likely, rule))


def _preference(context: PlanningContext) -> dict[int, tuple[int, float, int]]:
    """Per visible object what breaks ties, least first: valid grasps (more), distance to the camera, id."""
    valid = dict(zip(context.report.object_ids, context.report.valid_total.tolist()))
    camera = context.scene.observation.T_world_camera[:3, 3]
    distance = {
        o.id: float(np.linalg.norm(np.median(o.points, axis=0) - camera)) for o in context.scene.objects
    }
    return {k: (-valid.get(k, 0), round(distance[k], 4), k) for k in context.scene.ids}


def _evidence(
    graph: DependencyGraph, probabilities: SinkProbabilities, likely: list[int], rule: str
) -> Mapping[str, Any]:
    """Plain data: `probabilities` are exact, or lower bounds with `certainty.upper` above them; keys are ids."""
    ids = [str(k) for k in probabilities.sinks]
    return {
        "rule": rule,
        "probabilities": dict(zip(ids, probabilities.lower)),
        "certainty": {
            "exact": probabilities.exact,
            "decided": probabilities.decided_among(tuple(likely)),
            "bound_hit": probabilities.bound_hit,
            "upper": dict(zip(ids, probabilities.upper)),
            "lost": probabilities.lost,
        },
        "graph": graph.to_dict(),
    }
