"""The dependency graph as a picture."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float, UInt8

from torc.drawing.canvas import INK, PAPER, Canvas, Color, smooth_curve
from torc.drawing.graph_layout import Layout, lay_out
from torc.drawing.palette import object_color
from torc.records import TARGET_ID, Decision
from torc.records.graph import DependencyEdge, DependencyGraph, DependencyNode, EdgeKind

_FAINT: Color = (120, 120, 126)
_CHOSEN: Color = (20, 150, 60)
_STYLES: Mapping[EdgeKind, tuple[Color, tuple[float, float] | None]] = {
    EdgeKind.BELOW: ((176, 58, 46), None),
    EdgeKind.GRASP_BLOCKING: ((31, 97, 141), None),
    EdgeKind.BEHIND: ((110, 110, 116), (9.0, 6.0)),
    EdgeKind.HIDDEN_BY: ((125, 60, 152), (2.5, 5.0)),
    EdgeKind.MAY_BE: ((190, 110, 20), (2.5, 5.0)),
}
"""Colour and dashes of each kind of edge, pixels."""
_LANE_PX = 13.0
"""Sideways shift of an edge, pixels, where another one runs the other way."""
_WEIGHT_PLACES = (0.6, 0.7, 0.5, 0.8, 0.4, 0.3, 0.2, 0.9)
"""Places of a weight along its edge, the best first."""
_DIGITS_IN_DISK = 3
"""This many digits fit a node's disk at full height; longer numbers are written smaller."""
_COLUMN_PX, _ROW_PX = 84, 118
_RADIUS_PX, _MARGIN_PX, _TEXT_PX = 23, 46, 13
_MIN_WIDTH_PX = 640
"""Wide enough for the legend."""


def draw_graph(
    graph: DependencyGraph,
    probabilities: Mapping[int, float] | None = None,
    chosen: int | None = None,
    labels: Mapping[int, int] | None = None,
) -> UInt8[np.ndarray, "h w 3"]:
    """Draw the graph: the target on top, what it waits for below it.

    Nodes have the object's colour in the marked image; graspable ones have a solid outline, others a broken one, and
    the chosen one a green ring. Edges are coloured and dashed by kind and carry their weight, unless they are their
    node's only one; those that the target does not wait for are pale. `probabilities`, p(sink) by id, stand under the
    sinks. `labels` replace ids; a hidden target without one is then "?".
    """
    picture = _GraphPicture(lay_out(graph), labels or {})
    awaited, p = _awaited(graph), probabilities or {}
    for edge in sorted(graph.edges, key=lambda e: e.source in awaited):
        picture.edge(edge, edge.target == chosen, pale=edge.source not in awaited)
    for edge in graph.edges:
        if edge.weight < 0.9995:
            picture.weight(edge, pale=edge.source not in awaited)
    for node in graph.nodes:
        probability = p.get(node.id) if node.id in awaited else None
        picture.node(node, node.id == graph.target, probability, node.id == chosen)
    picture.legend({e.kind for e in graph.edges})
    return picture.canvas.finish()


def draw_decision(
    decision: Decision, labels: Mapping[int, int] | None = None
) -> UInt8[np.ndarray, "h w 3"] | None:
    """Draw the dependency graph that a decision rests on, its choice ringed; None if it rests on none."""
    evidence = decision.evidence
    if evidence.graph is None:
        return None
    return draw_graph(evidence.graph, evidence.probabilities, decision.object_id, labels=labels)


