// Talking to the server. Every answer can be asked for again, so a lost connection loses nothing.

export class Refused extends Error {}

async function answer(response) {
  const data = await response.json().catch(() => ({ error: `The server answered ${response.status}.` }));
  if (!response.ok) throw new Refused(data.error || `The server answered ${response.status}.`);
  return data;
}

export const get = async (path) => answer(await fetch(path));

export async function post(path, data) {
  const headers = { "Content-Type": "application/json" };
  return answer(await fetch(path, { method: "POST", headers, body: JSON.stringify(data) }));
}

export const trialPath = (key) => `/api/trials/${encodeURIComponent(key)}`;
export const pickPath = (key, pick) => `${trialPath(key)}/picks/${pick}`;

const TYPES = { i1: Int8Array, u1: Uint8Array, i2: Int16Array, u2: Uint16Array, u4: Uint32Array, f4: Float32Array };

// Masks, cloud, voxels and grasps of a pick: {labels: {data, shape}, ..., and the header's other fields}.
export async function getArrays(key, pick) {
  const response = await fetch(`${pickPath(key, pick)}/arrays`);
  if (!response.ok) await answer(response);
  const buffer = await response.arrayBuffer();
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const found = { ...header };
  for (const { name, type, shape, offset } of header.arrays) {
    const count = shape.reduce((a, b) => a * b, 1);
    found[name] = { data: new TYPES[type](buffer, 4 + length + offset, count), shape };
  }
  return found;
}

// Calls tell(state) with every change of the session, and lost(true/false) as the connection goes and comes.
// A hidden tab lets go of its connection: browsers allow only six to one server.
export function follow(tell, lost) {
  let source = null;
  let heard = 0;
  const open = () => {
    source?.close();
    heard = Date.now();
    source = new EventSource("/api/session/changes");
    const alive = () => { heard = Date.now(); lost(false); };
    source.onopen = alive;
    source.addEventListener("alive", alive);
    source.onmessage = (event) => { alive(); tell(JSON.parse(event.data)); };
    source.onerror = () => lost(true);
  };
  const close = () => { source?.close(); source = null; };
  setInterval(() => {
    if (source === null) return;
    // Browsers give up on an answer that is no stream, and do not notice a cable that is pulled.
    if (source.readyState === EventSource.CLOSED || Date.now() - heard > 25000) { lost(true); open(); }
  }, 1500);
  document.addEventListener("visibilitychange", () => (document.hidden ? close() : open()));
  open();
}

// Calls show(url) with each new picture of the robot while wanted() says so.
export async function watchRobot(wanted, show) {
  let after = 0;
  let last = null;
  for (;;) {
    if (!wanted() || document.hidden) { await pause(150); continue; }
    try {
      const response = await fetch(`/api/robot.jpg?after=${after}`);
      if (response.status !== 200) { await pause(100); continue; }
      after = Number(response.headers.get("X-Frame"));
      const url = URL.createObjectURL(await response.blob());
      show(url);
      if (last) URL.revokeObjectURL(last);
      last = url;
    } catch { await pause(1000); }
  }
}

const pause = (ms) => new Promise((done) => setTimeout(done, ms));
