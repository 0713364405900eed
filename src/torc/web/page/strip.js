// The picks in a row: small pictures of what was seen, what was chosen, what came of it.

import { pickPath } from "./api.js";
import { $, el, replace } from "./dom.js";
import { GOOD } from "./panels.js";

let drawn = "";

// picks: lines of the trial; current: the one shown; go(number); slider: also offer one
export function drawStrip(key, picks, current, go, slider) {
  const strip = $("strip");
  const one = (p) => {
    const result = p.result || "";
    const chosen = p.chosen === null ? (result ? "none" : "…") : p.chosen;
    return el("button", {
      type: "button", class: "pick", "aria-current": p.pick === current ? "true" : null, onclick: () => go(p.pick),
      title: `Pick ${p.pick + 1}: ${chosen} ${result}`,
    },
    el("img", { src: `${pickPath(key, p.pick)}/small.jpg${p.chosen === null ? "" : "?chosen"}`, alt: "", loading: "lazy" }),
    el("span", {}, `${p.pick + 1}. object ${chosen}`),
    el("span", { class: GOOD.includes(result) ? "good" : result ? "bad" : "" }, result || "\u00a0"));
  };
  const content = JSON.stringify([key, current, slider, picks]);
  if (content === drawn && strip.childElementCount) return;
  drawn = content;
  const focused = strip.contains(document.activeElement) && document.activeElement.type;
  replace(strip, slider && picks.length > 1 ? slide(picks.length, current, go) : null, picks.map(one));
  if (focused === "range") strip.querySelector("input").focus();
  const shown = strip.querySelector("[aria-current]");
  if (shown) bringIn(strip, shown);
}

// Sideways only: on a narrow screen the strip is below the page's end, and the page must not follow it there.
function bringIn(strip, node) {
  const [whole, part] = [strip.getBoundingClientRect(), node.getBoundingClientRect()];
  if (part.left < whole.left) strip.scrollLeft += part.left - whole.left;
  else if (part.right > whole.right) strip.scrollLeft += part.right - whole.right;
}

function slide(count, current, go) {
  const step = (by, label, text) => el("button", {
    type: "button", "aria-label": label, title: label, disabled: current + by < 0 || current + by >= count,
    onclick: () => go(current + by),
  }, text);
  return el("div", { class: "slide" },
    el("label", {}, `Pick ${current + 1} of ${count}`, el("input", {
      type: "range", min: 0, max: count - 1, value: current, oninput: (event) => go(Number(event.target.value)),
    })),
    el("div", { class: "steps" }, step(-1, "Earlier pick (left arrow)", "◀"), step(1, "Later pick (right arrow)", "▶")));
}
