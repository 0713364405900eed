// The picture and its marks: which object is under the pointer, the selected one brought out.

import { $ } from "./dom.js";
import { drawMarks, rims, tagBox } from "./marks.js";
import { Zoom } from "./zoom.js";

const FINGER_PX = 8;

export class Picture {
  // on.hover(id or null), on.select(id)
  constructor(on) {
    Object.assign(this, { on, objects: [], labels: null, rims: new Map(), selected: null, hovered: null, pointer: null });
    Object.assign(this, { tints: false, hidden: false });
    const canvas = $("overlay");
    this.zoom = new Zoom(canvas, () => this.draw());
    canvas.addEventListener("pointermove", (event) => { this.pointer = event; this.hover(this.idAt(event)); });
    canvas.addEventListener("pointerleave", () => { this.pointer = null; this.hover(null); });
    canvas.addEventListener("click", (event) => {
      const id = this.zoom.dragged ? null : this.idAt(event);
      if (id !== null) this.on.select(id);
    });
    $("zoom").addEventListener("click", () => this.toggleZoom());
    $("closer").addEventListener("click", () => this.zoom.step(1));
    $("farther").addEventListener("click", () => this.zoom.step(-1));
    $("tints").addEventListener("click", () => this.toggleTints());
    $("plain").addEventListener("pointerdown", () => this.hide(true));
    for (const end of ["pointerup", "pointercancel", "blur"]) addEventListener(end, () => this.hide(false));
    $("plain").addEventListener("contextmenu", (event) => event.preventDefault());
    $("seen").addEventListener("load", () => this.place());
  }

  // path of the pick's pictures; page: its objects, and whether there is a picture without marks
  show(path, page, description) {
    const image = $("seen");
    const url = `${path}/${page.plain ? "plain" : "seen"}.png`;
    Object.assign(this, { objects: page.objects, own: page.plain });
    if (image.getAttribute("src") !== url) {
      Object.assign(this, { labels: null, rims: new Map() });
      image.src = url;
    }
    image.alt = description;
    image.hidden = false;
    this.place();
  }

  clear() {
    $("seen").hidden = true;
    // A trial that is played again has the same addresses.
    $("seen").removeAttribute("src");
    Object.assign(this, { objects: [], labels: null, rims: new Map() });
    this.draw();
  }

  setLabels(labels) {
    if (labels === this.labels) return;
    this.labels = labels;
    this.rims = rims(labels);
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
    this.zoom.toggle();
  }

  toggleTints() {
    this.tints = !this.tints;
    this.draw();
  }

  // Marks away, as long as a key or the button is held.
  hide(hidden) {
    if (hidden === this.hidden) return;
    this.hidden = hidden;
    this.draw();
  }

  // The object whose tag, or else whose pixel, is there.
  idAt(event) {
    const [x, y] = this.zoom.at(event);
    const pad = event.pointerType === "touch" ? FINGER_PX : 0;
    const off = ({ left, top, width, height }) => Math.max(left - x, x - left - width, top - y, y - top - height);
    const [nearest] = this.objects.filter((o) => o.tag)
      .map((o) => ({ id: o.id, px: off(this.own ? tagBox(o.tag.box, this.zoom.view) : this.drawnTag(o)) }))
      .sort((a, b) => a.px - b.px);
    if (nearest?.px <= 0) return nearest.id;
    const here = this.pixelAt(x, y);
    return here === null && nearest?.px <= pad ? nearest.id : here;
  }

  // Where a tag lies that is part of the picture.
  drawnTag({ tag: { box: [left, top, width, height] } }) {
    const { scale, x, y } = this.zoom.view;
    return { left: x + left * scale, top: y + top * scale, width: width * scale, height: height * scale };
  }

  pixelAt(x, y) {
    if (!this.labels) return null;
    const { data, shape: [height, width] } = this.labels;
    const { scale, x: left, y: top } = this.zoom.view;
    const [col, row] = [Math.floor((x - left) / scale), Math.floor((y - top) / scale)];
    if (col < 0 || row < 0 || col >= width || row >= height) return null;
    const id = data[row * width + col];
    return id >= 0 ? id : null;
  }

  place() {
    const { naturalWidth: width, naturalHeight: height } = $("seen");
    if (width) this.zoom.show({ width, height }, this.objects.filter((o) => o.box).map((o) => o.box));
    else this.draw();
  }

  draw() {
    const canvas = $("overlay");
    const { width, height } = canvas.getBoundingClientRect();
    const [columns, rows] = [width, height].map((length) => Math.round(length * window.devicePixelRatio));
    if (canvas.width !== columns || canvas.height !== rows) Object.assign(canvas, { width: columns, height: rows });
    const context = canvas.getContext("2d");
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, columns, rows);
    const { scale, x, y } = this.zoom.view;
    $("seen").style.transform = `translate(${x}px, ${y}px) scale(${scale})`;
    $("zoom").setAttribute("aria-pressed", String(this.zoom.close && !this.zoom.free));
    $("tints").setAttribute("aria-pressed", String(this.tints));
    for (const id of ["tints", "plain"]) $(id).disabled = !this.own;
    if (!this.hidden && !$("seen").hidden) drawMarks(context, this.zoom.view, this);
  }
}
