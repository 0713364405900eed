// Tabs as a keyboard and a screen reader expect them.

import { $, el, replace } from "./dom.js";

export function drawTabs(names, current, open) {
  const tab = (name, i) => el("button", {
    type: "button", role: "tab", id: `tab-${name}`, "aria-selected": String(name === current), "aria-controls": "panel",
    tabindex: name === current ? 0 : -1, onclick: () => open(name),
    onkeydown: (event) => {
      const by = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (!by) return;
      event.preventDefault();
      const next = names[(i + by + names.length) % names.length];
      open(next);
      $(`tab-${next}`).focus();
    },
  }, name);
  replace($("tabs"), names.map(tab));
  $("panel").setAttribute("aria-labelledby", `tab-${current}`);
}
