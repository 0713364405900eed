// What the expert can do now.

import { chip, el } from "./dom.js";
import { blocked, litres, valid, whyNot } from "./words.js";

// can: {choosing, object: the selected one, pick(), pass(), giveUp(), now(), nameTarget(), keep()}
export function actionBar(app, can) {
  const refusal = app.refusal ? el("p", { class: "bad", role: "alert" }, app.refusal) : null;
  if (app.mode === "view") return refusal ? [refusal] : [];
  if (app.back !== null) {
    return [refusal, row(el("p", { class: "grow" }, `Looking back at pick ${app.back + 1}.`), button("Back to now", can.now, "main"))];
  }
  if (!can.choosing) return refusal ? [refusal] : [];
  const some = app.session.allowed.length > 0;
  return [refusal, el("div", { class: "facts", "aria-live": "polite" }, some ? facts(can.object, app.page) : nothing()),
    some && app.page?.may_name_target && can.object ? row(naming(app, can)) : null,
    some ? row(el("div", { class: "grow" }, note(app, can)), button("Give up", can.giveUp), choose(app, can))
      : row(el("span", { class: "grow" }), button("Give up", can.giveUp), button("Let this pick pass", can.pass, "main"))];
}

const row = (...children) => el("div", { class: "row" }, children);
const button = (text, act, kind) => el("button", { type: "button", class: kind, onclick: act }, text);

// The robot has not found the target, or does not know it when it sees it; a person may.
function naming(app, can) {
  return el("label", {}, el("input", { type: "checkbox", id: "is-target", checked: app.isTarget, onchange: can.nameTarget }),
    el("span", {}, `Object ${can.object.id} is the target, which the robot does not recognise`));
}

function choose(app, can) {
  const ready = can.object?.graspable;
  return el("button", { type: "button", class: "main", id: "pick", disabled: !ready, onclick: can.pick },
    ready ? `Pick ${can.object.id}${app.isTarget ? ", the target" : ""}` : "Pick");
}

function note(app, can) {
  return el("input", {
    id: "note", maxlength: 500, placeholder: "Why? (a note, if you like)", "aria-label": "Note: why this object",
    value: app.note, oninput: (event) => { app.note = event.target.value; can.keep(); },
  });
}

function nothing() {
  return el("p", {}, "Nothing in sight can be grasped. Letting the pick pass uses it up; the robot looks again and draws new grasps.");
}

function facts(o, page) {
  if (!o) return el("p", { class: "faint" }, "Select an object: click it in the image, the table, the graph or in 3-D, or type its number.");
  const head = [chip(o.id, o.color), o.target ? el("b", {}, " the target: ") : " "];
  const hides = litres(o.hides_l) ? ` It ${litres(o.hides_l)}.` : "";
  if (!o.graspable) return el("p", {}, head, el("span", { class: "bad" }, "not graspable"), `: ${whyNot(o, page)}.${hides}`);
  const others = blocked(o, page) ? ` Others: ${blocked(o, page)}.` : "";
  return el("p", {}, head, el("span", { class: "good" }, "graspable"), `: ${valid(o)}.${others}${hides}`);
}