class _GraphPicture:
    def __init__(self, layout: Layout, labels: Mapping[int, int]) -> None:
        self.layout, self.labels = layout, labels
        inner = (layout.columns - 1) * _COLUMN_PX
        around = 2 * (_MARGIN_PX + _RADIUS_PX)
        width = max(int(inner) + around, _MIN_WIDTH_PX)
        self.left = (width - inner) / 2
        self.canvas = Canvas(width, (layout.rows - 1) * _ROW_PX + around + 2 * _TEXT_PX)
        self.taken: list[tuple[float, float, float, float]] = []
        for x, y in map(self.at, layout.places.values()):
            self.taken.append(_around(x, y, 2 * _RADIUS_PX, 2 * _RADIUS_PX))
            self.taken.append(_around(x, y + _RADIUS_PX + 12, 3.6 * _TEXT_PX, _TEXT_PX))
        self.curves = {ends: self._curve(*ends) for ends in layout.routes}

    def at(self, place: tuple[float, int]) -> tuple[float, float]:
        return self.left + place[0] * _COLUMN_PX, _MARGIN_PX + _RADIUS_PX + place[1] * _ROW_PX

    def edge(self, edge: DependencyEdge, bold: bool, pale: bool) -> None:
        curve, color = self.curves[edge.source, edge.target], _edge_color(edge.kind, pale)
        self.canvas.stroke(curve, color, 2.6 if bold else 1.8, _STYLES[edge.kind][1])
        self.canvas.arrow_head(curve, color)

    def weight(self, edge: DependencyEdge, pale: bool) -> None:
        """Write the weight beside its edge, at the first of a few places where it covers nothing."""
        curve = self.curves[edge.source, edge.target]
        text = f"{edge.weight:.2f}".lstrip("0") if edge.weight >= 0.01 else "<.01"
        w, h = 0.62 * _TEXT_PX * len(text), 1.1 * _TEXT_PX
        places = [curve[int(t * (len(curve) - 1))].tolist() for t in _WEIGHT_PLACES]
        boxes, taken = np.array([_around(x, y, w, h) for x, y in places])[:, None], np.array(self.taken)
        common = np.minimum(boxes[..., 2:], taken[:, 2:]) - np.maximum(boxes[..., :2], taken[:, :2])
        covered = np.maximum(common, 0.0).prod(axis=2)
        x, y = places[int(covered.sum(axis=1).argmin())]
        self.taken.append(_around(x, y, w, h))
        self.canvas.text((x, y), text, _TEXT_PX, _edge_color(edge.kind, pale), boxed=True)

    def node(self, node: DependencyNode, is_target: bool, probability: float | None, chosen: bool) -> None:
        x, y = self.at(self.layout.places[node.id])
        self._disk(node, x, y, chosen, object_color(TARGET_ID if is_target else node.id))
        room = _RADIUS_PX + (17 if chosen else 12)
        if is_target:
            name = "hidden target" if node.hidden else "target"
            self.canvas.text((x, y - room), name, _TEXT_PX, INK, boxed=True)
        if probability is not None:
            ink = _CHOSEN if chosen else INK
            self.canvas.text((x, y + room), f"p = {probability:.2f}", _TEXT_PX, ink, boxed=True)

    def legend(self, kinds: set[EdgeKind]) -> None:
        """Write one line at the bottom: the meaning of edges and outlines."""
        canvas, px = self.canvas, _TEXT_PX
        x, y = 16.0, canvas.height_px - 1.3 * px
        for kind in EdgeKind:
            if kind in kinds:
                color, dashes = _STYLES[kind]
                canvas.stroke(np.linspace((x, y), (x + 30, y), 31), color, 2, dashes)
                x = canvas.text((x + 36, y), kind.value, px, color, anchor="lm") + 18
        canvas.disk(x + 6, y, 6, INK)
        canvas.disk(x + 6, y, 4.5, PAPER)
        x = canvas.text((x + 18, y), "graspable", px, _FAINT, anchor="lm") + 18
        canvas.broken_ring(x + 6, y, 6)
        canvas.text((x + 18, y), "not graspable", px, _FAINT, anchor="lm")

    def _disk(
        self, node: DependencyNode, x: float, y: float, chosen: bool, color: tuple[int, int, int]
    ) -> None:
        canvas, radius = self.canvas, _RADIUS_PX
        if chosen:
            canvas.disk(x, y, radius + 6, _CHOSEN)
            canvas.disk(x, y, radius + 2.5, PAPER)
        canvas.disk(x, y, radius, INK if node.graspable else PAPER)
        canvas.disk(x, y, radius - 2.2, PAPER if node.hidden else color)
        if not node.graspable:
            canvas.broken_ring(x, y, radius - 1)
        dark = not node.hidden and np.dot(color, (0.299, 0.587, 0.114)) < 140
        number = str(self.labels.get(node.id, "" if self.labels and node.hidden else node.id))
        label = f"{number}?" if node.hidden else number
        px = round(1.4 * _TEXT_PX * min(1.0, _DIGITS_IN_DISK / len(label)))
        canvas.text((x, y), label, px, PAPER if dark else INK)

    def _curve(self, source: int, target: int) -> Float[np.ndarray, "n 2"]:
        """Return points of the edge from rim to rim; of two that run both ways, each keeps to one side."""
        route = np.array([self.at(p) for p in self.layout.routes[source, target]])
        if (target, source) in self.layout.routes:
            along = (route[-1] - route[0]) / np.linalg.norm(route[-1] - route[0])
            inner = route[1:-1] if len(route) > 2 else route.mean(axis=0, keepdims=True)
            beside = inner + _LANE_PX * np.array([-along[1], along[0]])
            route = np.concatenate([route[:1], beside, route[-1:]])
        points = smooth_curve(route)
        from_source = np.linalg.norm(points - points[0], axis=1) >= _RADIUS_PX + 1
        to_target = np.linalg.norm(points - points[-1], axis=1) >= _RADIUS_PX + 4
        rim = points[from_source & to_target]
        return rim if len(rim) > 1 else points


def _awaited(graph: DependencyGraph) -> set[int]:
    """Return the target and everything that it waits for, directly or not."""
    found, todo = {graph.target}, [graph.target]
    while todo:
        new = {e.target for e in graph.out_edges(todo.pop())} - found
        found |= new
        todo += new
    return found


def _edge_color(kind: EdgeKind, pale: bool) -> Color:
    r, g, b = _STYLES[kind][0]
    return (r // 3 + 160, g // 3 + 160, b // 3 + 160) if pale else (r, g, b)


def _around(x: float, y: float, w: float, h: float) -> tuple[float, float, float, float]:
    """Return left, top, right and bottom of a box."""
    return (x - w / 2, y - h / 2, x + w / 2, y + h / 2)
