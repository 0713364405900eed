// A camera that goes round a point: drag, wheel, pinch, arrow keys.

import { cross, lookAt, minus, multiply, perspective, plus, unit } from "./matrix.js";

const UP = [0, 0, 1];
const STEP = 0.12;

export class Orbit {
  // changed() after every move, clicked(event) for a press without a drag
  constructor(canvas, changed, clicked) {
    this.canvas = canvas;
    this.changed = changed;
    this.pointers = new Map();
    this.lookFrom([0.1, 0, 1.38], [0.65, -0.12, 1.1]);
    canvas.addEventListener("pointerdown", (e) => this.down(e));
    canvas.addEventListener("pointermove", (e) => this.move(e));
    for (const kind of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(kind, (e) => {
        this.pointers.delete(e.pointerId);
        if (kind === "pointerup" && !this.dragged) clicked(e);
      });
    }
    canvas.addEventListener("wheel", (e) => { e.preventDefault(); this.zoom(Math.exp(e.deltaY * 0.0012)); }, { passive: false });
    canvas.addEventListener("contextmenu", (e) => e.preventDefault());
    canvas.addEventListener("keydown", (e) => this.key(e));
  }

  lookFrom(eye, at) {
    const from = minus(eye, at);
    this.at = at;
    this.distance = Math.hypot(...from);
    this.turn = Math.atan2(from[1], from[0]);
    this.tilt = Math.asin(from[2] / this.distance);
    this.changed();
  }

  get eye() {
    const flat = Math.cos(this.tilt) * this.distance;
    return plus(this.at, [Math.cos(this.turn) * flat, Math.sin(this.turn) * flat, Math.sin(this.tilt) * this.distance]);
  }

  matrix(aspect) {
    return multiply(perspective(0.8, aspect, 0.02, 20), lookAt(this.eye, this.at, UP));
  }

  zoom(factor) {
    this.distance = Math.min(6, Math.max(0.08, this.distance * factor));
    this.changed();
  }

  rotate(turn, tilt) {
    this.turn += turn;
    this.tilt = Math.min(1.55, Math.max(-0.4, this.tilt + tilt));
    this.changed();
  }

  pan(right, up) {
    const forward = unit(minus(this.at, this.eye));
    const x = unit(cross(forward, UP));
    this.at = plus(plus(this.at, x, right * this.distance), cross(x, forward), up * this.distance);
    this.changed();
  }

  down(event) {
    this.canvas.setPointerCapture(event.pointerId);
    if (this.pointers.size === 0) this.dragged = false;
    this.pointers.set(event.pointerId, [event.clientX, event.clientY]);
  }

  move(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    const now = [event.clientX, event.clientY];
    const [dx, dy] = [now[0] - before[0], now[1] - before[1]];
    if (!this.dragged && Math.hypot(dx, dy) < 4) return;
    this.dragged = true;
    const height = this.canvas.clientHeight;
    if (this.pointers.size > 1) {
      const [other] = [...this.pointers].filter(([id]) => id !== event.pointerId).map(([, place]) => place);
      const gap = (place) => Math.hypot(place[0] - other[0], place[1] - other[1]) || 1;
      this.zoom(gap(before) / gap(now));
      this.pan(-dx / height / 2, dy / height / 2);
    } else if (event.shiftKey || event.buttons & 6) {
      this.pan(-dx / height, dy / height);
    } else {
      this.rotate(-dx * 0.008, dy * 0.008);
    }
    this.pointers.set(event.pointerId, now);
  }

  key(event) {
    const moves = {
      ArrowLeft: () => this.rotate(-STEP, 0), ArrowRight: () => this.rotate(STEP, 0),
      ArrowUp: () => this.rotate(0, STEP), ArrowDown: () => this.rotate(0, -STEP),
      "+": () => this.zoom(0.85), "-": () => this.zoom(1.18),
    };
    if (!moves[event.key]) return;
    event.preventDefault();
    event.stopPropagation();
    moves[event.key]();
  }
}
