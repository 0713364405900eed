// The page: an expert at work, or a look at recorded trials. What is shown follows from `app` alone.

import { follow, get, getArrays, pickPath, post, trialPath, watchRobot } from "./api.js";
import { actionBar } from "./action.js";
import { confirmGiveUp, queueCard, showHelp, showTrials } from "./dialogs.js";
import { $, el, replace } from "./dom.js";
import { draftOf, forgetDraft, keepDraft } from "./draft.js";
import { drawGraph } from "./graph.js";
import { listen } from "./keys.js";
import { decisionPanel, describe, inOrder, objectsPanel, verdict } from "./panels.js";
import { Picture } from "./picture.js";
import { noWebgl, Scene } from "./scene.js";
import { drawStrip } from "./strip.js";
import { drawTabs } from "./tabs.js";

const WORDS = {
  ready: "Waiting for a start", preparing: "Preparing", looking: "The robot looks", choosing: "Your choice",
  planning: "Planning the motions", executing: "The robot works", done: "All trials are complete",
};
const BUSY = ["preparing", "looking", "planning", "executing"];
const SHOWABLE = ["choosing", "planning", "executing"];

const app = {
  mode: null, outside: false, trials: [], session: null, trial: null, key: null, pick: null, page: null, arrays: null,
  selected: null, hovered: null, tab: "Objects", back: null, note: "", isTarget: false, refusal: "", robot: false, wholeGraph: false,
};
const picture = new Picture({ hover: (id) => { app.hovered = id; point(); }, select });
let scene = null;
let asked = 0;

const choosing = () => app.session?.phase === "choosing" && app.back === null;
const object = (id) => app.page?.objects.find((o) => o.id === id);

function select(id) {
  if (app.selected === id) return;
  Object.assign(app, { selected: id, isTarget: false, refusal: "" });
  keep();
  picture.select(id);
  drawSide();
}

const keep = () => { if (choosing()) keepDraft(app.key, app.pick, app); };

// Load what a pick shows; the newest wish wins.
async function open(key, pick) {
  const mine = ++asked;
  const trial = await get(trialPath(key));
  const last = trial.picks.length - 1;
  const number = Math.max(0, Math.min(pick ?? 0, last));
  const page = last >= 0 ? await get(pickPath(key, number)) : null;
  if (mine !== asked) return;
  const same = app.key === key && app.pick === number;
  Object.assign(app, { trial, key, page, pick: number });
  if (!same || !app.arrays) {
    const draft = choosing() ? draftOf(key, number) : { note: "", isTarget: false, selected: page?.decision?.object_id ?? null };
    Object.assign(app, { arrays: null, hovered: null }, same ? {} : draft);
  }
  draw();
  if (!page?.arrays || (same && app.arrays)) return;
  const arrays = await getArrays(key, number);
  if (mine !== asked) return;
  app.arrays = arrays;
  picture.setLabels(arrays.labels);
  if (app.tab === "3-D") drawSide();
}

function draw() {
  drawHead();
  if (app.page) {
    picture.show(pickPath(app.key, app.pick), app.page, `What the planner saw before pick ${app.pick + 1}: ${app.page.objects.length} numbered objects`);
    if (app.arrays) picture.setLabels(app.arrays.labels);
    picture.select(app.selected);
  } else picture.clear();
  drawStage();
  drawSide();
  if (app.trial?.picks.length) {
    const lines = app.mode === "human" ? app.trial.picks.filter((p) => p.chosen !== null || p.pick === app.session.pick) : app.trial.picks;
    drawStrip(app.key, lines, app.pick, goTo, app.mode === "view");
  } else replace($("strip"));
  point();
}

function drawHead() {
  const t = app.trial;
  replace($("task"), t?.target ? el("b", {}, `Target: ${t.target}${app.page && !app.page.target_visible ? " (hidden)" : ""}`) : "", t ? el("span", {}, headline(t)) : "");
  const most = app.page?.max_picks;
  const running = app.mode === "human" && SHOWABLE.includes(app.session.phase);
  $("count").textContent = running && most ? `Pick ${app.pick + 1} of ${most}` : t && app.mode === "view" ? verdict(t.result) : "";
  document.title = choosing() ? "Your choice – torc" : t ? `${t.problem} – torc` : "torc";
}

const headline = (t) => [t.problem, t.expert || t.planner, app.mode === "view" || t.seed ? `seed ${t.seed}` : ""].filter(Boolean).join(" · ");

