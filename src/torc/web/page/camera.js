// The newest picture of the camera, as soon as there is one, and the facts about it.

const $ = (id) => document.getElementById(id);
let shown = 0;
let address = "";

function tell(facts) {
  $("trouble").hidden = !facts.trouble;
  $("trouble").textContent = facts.trouble || "";
  if (facts.task) $("task").textContent = facts.task;
  const rows = Object.entries(facts).filter(([name]) => name !== "trouble" && name !== "task");
  if (rows.length === 0) return;
  $("facts").replaceChildren(...rows.flatMap(([name, fact]) => {
    const [term, text] = [document.createElement("dt"), document.createElement("dd")];
    term.textContent = name;
    text.textContent = fact;
    return [term, text];
  }));
}

async function next() {
  const response = await fetch(`/api/camera.jpg?after=${shown}`);
  if (!response.ok) throw new Error(`The server answered ${response.status}.`);
  if (response.status === 204) return;
  const picture = await response.blob();
  shown = Number(response.headers.get("X-Frame"));
  tell(JSON.parse(response.headers.get("X-Facts")));
  if (picture.size === 0) return;
  const before = address;
  address = URL.createObjectURL(picture);
  $("picture").src = address;
  if (before) URL.revokeObjectURL(before);
}

const pause = (ms) => new Promise((done) => setTimeout(done, ms));

async function watch() {
  for (;;) {
    try {
      if (document.hidden) await pause(300);
      else await next();
      $("connection").hidden = true;
    } catch {
      $("connection").hidden = false;
      await pause(1000);
    }
  }
}

watch();
