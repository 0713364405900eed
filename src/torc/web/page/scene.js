// The 3-D view: surface points, the space that was never seen, and the grasps of the selected object.

import { el } from "./dom.js";
import { plus, transform } from "./matrix.js";
import { cloud, grasps, unseen } from "./mesh.js";
import { Orbit } from "./orbit.js";

const VERTEX = `
attribute vec3 position; attribute vec4 color; uniform mat4 matrix; uniform float size; varying vec4 ink;
void main() { gl_Position = matrix * vec4(position, 1.0); gl_PointSize = clamp(size / gl_Position.w, 1.5, 24.0); ink = color; }`;
const FRAGMENT = "precision mediump float; varying vec4 ink; void main() { gl_FragColor = ink; }";
const POINT_M = 0.0045;
const CLICK_PX = 9;
const OVERVIEW = [-0.62, -0.62, 0.55], TOP = [-0.01, 0, 1];
const GREY = [150, 152, 160];

export class Scene {
  constructor(select) {
    this.select = select;
    this.options = { unseen: true, byObject: false };
    this.canvas = el("canvas", { tabindex: 0, "aria-label": "3-D view: drag or arrow keys turn it, the wheel or + and - zoom" });
    this.orbit = new Orbit(this.canvas, () => this.redraw(), (event) => this.pick(event));
    this.node = el("div", { id: "scene-box" }, this.canvas, this.tools());
    this.gl = this.canvas.getContext("webgl", { antialias: true, alpha: false });
    if (this.gl) this.prepare();
    this.canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    this.canvas.addEventListener("webglcontextrestored", () => { this.prepare(); this.rebuild(); });
    new ResizeObserver(() => this.redraw()).observe(this.canvas);
  }

  // arrays of a pick; objects with id and color
  show(arrays, objects, selected) {
    const fresh = arrays !== this.arrays;
    const changed = fresh || selected !== this.selected;
    Object.assign(this, { arrays, selected });
    this.colors = new Map(objects.map((o) => [o.id, [1, 3, 5].map((i) => parseInt(o.color.slice(i, i + 2), 16))]));
    if (fresh && !this.seenBefore) this.from(OVERVIEW);
    this.seenBefore = true;
    if (changed) this.rebuild();
  }

  tools() {
    const box = (name, label) => el("label", {}, el("input", {
      type: "checkbox", checked: this.options[name],
      onchange: (event) => { this.options[name] = event.target.checked; this.rebuild(); },
    }), label);
    const view = (label, go) => el("button", { type: "button", onclick: go }, label);
    this.says = el("span", { class: "faint" });
    return el("div", { class: "tools" },
      view("Overview", () => this.from(OVERVIEW)), view("Camera", () => this.asCamera()), view("Top", () => this.from(TOP)),
      box("unseen", "unseen space"), box("byObject", "object colours"), this.says);
  }

  prepare() {
    const gl = this.gl;
    const program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    gl.useProgram(program);
    this.places = { position: gl.getAttribLocation(program, "position"), color: gl.getAttribLocation(program, "color") };
    this.matrix = gl.getUniformLocation(program, "matrix");
    this.size = gl.getUniformLocation(program, "size");
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    this.meshes = {};
  }

  rebuild() {
    if (!this.gl || !this.arrays) return;
    const some = this.selected !== null && this.colors.has(this.selected);
    const own = some ? this.colors.get(this.selected) : GREY;
    this.load("cloud", cloud(this.arrays, this.options.byObject, this.colors));
    this.load("unseen", unseen(this.arrays, some ? this.selected : null, own));
    this.load("grasps", grasps(this.arrays, some ? this.selected : -1, this.color("--valid"), this.color("--other")));
    this.says.textContent = some
      ? `space and grasps of object ${this.selected} (blue: valid, orange: not)`
      : "all space that was never seen";
    this.redraw();
  }