function drawStage() {
  const phase = app.session?.phase;
  const idle = app.mode === "human" && app.back === null && (phase === "ready" || phase === "done");
  const busy = app.mode === "human" && app.back === null && BUSY.includes(phase);
  $("card").hidden = !idle;
  $("side").hidden = idle;
  if (idle) {
    replace($("card"), queueCard(app.session, app.trials, start));
    // The first key press starts; a person who is writing or reading elsewhere is left alone.
    if (document.activeElement === document.body) $("start")?.focus();
  }
  $("robot").hidden = !(busy && app.robot);
  const film = app.mode === "view" && app.tab === "Video";
  $("video").hidden = !film;
  if (film && $("video").getAttribute("src") !== videoPath()) $("video").src = videoPath();
  if (!film) $("video").pause();
  $("tools").hidden = idle || film || !app.page || !$("robot").hidden;
  const chosen = app.page?.chosen;
  const past = app.page && `Pick ${app.pick + 1}: ${chosen === null ? "no object" : `object ${chosen}`}, ${app.page.result || "not carried out"}`;
  const said = busy || phase === "ready" || phase === "done" ? app.session.message : "";
  $("says").textContent = app.mode === "view" || app.back !== null ? past || "" : idle ? "" : said || WORDS[phase];
}

const videoPath = () => `${trialPath(app.key)}/video.mp4`;

function tabNames() {
  const past = app.mode === "view" || app.back !== null;
  return [...(past ? ["Decision"] : []), "Objects", "Graph", "3-D", ...(app.mode === "view" && app.trial?.video ? ["Video"] : [])];
}

function drawSide() {
  const names_ = tabNames();
  if (!names_.includes(app.tab)) app.tab = "Objects";
  drawTabs(names_, app.tab, openTab);
  const panel = $("panel");
  const focused = panel.querySelector(":focus")?.dataset?.id;
  const scrolled = panel.scrollTop;
  if (!app.page) replace(panel);
  else if (app.tab === "Objects") replace(panel, objectsPanel(app.page, app, { select, hover: (id) => picture.hover(id) }));
  else if (app.tab === "Graph") replace(panel, drawGraph(app.page, app, { select, whole }));
  else if (app.tab === "3-D") drawScene(panel);
  else replace(panel, decisionPanel(app.page, app.trial, pickPath(app.key, app.pick)));
  panel.scrollTop = scrolled;
  if (focused) panel.querySelector(`[data-id="${focused}"]`)?.focus({ preventScroll: true });
  replace($("action"), actionBar(app, { choosing: choosing(), object: object(app.selected), pick, pass, giveUp, now, nameTarget, keep }));
  $("action").hidden = !$("action").childElementCount;
}

function whole(yes) {
  app.wholeGraph = yes;
  drawSide();
}

function drawScene(panel) {
  scene ??= new Scene(select);
  if (!scene.renderer) { replace(panel, noWebgl()); return; }
  if (!app.page.arrays) { replace(panel, el("p", { class: "padded faint" }, "This trial was recorded without its point cloud.")); return; }
  if (scene.node.parentNode !== panel) replace(panel, scene.node);
  if (app.arrays) scene.show(app.arrays, app.page.objects, app.selected, app.page.plan?.ways);
}

function point() {
  const o = object(app.hovered);
  $("pointed").textContent = o ? describe(o, app.page) : "";
}

function openTab(name) {
  if (!tabNames().includes(name)) return;
  app.tab = name;
  drawStage();
  drawSide();
}

function step(by) {
  const ids = inOrder(app.page || { objects: [] }).filter((o) => app.mode === "view" || o.graspable).map((o) => o.id);
  if (!ids.length) return;
  const at = ids.indexOf(app.selected);
  select(ids[at < 0 ? (by > 0 ? 0 : ids.length - 1) : (at + by + ids.length) % ids.length]);
  document.querySelector(`#objects [data-id="${app.selected}"]`)?.scrollIntoView({ block: "nearest" });
}

function goTo(number) {
  if (app.mode === "human") app.back = number === app.session.pick && SHOWABLE.includes(app.session.phase) ? null : number;
  else history.replaceState(null, "", `#${app.key}/${number}`);
  attempt(open(app.key, number));
}

function go(by) {
  if (!app.trial) return;
  const last = app.trial.picks.length - 1;
  const to = by === "first" ? 0 : by === "last" ? last : Math.max(0, Math.min(last, app.pick + by));
  if (to !== app.pick) goTo(to);
}

