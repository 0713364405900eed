// Which part of the picture is shown: all of it, the objects, or what wheel, fingers and drags ask for.

const MOST = 12;
const PAD = 24, STEP = 1.3, DRAG_PX = 5;

const around = (boxes) => [
  ...[0, 1].map((k) => Math.min(...boxes.map((box) => box[k])) - PAD), ...[2, 3].map((k) => Math.max(...boxes.map((box) => box[k])) + PAD),
];

export class Zoom {
  // node: takes the gestures; changed(); the view is {scale, x, y}: x + scale * pixel is a place in the node
  constructor(node, changed) {
    Object.assign(this, { node, changed, boxes: [], size: null, close: true, free: false, view: { scale: 1, x: 0, y: 0 } });
    this.pointers = new Map();
    this.dragged = false;
    node.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.by(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0015)), this.at(event));
    }, { passive: false });
    node.addEventListener("pointerdown", (event) => {
      if (!this.pointers.size) this.dragged = false;
      this.pointers.set(event.pointerId, this.at(event));
    });
    node.addEventListener("pointermove", (event) => this.move(event));
    for (const gone of ["pointerup", "pointercancel", "pointerleave"]) {
      node.addEventListener(gone, (event) => this.pointers.delete(event.pointerId));
    }
    new ResizeObserver(() => this.fit()).observe(node);
  }

  // The size of the picture, and the boxes of the objects in it.
  show(size, boxes) {
    const same = this.size && size.width === this.size.width && size.height === this.size.height;
    Object.assign(this, { size, boxes });
    if (same && this.free) this.set(this.view); else this.fit();
  }

  toggle() {
    this.close = this.free || !this.close;
    this.free = false;
    this.fit();
  }

  // All of the picture, or, close, the objects with a margin.
  fit() {
    const { width, height } = this.node.getBoundingClientRect();
    if (!this.size || !width || !height) return;
    if (this.free) { this.set(this.view); return; }
    const [left, top, right, bottom] = this.close && this.boxes.length ? around(this.boxes) : [0, 0, this.size.width, this.size.height];
    const scale = Math.min(width / (right - left), height / (bottom - top));
    this.set({ scale, x: width / 2 - scale * (left + right) / 2, y: height / 2 - scale * (top + bottom) / 2 });
  }

  by(factor, [x, y] = this.middle()) {
    if (!this.size) return;
    const scale = this.limited(this.view.scale * factor);
    const grow = scale / this.view.scale;
    this.free = true;
    this.set({ scale, x: x - grow * (x - this.view.x), y: y - grow * (y - this.view.y) });
  }

  step(direction) {
    this.by(STEP ** direction);
  }

  get whole() {
    const { width, height } = this.node.getBoundingClientRect();
    return Math.min(width / this.size.width, height / this.size.height);
  }

  limited(scale) {
    return Math.max(this.whole, Math.min(MOST * this.whole, scale));
  }

  // Within the limits, and never so far aside that the picture leaves the view.
  set(view) {
    const { width, height } = this.node.getBoundingClientRect();
    const scale = this.limited(view.scale);
    const within = (at, room, length) => (length <= room ? (room - length) / 2 : Math.min(0, Math.max(room - length, at)));
    this.view = { scale, x: within(view.x, width, scale * this.size.width), y: within(view.y, height, scale * this.size.height) };
    // A finger on a picture that nobody has zoomed into scrolls the page.
    this.node.style.touchAction = this.free ? "none" : "pan-y";
    this.changed();
  }

  move(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before || !this.size) return;
    const now = this.at(event);
    const others = [...this.pointers].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
    const far = Math.hypot(now[0] - before[0], now[1] - before[1]);
    if (!this.dragged && far < DRAG_PX && !others.length) return;
    this.dragged = true;
    this.pointers.set(event.pointerId, now);
    if (others.length) {
      const apart = (at) => Math.hypot(at[0] - others[0][0], at[1] - others[0][1]);
      this.by(apart(now) / Math.max(1, apart(before)), [(now[0] + others[0][0]) / 2, (now[1] + others[0][1]) / 2]);
    } else if (event.pointerType === "mouse" || this.free) {
      this.free = true;
      this.set({ ...this.view, x: this.view.x + now[0] - before[0], y: this.view.y + now[1] - before[1] });
    }
  }

  at(event) {
    const { left, top } = this.node.getBoundingClientRect();
    return [event.clientX - left, event.clientY - top];
  }

  middle() {
    const { width, height } = this.node.getBoundingClientRect();
    return [width / 2, height / 2];
  }
}
