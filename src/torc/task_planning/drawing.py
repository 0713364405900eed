"""The dependency graph as a picture and as Graphviz text."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from jaxtyping import UInt8
from PIL import Image, ImageDraw, ImageFont

from torc.perception.palette import object_color
from torc.task_planning.graph import DependencyEdge, DependencyGraph, DependencyNode, EdgeKind
from torc.task_planning.layout import Layout, lay_out

_INK, _PAPER, _FAINT = (40, 40, 44), (255, 255, 255), (120, 120, 126)
_CHOSEN = (20, 150, 60)
_EDGE_COLORS: Mapping[EdgeKind, tuple[int, int, int]] = {
    EdgeKind.BELOW: (176, 58, 46),
    EdgeKind.GRASP_BLOCKING: (31, 97, 141),
    EdgeKind.BEHIND: (110, 110, 116),
    EdgeKind.HIDDEN_BY: (125, 60, 152),
}
_DASHES_PX: Mapping[EdgeKind, tuple[float, float] | None] = {
    EdgeKind.BELOW: None,
    EdgeKind.GRASP_BLOCKING: None,
    EdgeKind.BEHIND: (9.0, 6.0),
    EdgeKind.HIDDEN_BY: (2.5, 5.0),
}
_OVERSAMPLING = 2
_LANE_PX = 13.0


@dataclass(frozen=True)
class DrawingConfig:
    """Sizes in pixels of the finished picture.

    Attributes:
        column_px, row_px: distance of neighbouring nodes.
        radius_px: of a node.
        margin_px: around everything.
        min_width_px: least width, so that the legend fits.
        text_px: height of the small text; node ids are larger.
    """

    column_px: int = 84
    row_px: int = 118
    radius_px: int = 23
    margin_px: int = 46
    min_width_px: int = 640
    text_px: int = 13


def draw_graph(
    graph: DependencyGraph,
    probabilities: Mapping[int, float] | Mapping[str, float] | None = None,
    chosen: int | None = None,
    config: DrawingConfig | None = None,
) -> UInt8[np.ndarray, "h w 3"]:
    """A picture of the graph: the target on top, what it waits for below it.

    Args:
        graph: the graph.
        probabilities: p(sink) by id (also as JSON has it, by text), written under the sinks.
        chosen: id of the object to pick next; ringed in green.
        config: sizes.

    Nodes have the object's colour in the marked image; graspable ones a solid outline, others a broken one. Edges
    are coloured and dashed by kind and carry their weight, unless they are their node's only one. What the target
    does not wait for is pale.
    """
    config = DrawingConfig() if config is None else config
    canvas = _Canvas(lay_out(graph), config)
    awaited, p = _awaited(graph), _by_id(probabilities)
    for edge in sorted(graph.edges, key=lambda e: e.source in awaited):
        canvas.edge(edge, edge.target == chosen, pale=edge.source not in awaited)
    for edge in graph.edges:
        if edge.weight < 0.9995:
            canvas.weight(edge, pale=edge.source not in awaited)
    for node in graph.nodes:
        probability = p.get(node.id) if node.id in awaited else None
        canvas.node(node, node.id == graph.target, probability, node.id == chosen)
    canvas.legend({e.kind for e in graph.edges})
    return canvas.finish()


def graph_to_dot(
    graph: DependencyGraph,
    probabilities: Mapping[int, float] | Mapping[str, float] | None = None,
    chosen: int | None = None,
) -> str:
    """The graph in Graphviz's dot language."""
    styles = {
        EdgeKind.BELOW: "solid",
        EdgeKind.GRASP_BLOCKING: "bold",
        EdgeKind.BEHIND: "dashed",
        EdgeKind.HIDDEN_BY: "dotted",
    }
    p = _by_id(probabilities)
    lines = ["digraph dependencies {", "  rankdir=TB;", "  node [shape=circle, style=filled];"]
    for n in graph.nodes:
        label = f"{n.id}" + (" (target)" if n.id == graph.target else "") + (" hidden" if n.hidden else "")
        if n.id in p:
            label += f"\\np = {p[n.id]:.2f}"
        color = "#{:02x}{:02x}{:02x}".format(*(int(c) for c in object_color(n.id)))
        shape = ", shape=doublecircle" if n.id == chosen else ""
        lines.append(f'  {n.id} [label="{label}", fillcolor="{color}"{shape}];')
    for e in graph.edges:
        color = "#{:02x}{:02x}{:02x}".format(*_EDGE_COLORS[e.kind])
        lines.append(
            f'  {e.source} -> {e.target} [label="{e.kind.value} {e.weight:.2f}", '
            f'style={styles[e.kind]}, color="{color}"];'
        )
    return "\n".join([*lines, "}", ""])


