// The marked image: which object is under the pointer, the selected one brought out, zoom to the objects.

import { $ } from "./dom.js";

const PAD = 24;

export class Picture {
  // on.hover(id or null), on.select(id)
  constructor(on) {
    this.on = on;
    this.labels = null;
    this.selected = null;
    this.hovered = null;
    this.pointer = null;
    this.zooming = false;
    const canvas = $("overlay");
    canvas.addEventListener("pointermove", (event) => { this.pointer = event; this.hover(this.idAt(event)); });
    canvas.addEventListener("pointerleave", () => { this.pointer = null; this.hover(null); });
    canvas.addEventListener("click", (event) => {
      const id = this.idAt(event);
      if (id !== null) this.on.select(id);
    });
    $("zoom").addEventListener("click", () => this.toggleZoom());
    new ResizeObserver(() => this.place()).observe($("view"));
    $("seen").addEventListener("load", () => this.place());
  }

  // url of the picture; boxes of the objects for zooming
  show(url, boxes, description) {
    const image = $("seen");
    if (image.getAttribute("src") !== url) image.src = url;
    image.alt = description;
    image.hidden = false;
    this.boxes = boxes;
    this.labels = null;
    this.draw();
    this.place();
  }

  hide() {
    $("seen").hidden = true;
    // A trial that is played again has the same addresses.
    $("seen").removeAttribute("src");
    this.labels = null;
    this.draw();
  }

  setLabels(labels) {
    this.labels = labels;
    const [height, width] = labels.shape;
    Object.assign($("overlay"), { width, height });
    // The pointer may have come before the masks.
    if (this.pointer) this.hover(this.idAt(this.pointer));
    this.draw();
  }

  select(id) {
    this.selected = id;
    this.draw();
  }

  hover(id) {
    if (id === this.hovered) return;
    this.hovered = id;
    this.on.hover(id);
    this.draw();
  }

  toggleZoom() {
    this.zooming = !this.zooming;
    $("zoom").setAttribute("aria-pressed", String(this.zooming));
    this.place();
  }

  idAt(event) {
    if (!this.labels) return null;
    const [height, width] = this.labels.shape;
    const box = $("overlay").getBoundingClientRect();
    const scale = Math.min(box.width / width, box.height / height);
    const x = Math.floor((event.clientX - box.left - (box.width - width * scale) / 2) / scale);
    const y = Math.floor((event.clientY - box.top - (box.height - height * scale) / 2) / scale);
    if (x < 0 || y < 0 || x >= width || y >= height) return null;
    const id = this.labels.data[y * width + x];
    return id >= 0 ? id : null;
  }

  draw() {
    const canvas = $("overlay");
    const context = canvas.getContext("2d");
    context.clearRect(0, 0, canvas.width, canvas.height);
    if (!this.labels) return;
    const pixels = context.createImageData(canvas.width, canvas.height);
    if (this.hovered !== null && this.hovered !== this.selected) this.outline(pixels, this.hovered, 1, 60);
    if (this.selected !== null) this.outline(pixels, this.selected, 3, 0);
    context.putImageData(pixels, 0, 0);
  }

  // White outside the mask and black around that, so that it shows on anything.
  outline(pixels, id, px, glow) {
    const { data, shape: [height, width] } = this.labels;
    const out = pixels.data;
    const reach = px + 1;
    for (let y = 0; y < height; y++) {
      for (let x = 0; x < width; x++) {
        const here = y * width + x;
        if (data[here] === id) {
          if (glow) out.set([255, 255, 255, glow], 4 * here);
          const border = x === 0 || y === 0 || x === width - 1 || y === height - 1 ||
            data[here - 1] !== id || data[here + 1] !== id || data[here - width] !== id || data[here + width] !== id;
          if (!border) continue;
          for (let v = Math.max(0, y - reach); v <= Math.min(height - 1, y + reach); v++) {
            for (let u = Math.max(0, x - reach); u <= Math.min(width - 1, x + reach); u++) {
              const there = v * width + u;
              const far = Math.max(Math.abs(u - x), Math.abs(v - y));
              if (data[there] === id && far > 0) continue;
              if (far <= px) out.set([255, 255, 255, 255], 4 * there);
              else if (out[4 * there + 3] === 0) out.set([0, 0, 0, 255], 4 * there);
            }
          }
        }
      }
    }
  }

  // Zoomed so far that all objects fill the view.
  place() {
    const target = $("zoomed").style;
    const image = $("seen");
    const boxes = this.zooming && image.naturalWidth ? Object.values(this.boxes || {}) : [];
    if (!boxes.length) { target.transform = ""; return; }
    const view = $("view").getBoundingClientRect();
    const fit = Math.min(view.width / image.naturalWidth, view.height / image.naturalHeight);
    const left = Math.min(...boxes.map((b) => b[0])) - PAD;
    const top = Math.min(...boxes.map((b) => b[1])) - PAD;
    const right = Math.max(...boxes.map((b) => b[2])) + PAD;
    const bottom = Math.max(...boxes.map((b) => b[3])) + PAD;
    const grow = Math.min(4, view.width / ((right - left) * fit), view.height / ((bottom - top) * fit));
    const x = (view.width - image.naturalWidth * fit) / 2 + ((left + right) / 2) * fit;
    const y = (view.height - image.naturalHeight * fit) / 2 + ((top + bottom) / 2) * fit;
    target.transform = `translate(${view.width / 2 - grow * x}px, ${view.height / 2 - grow * y}px) scale(${grow})`;
  }
}
