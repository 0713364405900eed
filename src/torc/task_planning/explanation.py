"""Why an object is to be picked, in a sentence."""

import heapq
import math
from collections.abc import Callable

from torc.task_planning.graph import DependencyEdge, DependencyGraph, EdgeKind


def explain(
    graph: DependencyGraph, chosen: int, probability: float, called: Callable[[int], str] = str
) -> str:
    """A sentence that follows the most probable path back from the chosen object to the target.

    E.g. "Pick 3 (p = 0.62): it blocks 5 of 7 blocked grasps of 2, which stands in front of the target 0."
    `called` names an object by its id.
    """
    path = most_probable_path(graph, chosen)
    if not path:
        return f"Pick {called(chosen)}: it is the target."
    links = [_phrase(graph, edge, called) for edge in reversed(path)]
    return f"Pick {called(chosen)} (p = {probability:.2f}): it {', which '.join(links)}."


def most_probable_path(graph: DependencyGraph, node_id: int) -> tuple[DependencyEdge, ...]:
    """The path from the target to a node with the largest product of weights; empty if there is none."""
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
    """What the edge's target does to its source."""
    source = called(edge.source)
    if edge.source == graph.target:
        source = f"the target {source}"
    if edge.kind == EdgeKind.HIDDEN_BY:
        if not edge.evidence.get("hidden_volume_m3", 0.0) > 0:
            return "may hide the target as much as any other object"
        where = "where the target may be" if graph.node(edge.source).hidden else f"around {source}"
        return f"hides {edge.weight:.0%} of the space {where}"
    if edge.kind == EdgeKind.GRASP_BLOCKING:
        blocks, blocked = edge.evidence.get("blocks"), edge.evidence.get("blocked_grasps")
        if blocks is None or blocked is None:
            return f"blocks {edge.weight:.0%} of the grasps of {source}"
        return f"blocks {blocks} of {blocked} blocked grasps of {source}"
    return f"lies on {source}" if edge.kind == EdgeKind.BELOW else f"stands in front of {source}"