@dataclass
class _Canvas:
    """A picture in the making, drawn at twice the size and halved at the end."""

    layout: Layout
    config: DrawingConfig
    _taken: list[tuple[float, float, float, float]] = field(default_factory=list)

    def __post_init__(self) -> None:
        c = self.config
        inner = (self.layout.columns - 1) * c.column_px
        width = max(int(inner) + 2 * (c.margin_px + c.radius_px), c.min_width_px)
        height = (self.layout.rows - 1) * c.row_px + 2 * (c.margin_px + c.radius_px) + 2 * c.text_px
        self.left = (width - inner) / 2
        self.size = (width, height)
        self.image = Image.new("RGB", (width * _OVERSAMPLING, height * _OVERSAMPLING), _PAPER)
        self.pen = ImageDraw.Draw(self.image)
        for place in self.layout.places.values():
            x, y = self.at(place)
            self._taken.append((x - c.radius_px, y - c.radius_px, x + c.radius_px, y + c.radius_px))
            self._taken.append(_around(np.array([x, y + c.radius_px + 12]), 3.6 * c.text_px, c.text_px))

    def at(self, place: tuple[float, int]) -> tuple[float, float]:
        """Pixel of a place, in the finished picture."""
        c = self.config
        return self.left + place[0] * c.column_px, c.margin_px + c.radius_px + place[1] * c.row_px

    def edge(self, edge: DependencyEdge, bold: bool, pale: bool) -> None:
        """The edge from rim to rim, with its head."""
        curve = self._curve(edge)
        width = 2.6 if bold else 1.8
        color, dash = _edge_color(edge.kind, pale), _DASHES_PX[edge.kind]
        for a, b in _strokes(curve, dash):
            self.pen.line([*_scaled(a), *_scaled(b)], fill=color, width=round(width * _OVERSAMPLING))
        tip, back = curve[-1], curve[max(0, len(curve) - 8)]
        along = (tip - back) / max(float(np.linalg.norm(tip - back)), 1e-9)
        side = np.array([-along[1], along[0]])
        corners = (tip, tip - 11 * along + 4.5 * side, tip - 11 * along - 4.5 * side)
        self.pen.polygon([v for corner in corners for v in _scaled(corner)], fill=color)

    def weight(self, edge: DependencyEdge, pale: bool) -> None:
        """The weight beside its edge, at the first of a few places where it covers nothing."""
        curve = self._curve(edge)
        text = f"{edge.weight:.2f}".lstrip("0") if edge.weight >= 0.01 else "<.01"
        w, h = 0.62 * self.config.text_px * len(text), 1.1 * self.config.text_px
        boxes = [
            _around(curve[int(t * (len(curve) - 1))], w, h) for t in (0.6, 0.7, 0.5, 0.8, 0.4, 0.3, 0.2, 0.9)
        ]
        box = min(boxes, key=lambda b: sum(_overlap(b, other) for other in self._taken))
        self._taken.append(box)
        center = ((box[0] + box[2]) / 2, (box[1] + box[3]) / 2)
        self.text(center, text, self.config.text_px, _edge_color(edge.kind, pale), boxed=True)

    def node(self, node: DependencyNode, is_target: bool, probability: float | None, chosen: bool) -> None:
        """The node's disk with its id, and what is to be said above and below it."""
        c, (x, y) = self.config, self.at(self.layout.places[node.id])
        if chosen:
            self._disk(x, y, c.radius_px + 6, _CHOSEN)
            self._disk(x, y, c.radius_px + 2.5, _PAPER)
        fill = tuple(int(v) for v in object_color(node.id))
        self._disk(x, y, c.radius_px, _INK if node.graspable else _PAPER)
        self._disk(x, y, c.radius_px - 2.2, _PAPER if node.hidden else fill)
        if not node.graspable:
            self._broken_ring(x, y, c.radius_px - 1)
        dark = not node.hidden and np.dot(fill, (0.299, 0.587, 0.114)) < 140
        label = f"{node.id}?" if node.hidden else str(node.id)
        self.text((x, y), label, round(1.4 * c.text_px), _PAPER if dark else _INK)
        room = 17 if chosen else 12
        if is_target:
            name = "hidden target" if node.hidden else "target"
            self.text((x, y - c.radius_px - room), name, c.text_px, _INK, boxed=True)
        if probability is not None:
            ink = _CHOSEN if chosen else _INK
            self.text((x, y + c.radius_px + room), f"p = {probability:.2f}", c.text_px, ink, boxed=True)

    def legend(self, kinds: set[EdgeKind]) -> None:
        """One line at the bottom: what the edges and outlines mean."""
        c, y = self.config, self.size[1] - 1.3 * self.config.text_px
        x = 16.0
        for kind in EdgeKind:
            if kind in kinds:
                line = np.linspace((x, y), (x + 30, y), 31)
                for a, b in _strokes(line, _DASHES_PX[kind]):
                    self.pen.line(
                        [*_scaled(a), *_scaled(b)], fill=_EDGE_COLORS[kind], width=2 * _OVERSAMPLING
                    )
                x = self.text((x + 36, y), kind.value, c.text_px, _EDGE_COLORS[kind], anchor="lm") + 18
        self._disk(x + 6, y, 6, _INK)
        self._disk(x + 6, y, 4.5, _PAPER)
        x = self.text((x + 18, y), "graspable", c.text_px, _FAINT, anchor="lm") + 18
        self._broken_ring(x + 6, y, 6)
        self.text((x + 18, y), "not graspable", c.text_px, _FAINT, anchor="lm")

    def text(
        self,
        at: tuple[float, float],
        text: str,
        px: int,
        color: tuple[int, int, int],
        anchor: str = "mm",
        boxed: bool = False,
    ) -> float:
        """Writes, over a blank box if wanted, and returns where the text ends."""
        font = ImageFont.load_default(px * _OVERSAMPLING)
        left, top, right, bottom = self.pen.textbbox(_scaled(at), text, font=font, anchor=anchor)
        if boxed:
            self.pen.rectangle((left - 2, top - 2, right + 2, bottom + 2), fill=_PAPER)
        self.pen.text(_scaled(at), text, fill=color, font=font, anchor=anchor)
        return right / _OVERSAMPLING

    def finish(self) -> UInt8[np.ndarray, "h w 3"]:
        return np.array(self.image.resize(self.size, Image.Resampling.LANCZOS))

    def _curve(self, edge: DependencyEdge) -> np.ndarray:
        """Points of the edge from rim to rim; of two that run both ways, each keeps to one side."""
        route = np.array([self.at(p) for p in self.layout.routes[(edge.source, edge.target)]])
        if (edge.target, edge.source) in self.layout.routes:
            along = (route[-1] - route[0]) / np.linalg.norm(route[-1] - route[0])
            inner = route[1:-1] if len(route) > 2 else route.mean(axis=0, keepdims=True)
            route = np.concatenate(
                [route[:1], inner + _LANE_PX * np.array([-along[1], along[0]]), route[-1:]]
            )
        points = _smooth(route)
        from_source = np.linalg.norm(points - points[0], axis=1) >= self.config.radius_px + 1
        to_target = np.linalg.norm(points - points[-1], axis=1) >= self.config.radius_px + 4
        rim = points[from_source & to_target]
        return rim if len(rim) > 1 else points

    def _disk(self, x: float, y: float, radius: float, fill: tuple[int, int, int] | tuple[int, ...]) -> None:
        self.pen.ellipse([*_scaled((x - radius, y - radius)), *_scaled((x + radius, y + radius))], fill=fill)

    def _broken_ring(self, x: float, y: float, radius: float) -> None:
        box = [*_scaled((x - radius, y - radius)), *_scaled((x + radius, y + radius))]
        for start in range(0, 360, 30):
            self.pen.arc(box, start, start + 16, fill=_INK, width=round(1.6 * _OVERSAMPLING))


