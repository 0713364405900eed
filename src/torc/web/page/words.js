// Facts of an object in words.

import { percent, plural } from "./dom.js";

const MANY = 4;

// "25 valid grasps, the best is 99 % likely to succeed"
export function valid(o) {
  return `${plural(o.valid, "valid grasp")}${o.score === null ? "" : `, the best is ${percent(o.score)} likely to succeed`}`;
}

// "47 blocked (40 of them at least 25 % likely to succeed once free): 1 blocks 47, 2 blocks 5"; most: how many blockers are named
export function blocked(o, page, most = Infinity) {
  if (!o.blockers.length) return "";
  const named = o.blockers.slice(0, most).map((b) => `${b.id}\u00a0blocks\u00a0${b.grasps}`);
  const more = o.blockers.length - named.length;
  const some = o.likely_if_free === o.blocked ? "all" : o.likely_if_free === 0 ? "none" : o.likely_if_free;
  const likely = o.likely_if_free === null ? "" : most === Infinity
    ? ` (${some} of them at least ${percent(page.likely)} likely to succeed once free)` : `, ${some} likely once free`;
  return `${o.blocked ?? "some"} blocked${likely}: ${named.join(", ")}${more ? ` and ${more} more` : ""}`;
}

export function whyNot(o, page, most) {
  return [blocked(o, page, most), o.why_not].filter(Boolean).join("; ") || "no valid grasp";
}

export const fewBlocked = (o, page) => (o.graspable ? blocked(o, page, MANY) : whyNot(o, page, MANY));

// What blocks an object: "1 blocks 47 of its grasps, 2 blocks 5".
export const blockers = (o) => o.blockers.map((b, i) => `${b.id}\u00a0blocks\u00a0${b.grasps}${i ? "" : " of its grasps"}`).join(", ");

// The space that an object hides, as a table has it.
export function litresNumber(l) {
  if (l === null) return "–";
  if (l === 0) return "0";
  return l >= 0.095 ? l.toFixed(1) : l >= 0.0095 ? l.toFixed(2) : "<0.01";
}

// In a sentence; nothing where nothing is hidden.
export function litres(l) {
  if (!l) return "";
  return l < 0.0095 ? "hides hardly any space" : `hides ${litresNumber(l)}\u00a0litres`;
}