function now() {
  app.back = null;
  follows(app.session, true);
}

// What the server refuses is said, and the page catches up with what is true.
async function attempt(work) {
  try { await work; } catch (error) {
    app.refusal = error.message || String(error);
    if (app.page || app.session) drawSide(); else replace($("panel"), el("p", { class: "padded bad" }, app.refusal));
  }
}

function answer(fields) {
  if (!choosing()) return;
  const choice = { trial: app.session.trial, pick: app.session.pick, note: app.note.trim(), ...fields };
  attempt(post("/api/session/choose", choice).then((state) => follows(state)));
}

function pick() {
  const o = object(app.selected);
  if (o?.graspable) answer({ object_id: o.id, is_target: app.isTarget });
}

function nameTarget() {
  if (!choosing() || !app.page?.may_name_target || app.selected === null) return;
  app.isTarget = !app.isTarget;
  keep();
  drawSide();
}

const pass = () => answer({ object_id: null });
const giveUp = () => { if (choosing()) confirmGiveUp(() => answer({ give_up: true })); };
const start = (key) => attempt(post("/api/session/start", { trial: key }).then((state) => follows(state)));

// The stream always tells the truth; an answer to a post may have been overtaken by it.
async function follows(state, streamed = false) {
  if (!streamed && app.session && state.version < app.session.version) return;
  const before = app.session;
  app.session = state;
  if (before?.phase !== state.phase) app.refusal = "";
  if (state.phase === "choosing" && before?.phase !== "choosing" && app.back === null) app.robot = false;
  if (["ready", "done"].includes(state.phase)) {
    app.back = null;
    forgetDraft();
    app.trials = (await get("/api/trials")).trials;
    Object.assign(app, { trial: null, page: null, arrays: null, key: null });
    draw();
  } else if (SHOWABLE.includes(state.phase) && app.back === null) {
    await attempt(open(state.trial, state.pick));
  } else draw();
}

listen({
  select: (id) => object(id) && select(id), step, pick, giveUp, go, tab: openTab, zoom: () => picture.toggleZoom(),
  closer: (by) => picture.zoom.step(by), tints: () => picture.toggleTints(), plain: (on) => picture.hide(on),
  help: () => showHelp(app.mode, app.outside), note: () => $("note")?.focus(), nameTarget, trials: listTrials, clear: () => select(null),
}, { mode: () => app.mode, ids: () => (app.page?.objects || []).map((o) => o.id) });

async function listTrials() {
  if ($("show-trials").hidden) return;
  app.trials = (await get("/api/trials")).trials;
  showTrials(app.trials, (key) => { history.replaceState(null, "", `#${key}/0`); attempt(open(key, 0)); });
}

// What the address names: #KEY/PICK, as reports link to it; without one the first trial.
async function openAddressed() {
  const [key, number] = location.hash.slice(1).split("/");
  await attempt(open(key || app.trials[0].key, Number(number) || 0));
}

// A trial that is being played, or is not there yet, is asked for again; who looks at its last pick is led on.
function refresh() {
  if (document.hidden || app.trial?.result) return;
  if (app.trial) open(app.key, app.pick >= app.trial.picks.length - 1 ? Infinity : app.pick).catch(() => {});
  else if (location.hash) openAddressed();
}

async function begin() {
  const found = await get("/api/trials");
  // An expert's page replays what is complete, too: /?replay#KEY.
  const replay = new URLSearchParams(location.search).has("replay");
  const trials = replay ? found.trials.filter((t) => t.replay) : found.trials;
  Object.assign(app, { mode: replay ? "view" : found.mode, trials, outside: found.outside });
  $("reference").hidden = !app.outside;
  if (app.mode === "view") {
    app.tab = "Decision";
    $("show-trials").hidden = replay || trials.length < 2;
    $("show-report").hidden = !found.report;
    addEventListener("hashchange", openAddressed);
    await openAddressed();
    setInterval(refresh, 2000);
    return;
  }
  follow((state) => attempt(follows(state, true)), (gone) => { $("connection").hidden = !gone; });
  if (app.outside) watchRobot(() => app.back === null && BUSY.includes(app.session?.phase), (url) => {
    $("robot").src = url;
    if (!app.robot) { app.robot = true; drawStage(); }
  });
}

attempt(begin());
