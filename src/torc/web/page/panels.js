// The facts of a pick: the table of objects, and what was decided and came of it.

import { chip, el, percent, plural } from "./dom.js";
import { blocked, fewBlocked, litres, litresNumber, valid, whyNot } from "./words.js";

export const GOOD = ["retrieved", "removed"];

export function inOrder(page) {
  return [...page.objects].sort((a, b) => b.graspable - a.graspable || a.id - b.id);
}

// One line about an object.
export function describe(object, page) {
  const parts = [object.name ? `${object.id} ${object.name}` : `Object ${object.id}`];
  if (object.target) parts[0] += ", the target";
  parts.push(...(object.graspable ? [valid(object), blocked(object, page, 3)] : [`not graspable: ${whyNot(object, page, 3)}`]), litres(object.hides_l));
  return parts.filter(Boolean).join(" · ");
}

export function objectsPanel(page, state, on) {
  if (!page.objects.length) return el("p", { class: "padded faint" }, "No object is in sight.");
  const row = (o) => el("tr", {
    tabindex: 0, "aria-selected": String(o.id === state.selected), "data-id": o.id,
    onclick: () => on.select(o.id), onfocus: () => on.select(o.id),
    onmouseenter: () => on.hover(o.id), onmouseleave: () => on.hover(null),
  },
  el("td", {}, chip(o.id, o.color)),
  el("td", { class: "number" }, o.valid),
  el("td", { class: "number" }, percent(o.score)),
  el("td", { class: "number" }, litresNumber(o.hides_l)),
  el("td", {}, notes(o, page)));
  const head = ["Object", "Grasps", "Best grasp", "Hides (litres)", "Notes"];
  const group = (text, rows) => (rows.length
    ? [el("tr", {}, el("th", { colspan: head.length, scope: "rowgroup", class: "group" }, text)), rows.map(row)] : []);
  const table = el("table", { id: "objects", role: "grid", "aria-label": "Objects in sight" },
    el("thead", {}, el("tr", {}, head.map((text, i) => el("th", { scope: "col", class: i >= 1 && i <= 3 ? "number" : null }, text)))),
    el("tbody", {}, group("Graspable", inOrder(page).filter((o) => o.graspable)),
      group("Not graspable", inOrder(page).filter((o) => !o.graspable))));
  return [table, el("p", { class: "padded faint legend" },
    "Grasps: those that are valid now. Best grasp: how likely it is to succeed. “6 blocks 7”: object 6 is in the way of 7 of the object's "
    + `grasps; several objects may block the same grasp. “Likely once free”: at least ${percent(page.likely)} likely to succeed when nothing blocks them any more.`)];
}

function notes(o, page) {
  const lines = [];
  if (o.target) lines.push(el("b", {}, "target "));
  if (o.name) lines.push(`${o.name} `);
  lines.push(fewBlocked(o, page));
  return lines;
}

export function decisionPanel(page, trial, path) {
  const decision = page.decision;
  if (!decision) return el("p", { class: "padded faint" }, "Nothing has been decided in this pick.");
  const chosen = page.objects.find((o) => o.id === decision.object_id);
  const choice = decision.give_up ? "gave up" : decision.object_id === null ? "named no object" : "chose";
  return el("div", { class: "padded" },
    el("p", {}, `${trial.expert || trial.planner} ${choice} `, decision.object_id === null ? null : chip(decision.object_id, chosen?.color), ` ${chosen?.name || ""}`),
    el("p", {}, decision.reason),
    el("p", { class: "faint" }, `${seconds(decision.seconds)} to decide${decision.attempts > 1 ? `, asked ${decision.attempts} times` : ""}`),
    believed(decision, path),
    planned(page.plan), outcome(page, trial),
    sentPictures(page, path),
    decision.exchanges.map((e, i) => el("details", { open: decision.exchanges.length === 1 },
      el("summary", {}, decision.exchanges.length > 1 ? `Prompt and reply ${i + 1}` : "Prompt and reply"),
      el("pre", { tabindex: 0 }, e.prompt), el("p", {}, "Reply:"), el("pre", { tabindex: 0 }, e.reply))),
    el("details", {}, el("summary", {}, "Evidence"), el("pre", { tabindex: 0 }, JSON.stringify(decision.evidence, null, 1))));
}

// What the model was sent, as it was sent.
function sentPictures(page, path) {
  if (!page.sent) return null;
  const pictures = Array.from({ length: page.sent }, (_, i) =>
    el("img", { src: `${path}/sent/${i}.png`, class: "sent", alt: `Picture ${i + 1} that the model was sent` }));
  return el("details", {}, el("summary", {}, page.sent > 1 ? `${page.sent} pictures that were sent` : "The picture that was sent"), pictures);
}

function believed(decision, path) {
  if (!decision.evidence.belief?.tiles?.length) return null;
  const says = "Where the planner believes the target to be: violet where it is unlikely, yellow where it is likeliest";
  return el("figure", { class: "belief" }, el("img", { src: `${path}/belief.png`, alt: says }), el("figcaption", { class: "faint" }, `${says}.`));
}

function planned(plan) {
  if (!plan) return null;
  if (plan.failure) return el("p", {}, el("span", { class: "bad" }, "No motion: "), `${plan.failure.stage}: ${plan.failure.reason}`);
  const phases = Object.entries(plan.durations_s).map(([name, s]) => `${name} ${s.toFixed(1)} s`).join(", ");
  const grasp = `Grasp ${plan.grasps_tried} of its list${plan.score === null ? "" : `, ${percent(plan.score)} likely to succeed`}`;
  return el("p", {}, `${grasp}. Motions: ${phases}.`);
}

function outcome(page, trial) {
  if (!page.result) return null;
  const o = page.outcome;
  const dropped = o?.dropped.map((id) => (trial.names[id] ? `${id} ${trial.names[id]}` : id)).join(", ");
  return el("p", {}, el("span", { class: GOOD.includes(page.result) ? "good" : "bad" }, `Outcome: ${page.result}`),
    o?.detail ? `: ${o.detail.replace(/\.$/, "")}. ` : ". ", dropped ? el("b", {}, `Dropped: ${dropped}. `) : "",
    o?.target_lost ? el("b", {}, "The target was lost. ") : "", o?.duration_s ? `Robot time ${o.duration_s.toFixed(1)} s.` : "");
}

const seconds = (s) => (s < 10 ? `${s.toFixed(2)} s` : `${Math.round(s)} s`);

export function verdict(result) {
  if (!result) return "unfinished";
  if (result.status !== "completed") return result.status;
  const drops = result.drops ? `, ${result.drops} dropped` : "";
  return `${result.retrieved ? "retrieved" : `not retrieved (${result.end})`} in ${plural(result.picks, "pick")}${drops}`;
}
