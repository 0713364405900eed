// The dependency graph. Places come with the data; an arrow a -> b says that b has to go before a.

import { el, percent, svg } from "./dom.js";
import { blockers } from "./words.js";

const COLUMN = 62, ROW = 88, RADIUS = 22, MARGIN = 46, LANE = 13;
const LEAST_SCALE = 0.6, MOST_SCALE = 1.5;
const KINDS = {
  "below": "lies below",
  "grasp blocking": "has grasps blocked by",
  "behind": "stands behind",
  "hidden by": "may be hidden by",
  "may be": "may be",
};
const FEW_EDGES = 14;

const css = (kind) => kind.replace(" ", "-");

// First what the target waits for; all objects on request, or if another one is selected. on: {select(id), whole(yes)}
export function drawGraph(page, { selected, wholeGraph }, on) {
  if (!page.graphs) return el("p", { class: "padded faint" }, "No dependency graph was recorded for this pick.");
  const { all, target } = page.graphs;
  const outside = all.nodes.some((n) => n.id === selected) && !target.nodes.some((n) => n.id === selected);
  const graph = wholeGraph || outside ? all : target;
  const picture = drawPicture(graph, { selected, chosen: page.chosen }, on.select);
  return el("div", { id: "graph-box" }, head(page, graph === all, outside, on), el("div", {}, picture), legend(graph, page.graph_by));
}

// The target's own blockers in words, and the choice of objects.
function head(page, whole, outside, on) {
  const { all, target } = page.graphs;
  const choice = all.nodes.length > target.nodes.length && !outside
    ? el("label", {}, el("input", { type: "checkbox", id: "whole-graph", checked: whole, onchange: (event) => on.whole(event.target.checked) }), "all objects") : null;
  return el("p", { class: "legend" }, el("span", { id: "target-waits" }, waits(page)), choice);
}

function waits({ graphs: { all }, objects }) {
  const own = all.edges.filter((e) => e.source === all.target).sort((a, b) => b.weight - a.weight);
  if (!own.length) return "Nothing has to go before the target.";
  const target = objects.find((o) => o.id === all.target);
  const parts = Object.entries(KINDS).map(([kind, words]) => {
    const ids = own.filter((e) => e.kind === kind).map((e) => e.target);
    if (!ids.length) return null;
    return kind === "grasp blocking" && target ? blockers(target) : `it ${words} ${ids.join(", ")}`;
  });
  return `The target waits: ${parts.filter(Boolean).join("; ")}.`;
}

function drawPicture(graph, state, select) {
  const width = (graph.columns - 1) * COLUMN + 2 * MARGIN;
  const height = (graph.rows - 1) * ROW + 2 * MARGIN;
  const at = ([column, row]) => [MARGIN + column * COLUMN, MARGIN + row * ROW];
  const pairs = new Set(graph.edges.map((e) => `${e.source} ${e.target}`));
  const touches = (e) => state.selected === null || e.source === state.selected || e.target === state.selected;
  const isNode = graph.nodes.some((n) => n.id === state.selected);
  const picture = svg("svg", { viewBox: `0 0 ${width} ${height}`, role: "group", "aria-label": "Dependency graph" });
  // Rather scrolled than too small to read.
  picture.style.minWidth = `${LEAST_SCALE * width}px`;
  picture.style.minHeight = `${LEAST_SCALE * height}px`;
  picture.style.maxHeight = `${MOST_SCALE * height}px`;
  picture.append(svg("defs", {}, Object.keys(KINDS).map(arrowHead)));
  const labels = [];
  for (const edge of graph.edges) {
    const twoWay = pairs.has(`${edge.target} ${edge.source}`);
    const points = route(edge.route.map(at), twoWay);
    const pale = isNode && !touches(edge);
    const path = svg("path", {
      d: curve(points), class: `edge kind-${css(edge.kind)}${pale ? " pale" : ""}${isNode && !pale ? " strong" : ""}`,
      "marker-end": `url(#head-${css(edge.kind)})`,
    }, svg("title", {}, `${edge.source} ${KINDS[edge.kind]} ${edge.target}: weight ${edge.weight.toFixed(2)}`));
    picture.append(path);
    if (edge.weight < 0.9995 && (graph.edges.length <= FEW_EDGES || (isNode && !pale))) {
      const [x, y] = along(points, 0.55);
      const text = edge.weight < 0.01 ? "<.01" : edge.weight.toFixed(2).replace(/^0/, "");
      labels.push(svg("text", { x, y: y + 4, class: `weight fill-${css(edge.kind)}${pale ? " pale" : ""}` }, text));
    }
  }
  picture.append(...labels);
  for (const node of graph.nodes) picture.append(drawNode(node, graph, at(node.place), state, select));
  return picture;
}

