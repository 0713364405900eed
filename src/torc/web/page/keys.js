// The keyboard. Digits name an object: "1" selects 1, "12" right after it 12.

import { $ } from "./dom.js";

const DIGIT_MS = 900;

// act: {select(id), step(by), pick(), giveUp(), go(by or "first"/"last"), tab(name), zoom, closer(by), tints, plain(on), help, note, nameTarget, trials, clear}
// facts: {mode(), ids()}
export function listen(act, facts) {
  let typed = "";
  let typedAt = 0;
  const digit = (key, now) => {
    if (now - typedAt > DIGIT_MS) typed = "";
    typed += key;
    typedAt = now;
    if (!facts.ids().includes(Number(typed))) typed = key;
    if (facts.ids().includes(Number(typed))) act.select(Number(typed));
  };
  const moves = () => (facts.mode() === "human"
    ? { ArrowLeft: () => act.step(-1), ArrowRight: () => act.step(1), ArrowUp: () => act.step(-1), ArrowDown: () => act.step(1) }
    : {
      ArrowLeft: () => act.go(-1), ArrowRight: () => act.go(1), Home: () => act.go("first"), End: () => act.go("last"),
      ArrowUp: () => act.step(-1), ArrowDown: () => act.step(1), t: act.trials,
    });
  const letters = {
    z: act.zoom, "+": () => act.closer(1), "-": () => act.closer(-1), m: act.tints, h: () => act.plain(true), "?": act.help, o: () => act.tab("Objects"), d: () => act.tab("Graph"), c: () => act.tab("3-D"), Escape: act.clear,
  };
  document.addEventListener("keydown", (event) => {
    if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]")) return;
    // A button of a dialog that was just closed keeps the focus until the next frame.
    const at = event.target.closest("dialog") ? document.body : event.target;
    const writes = at.matches("input:not([type=range]):not([type=checkbox])");
    if (event.key === "Enter") {
      // On a button Enter does what the button says; elsewhere, in the note too, it picks.
      if (!at.matches("button, summary, a")) { event.preventDefault(); act.pick(); }
      return;
    }
    if (writes) {
      if (event.key === "Escape") at.blur();
      return;
    }
    const own = at.matches("input[type=range], [role=tab], pre") && event.key.startsWith("Arrow");
    if (own) return;
    const human = facts.mode() === "human" ? { g: act.giveUp, n: act.note, t: act.nameTarget } : {};
    const found = { ...letters, ...human, ...moves() }[event.key];
    if (/^[0-9]$/.test(event.key)) digit(event.key, event.timeStamp);
    else if (found) { event.preventDefault(); found(); }
  });
  document.addEventListener("keyup", (event) => { if (event.key === "h") act.plain(false); });
  $("show-help").addEventListener("click", act.help);
  $("show-trials").addEventListener("click", act.trials);
}
