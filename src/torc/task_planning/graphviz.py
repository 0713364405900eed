"""The dependency graph as Graphviz text, for papers and other tools: `dot -Tpdf graph.dot`."""

from collections.abc import Mapping

from torc.perception.palette import object_color
from torc.task_planning.drawing import EDGE_COLORS, by_id
from torc.task_planning.graph import DependencyGraph, EdgeKind

_STYLES: Mapping[EdgeKind, str] = {
    EdgeKind.BELOW: "solid",
    EdgeKind.GRASP_BLOCKING: "bold",
    EdgeKind.BEHIND: "dashed",
    EdgeKind.HIDDEN_BY: "dotted",
}


def graph_to_dot(
    graph: DependencyGraph,
    probabilities: Mapping[int, float] | Mapping[str, float] | None = None,
    chosen: int | None = None,
) -> str:
    """The graph in Graphviz's dot language; arguments as of `drawing.draw_graph`."""
    p = by_id(probabilities)
    lines = ["digraph dependencies {", "  rankdir=TB;", "  node [shape=circle, style=filled];"]
    for n in graph.nodes:
        label = f"{n.id}" + (" (target)" if n.id == graph.target else "") + (" hidden" if n.hidden else "")
        if n.id in p:
            label += f"\\np = {p[n.id]:.2f}"
        color = "#{:02x}{:02x}{:02x}".format(*(int(c) for c in object_color(n.id)))
        shape = ", shape=doublecircle" if n.id == chosen else ""
        lines.append(f'  {n.id} [label="{label}", fillcolor="{color}"{shape}];')
    for e in graph.edges:
        color = "#{:02x}{:02x}{:02x}".format(*EDGE_COLORS[e.kind])
        lines.append(
            f'  {e.source} -> {e.target} [label="{e.kind.value} {e.weight:.2f}", '
            f'style={_STYLES[e.kind]}, color="{color}"];'
        )
    return "\n".join([*lines, "}", ""])