  // A colour of the style sheet, 0..255.
  color(name) {
    const code = getComputedStyle(document.documentElement).getPropertyValue(name).trim();
    return [1, 3, 5].map((i) => parseInt(code.slice(i, i + 2), 16));
  }

  load(name, mesh) {
    const gl = this.gl;
    const old = this.meshes[name];
    if (old) [old.position, old.color].forEach((buffer) => gl.deleteBuffer(buffer));
    const buffer = (data) => {
      const made = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, made);
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
      return made;
    };
    this.meshes[name] = { count: mesh.count, position: buffer(mesh.positions), color: buffer(mesh.rgba), points: mesh.positions };
  }

  redraw() {
    if (this.waiting || !this.gl) return;
    this.waiting = true;
    requestAnimationFrame(() => { this.waiting = false; this.draw(); });
  }

  draw() {
    const gl = this.gl;
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height || !this.meshes.cloud) return;
    const ratio = Math.min(2, window.devicePixelRatio || 1);
    Object.assign(this.canvas, { width: Math.round(width * ratio), height: Math.round(height * ratio) });
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.clearColor(...this.color("--card").map((v) => v / 255), 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.uniformMatrix4fv(this.matrix, false, this.projection());
    gl.uniform1f(this.size, POINT_M * this.canvas.height / (2 * Math.tan(0.4)));
    gl.disable(gl.BLEND);
    this.drawMesh("cloud", gl.POINTS);
    this.drawMesh("grasps", gl.LINES);
    if (this.options.unseen) {
      gl.enable(gl.BLEND);
      gl.depthMask(false);
      this.drawMesh("unseen", gl.TRIANGLES);
      gl.depthMask(true);
    }
  }

  drawMesh(name, kind) {
    const gl = this.gl;
    const mesh = this.meshes[name];
    gl.bindBuffer(gl.ARRAY_BUFFER, mesh.position);
    gl.enableVertexAttribArray(this.places.position);
    gl.vertexAttribPointer(this.places.position, 3, gl.FLOAT, false, 0, 0);
    gl.bindBuffer(gl.ARRAY_BUFFER, mesh.color);
    gl.enableVertexAttribArray(this.places.color);
    gl.vertexAttribPointer(this.places.color, 4, gl.UNSIGNED_BYTE, true, 0, 0);
    gl.drawArrays(kind, 0, mesh.count);
  }

  projection() {
    return this.orbit.matrix(this.canvas.clientWidth / this.canvas.clientHeight);
  }

  middle() {
    const { origin, grid, voxel_size_m: size } = this.arrays;
    return origin.map((o, k) => o + grid[k] * size * (k === 2 ? 0.2 : 0.5));
  }

  // From where the robot's camera is.
  asCamera() {
    if (this.arrays) this.orbit.lookFrom(this.arrays.T_world_camera.slice(0, 3).map((row) => row[3]), this.middle());
  }

  from(direction) {
    if (this.arrays) this.orbit.lookFrom(plus(this.middle(), direction, 1.1), this.middle());
  }

  // The object whose point is under the pointer, the nearest one to the eye.
  pick(event) {
    if (!this.arrays || !this.gl) return;
    const box = this.canvas.getBoundingClientRect();
    const matrix = this.projection();
    const { points } = this.meshes.cloud;
    const ids = this.arrays.ids.data;
    let best = null;
    for (let i = 0; i < ids.length; i++) {
      const [x, y, , w] = transform(matrix, points.subarray(3 * i, 3 * i + 3));
      if (w <= 0) continue;
      const dx = (x / w + 1) / 2 * box.width - (event.clientX - box.left);
      const dy = (1 - y / w) / 2 * box.height - (event.clientY - box.top);
      if (Math.hypot(dx, dy) < CLICK_PX && (best === null || w < best.w)) best = { w, id: ids[i] };
    }
    if (best && best.id >= 0) this.select(best.id);
  }
}

export const noWebgl = () => el("p", { class: "padded faint" },
  "This browser has no WebGL, which the 3-D view needs. Everything else works without it.");