def _by_id(probabilities: Mapping[int, float] | Mapping[str, float] | None) -> dict[int, float]:
    return {int(k): p for k, p in (probabilities or {}).items()}


def _awaited(graph: DependencyGraph) -> set[int]:
    """The target and all that it waits for, directly or not."""
    found, todo = {graph.target}, [graph.target]
    while todo:
        new = {e.target for e in graph.out_edges(todo.pop())} - found
        found |= new
        todo += new
    return found


def _edge_color(kind: EdgeKind, pale: bool) -> tuple[int, int, int]:
    r, g, b = _EDGE_COLORS[kind]
    return (r // 3 + 160, g // 3 + 160, b // 3 + 160) if pale else (r, g, b)


def _scaled(point: tuple[float, ...] | np.ndarray) -> tuple[float, float]:
    return float(point[0]) * _OVERSAMPLING, float(point[1]) * _OVERSAMPLING


def _smooth(route: np.ndarray) -> np.ndarray:
    """Points of a curve through the route's waypoints, about a pixel apart (Catmull-Rom)."""
    padded = np.concatenate([2 * route[:1] - route[1:2], route, 2 * route[-1:] - route[-2:-1]])
    pieces = []
    for p0, p1, p2, p3 in zip(padded, padded[1:], padded[2:], padded[3:]):
        t = np.linspace(0, 1, max(8, int(np.linalg.norm(p2 - p1))), endpoint=False)[:, None]
        bend = (2 * p0 - 5 * p1 + 4 * p2 - p3) * t**2 + (3 * p1 - p0 - 3 * p2 + p3) * t**3
        pieces.append(0.5 * (2 * p1 + (p2 - p0) * t + bend))
    return np.concatenate([*pieces, route[-1:]])


def _strokes(curve: np.ndarray, dash: tuple[float, float] | None) -> list[tuple[np.ndarray, np.ndarray]]:
    """Short segments that make up the curve, or its dashes (length drawn, length left out)."""
    pairs = list(pairwise(curve))
    if dash is None:
        return pairs
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
    return [pair for pair, s in zip(pairs, length) if s % sum(dash) < dash[0]]


def _around(center: np.ndarray, w: float, h: float) -> tuple[float, float, float, float]:
    x, y = float(center[0]), float(center[1])
    return (x - w / 2, y - h / 2, x + w / 2, y + h / 2)


def _overlap(a: tuple[float, ...], b: tuple[float, ...]) -> float:
    """Common area of two boxes (left, top, right, bottom)."""
    return max(0.0, min(a[2], b[2]) - max(a[0], b[0])) * max(0.0, min(a[3], b[3]) - max(a[1], b[1]))
