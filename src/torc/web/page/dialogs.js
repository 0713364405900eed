// Help, the question before giving up, the list of trials.

import { trialPath } from "./api.js";
import { $, el, plural, replace } from "./dom.js";
import { verdict } from "./panels.js";

const KEYS = {
  human: [
    ["0 – 9", "type the number of an object to select it"], ["↑ ↓ ← →", "next or previous object that can be grasped"],
    ["Enter", "pick the selected object"], ["n", "write a note: why"],
    ["t", "the selected object is the target, where the robot does not recognise it"], ["g", "give up (asks first)"],
  ],
  view: [["← →", "earlier or later pick"], ["Home End", "first or last pick"], ["↑ ↓", "next or previous object"], ["0 – 9", "select an object"], ["t", "list of trials"]],
};
const BOTH = [
  ["h", "while held: the picture without marks"], ["m", "objects tinted, or outlined only"],
  ["z", "the objects, or the whole picture"], ["+ -", "zoom; wheel or two fingers, too; drag to move"], ["o", "objects"], ["d", "graph"], ["c", "3-D view"], ["?", "this help"], ["Esc", "close; nothing selected"],
];

export function showHelp(mode, outside) {
  const rows = [...KEYS[mode], ...BOTH].map(([key, text]) => el("tr", {}, el("td", {}, el("kbd", {}, key)), el("td", {}, text)));
  fill("help", el("h2", { id: "help-title" }, mode === "human" ? "Choosing" : "Looking at trials"),
    el("p", {}, mode === "human"
      ? "Choose which object the robot removes next, so that it gets the target with few picks and drops nothing. "
        + (outside ? "You see what every task planner sees, and the robot from outside: your trials are references, and not ranked."
          : "You see what every task planner sees, and no more: not the robot at work, which would show what is hidden.")
      : "Each pick shows what the task planner saw, what it chose and why, and what came of it."),
    el("table", {}, el("tbody", {}, rows)),
    el("p", {}, "Graspable: a grasp is in reach, blocked by nothing, and likely enough to succeed. In the graph an arrow leads from an object to what has to go before it. In the 3-D view the coloured volume was never seen: a hidden target is in it."),
    el("div", { class: "row" }, closing("Close", true)));
}

export function confirmGiveUp(yes) {
  fill("confirm", el("h2", { id: "confirm-title" }, "Give up this trial?"),
    el("p", {}, "It ends here, and counts as not retrieved."),
    el("div", { class: "row" }, closing("Go on", true),
      el("button", { type: "button", onclick: () => { $("confirm").close(); yes(); } }, "Give up")));
}

// The words of the filter may stand anywhere in a trial's name or in what became of it.
export function showTrials(trials, open) {
  const lines = trials.map((t) => {
    const end = t.status === "completed" ? verdict(t) : t.status;
    return { text: `${t.name} ${end}`.toLowerCase(), node: el("li", {},
      el("button", { type: "button", onclick: () => { $("trials").close(); open(t.key); } },
        el("span", {}, t.name), el("span", { class: "faint" }, end))) };
  });
  const count = el("p", { class: "faint", role: "status" });
  const narrow = (wanted) => {
    const words = wanted.toLowerCase().split(/\s+/).filter(Boolean);
    for (const { text, node } of lines) node.hidden = !words.every((word) => text.includes(word));
    const left = lines.filter(({ node }) => !node.hidden).length;
    count.textContent = words.length ? `${left} of ${plural(trials.length, "trial")}` : plural(trials.length, "trial");
  };
  const box = el("input", {
    type: "search", id: "filter", "aria-label": "Filter the trials", placeholder: "Filter, e.g. dg-select not retrieved",
    oninput: (event) => narrow(event.target.value),
  });
  narrow("");
  fill("trials", el("h2", { id: "trials-title" }, "Recorded trials"), box, count,
    el("ul", { class: "plain" }, lines.map(({ node }) => node)), el("div", { class: "row" }, closing("Close", false)));
}

// What stands in the way of the next trial: the queue, and how the last one ended.
export function queueCard(state, trials, start) {
  const last = trials.find((t) => t.key === state.trial);
  const next = trials.find((t) => state.waiting.includes(t.key));
  const person = next?.expert ? `${next.expert}, ` : "";
  const title = !next ? "All trials are complete" : last && last.status !== "waiting" ? "Next trial" : "Ready";
  return el("div", {},
    last && ["completed", "errored"].includes(last.status) ? ended(last, state.message) : null,
    el("h2", {}, title),
    next && !last ? task() : null,
    next ? el("div", {}, el("button", { type: "button", class: "main", id: "start", onclick: () => start(next.key) }, `Start: ${person}${next.problem}`))
      : el("p", {}, "Everything is recorded. The page can be closed."),
    trials.length > 1 ? el("ul", { class: "plain" }, trials.map((t) => queued(t, state, start))) : null);
}

// Before the first pick: what is wanted, and of what it is judged.
function task() {
  return el("div", { id: "explained" },
    el("p", {}, "The robot must get one object, the target, out of the clutter: in as few picks as possible, and without dropping anything else. Before each pick you choose the object that it removes: the target as soon as it can be grasped, else what stands in its way or may hide it."),
    el("p", {}, "You see what every task planner sees: the numbered objects, which of them can be grasped, what blocks what, and the space that nobody has looked into. Click on an object, or type its number, then press Pick. A pick that fails counts, too."));
}

// Recorded trials open in a page of their own: this one goes on with the queue.
const replay = (t, text) => el("a", { href: `/?replay#${t.key}/0`, target: "_blank" }, text);

function ended(last, message) {
  const good = last.status === "completed" && last.retrieved;
  const text = last.status === "errored" ? `The trial broke: ${message || last.error}. It can be played again.` : `${verdict(last)}.`;
  return el("div", {}, el("p", { class: good ? "good" : "bad", id: "ended" }, `${last.name}: ${text} `,
    last.replay ? replay(last, "Replay, pick by pick") : null),
    last.video ? el("video", { id: "outside", src: `${trialPath(last.key)}/video.mp4`, controls: true, preload: "metadata", "aria-label": "The trial from outside" }) : null);
}

function queued(t, state, start) {
  const how = el("span", { class: t.status === "completed" ? (t.retrieved ? "good" : "bad") : "faint" },
    t.status === "completed" ? verdict(t) : t.status === "waiting" ? "" : `${t.status}: starts again`);
  const name = el("span", {}, t.expert ? `${t.expert}: ${t.problem}` : t.problem);
  return el("li", {}, state.waiting.includes(t.key)
    ? el("button", { type: "button", onclick: () => start(t.key) }, name, how)
    : el("p", {}, name, how, t.replay ? replay(t, "Replay") : null));
}

function fill(id, ...children) {
  replace($(id), ...children);
  if (!$(id).open) $(id).showModal();
}

const closing = (text, focus) => el("button", {
  type: "button", autofocus: focus, onclick: (event) => event.target.closest("dialog").close(),
}, text);
