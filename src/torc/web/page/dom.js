// Elements from plain data. Text goes in as text only: nothing that a file or a planner says becomes markup.

const SVG = "http://www.w3.org/2000/svg";

export const $ = (id) => document.getElementById(id);

const shown = (children) => children.flat(3).filter((c) => c !== null && c !== undefined && c !== false);

function fill(node, attributes, children) {
  for (const [name, value] of Object.entries(attributes || {})) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else node.setAttribute(name, value === true ? "" : String(value));
  }
  node.append(...shown(children));
  return node;
}

export const el = (tag, attributes, ...children) => fill(document.createElement(tag), attributes, children);
export const svg = (tag, attributes, ...children) => fill(document.createElementNS(SVG, tag), attributes, children);

export function replace(node, ...children) {
  node.replaceChildren(...shown(children));
}

// The number of an object in its box, bordered in its colour, as in the marked image.
export function chip(id, color) {
  const node = el("span", { class: "chip" }, String(id));
  if (color) node.style.setProperty("--chip", color);
  return node;
}

// Only what is certain is 100 %, or 0 %.
export function percent(p) {
  if (p === null || p === undefined) return "–";
  if (p < 1 && p >= 0.995) return ">99\u00a0%";
  return p > 0 && p < 0.005 ? "<1\u00a0%" : `${Math.round(100 * p)}\u00a0%`;
}
export const plural = (n, one, many) => `${n} ${n === 1 ? one : many || one + "s"}`;