function drawNode(node, graph, [x, y], state, select) {
  const is = (name, yes) => (yes ? ` ${name}` : "");
  const isTarget = node.id === graph.target;
  const name = `${isTarget ? (node.hidden ? "hidden target" : "target") : "object"} ${node.id}`;
  const grasp = node.hidden ? "" : node.graspable ? ", graspable" : ", not graspable";
  const act = () => { if (!node.hidden) select(node.id); };
  const group = svg("g", {
    class: `node${is("selected", node.id === state.selected)}`, transform: `translate(${x} ${y})`,
    tabindex: node.hidden ? null : 0, role: "button", "aria-label": name + grasp, onclick: act,
    onkeydown: (event) => { if (event.key === " ") { event.preventDefault(); act(); } },
  });
  group.append(
    svg("circle", { r: RADIUS + 6, class: "ring" }),
    svg("circle", {
      r: RADIUS, fill: node.hidden ? "none" : node.color, stroke: "currentColor",
      "stroke-width": node.graspable ? 3 : 2, "stroke-dasharray": node.graspable ? null : "4 4",
    }),
    svg("text", { class: "id", fill: node.hidden ? "currentColor" : inkOn(node.color) }, node.hidden ? `${node.id}?` : String(node.id)),
  );
  if (isTarget) group.append(svg("text", { class: "note", y: -RADIUS - 11 }, node.hidden ? "hidden target" : "target"));
  const below = [node.id === state.chosen ? "✓" : "", node.p !== null ? percent(node.p) : ""].filter(Boolean);
  if (below.length) group.append(svg("text", { class: "note", y: RADIUS + 19 }, below.join(" ")));
  return group;
}

function arrowHead(kind) {
  const box = { id: `head-${css(kind)}`, viewBox: "0 0 10 10", refX: 9, refY: 5, markerWidth: 11, markerHeight: 11 };
  return svg("marker", { ...box, orient: "auto-start-reverse", markerUnits: "userSpaceOnUse" },
    svg("path", { d: "M0 0L10 5L0 10z", class: `fill-${css(kind)}` }));
}

function legend(graph, by) {
  const kinds = Object.keys(KINDS).filter((k) => graph.edges.some((e) => e.kind === k));
  const line = (kind) => svg("svg", { viewBox: "0 0 30 10", "aria-hidden": "true" },
    svg("path", { d: "M0 5H30", class: `edge kind-${css(kind)}` }));
  return el("p", { class: "legend" },
    kinds.map((kind) => el("span", {}, line(kind), kind)),
    el("span", {}, `made by ${by}`), el("span", {}, "arrow: the other one has to go first"), el("span", {}, "dashed outline: not graspable"),
    graph.nodes.some((n) => n.p !== null) ? el("span", {}, "%: the target is reached through it") : null);
}

// From rim to rim; of two that run both ways each keeps to its side.
function route(points, twoWay) {
  let way = points.map((p) => [...p]);
  const [first, last] = [way[0], way[way.length - 1]];
  if (twoWay) {
    const length = Math.hypot(last[0] - first[0], last[1] - first[1]) || 1;
    const beside = [-(last[1] - first[1]) / length * LANE, (last[0] - first[0]) / length * LANE];
    const inner = way.length > 2 ? way.slice(1, -1) : [[(first[0] + last[0]) / 2, (first[1] + last[1]) / 2]];
    way = [first, ...inner.map(([x, y]) => [x + beside[0], y + beside[1]]), last];
  }
  way[0] = towards(way[0], way[1], RADIUS + 1);
  way[way.length - 1] = towards(way[way.length - 1], way[way.length - 2], RADIUS + 4);
  return way;
}

function towards([x, y], [u, v], distance) {
  const length = Math.hypot(u - x, v - y) || 1;
  return [x + (u - x) / length * distance, y + (v - y) / length * distance];
}

function curve(points) {
  let d = `M${points[0].join(" ")}`;
  for (let i = 1; i < points.length - 1; i++) {
    const next = points[i + 1];
    const end = i === points.length - 2 ? next : [(points[i][0] + next[0]) / 2, (points[i][1] + next[1]) / 2];
    d += `Q${points[i].join(" ")} ${end.join(" ")}`;
  }
  return points.length === 2 ? `${d}L${points[1].join(" ")}` : d;
}

function along(points, share) {
  const lengths = points.slice(1).map((p, i) => Math.hypot(p[0] - points[i][0], p[1] - points[i][1]));
  let left = share * lengths.reduce((a, b) => a + b, 0);
  let i = 0;
  while (i < lengths.length - 1 && left > lengths[i]) left -= lengths[i++];
  return towards(points[i], points[i + 1], left);
}

function inkOn(color) {
  const [r, g, b] = [1, 3, 5].map((i) => parseInt(color.slice(i, i + 2), 16));
  return 0.299 * r + 0.587 * g + 0.114 * b < 140 ? "#fff" : "#111";
}
