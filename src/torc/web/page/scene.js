// The 3-D view: surface points, the space that was never seen, and the grasps of the selected object.

import { el } from "./dom.js";
import { cloud, grasps, HALF_VIEW, unseen, ways } from "./mesh.js";
import { OrbitControls } from "./vendor/three/OrbitControls.js";
import * as THREE from "./vendor/three/three.module.min.js";

const CLICK_PX = 9, DRAG_PX = 4;
const STEP = 0.12, ZOOM = 0.85;
const OVERVIEW = [-0.62, -0.62, 0.55], TOP = [-0.01, 0, 1];
const GRAY = new THREE.Color("#9698a0");

// Colors go to the screen as the style sheet and the camera name them.
THREE.ColorManagement.enabled = false;

export class Scene {
  constructor(select) {
    this.select = select;
    this.options = { unseen: true, byObject: false };
    this.canvas = el("canvas", { tabindex: 0, "aria-label": "3-D view: drag or arrow keys turn it, the wheel or + and - zoom" });
    this.node = el("div", { id: "scene-box" }, this.canvas, this.tools());
    // Without WebGL there is no renderer.
    try { this.renderer = new THREE.WebGLRenderer({ canvas: this.canvas, antialias: true }); } catch { return; }
    this.renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
    this.parts = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(THREE.MathUtils.radToDeg(2 * HALF_VIEW), 1, 0.02, 20);
    this.camera.up.set(0, 0, 1);
    this.steer();
    this.canvas.addEventListener("webglcontextrestored", () => this.draw());
    new ResizeObserver(() => this.resize()).observe(this.canvas);
  }

  // arrays of a pick; objects with id and color; places of the fingertips by motion, once there is a plan
  show(arrays, objects, selected, planned = {}) {
    const plan = JSON.stringify(planned);
    if (arrays === this.arrays && selected === this.selected && plan === this.plan) return;
    const first = !this.arrays;
    Object.assign(this, { arrays, selected, planned, plan });
    this.colors = new Map(objects.map((o) => [o.id, new THREE.Color(o.color)]));
    this.rebuild();
    if (first) this.from(OVERVIEW);
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

  // Drag, wheel, pinch and keys move the camera; a press without a drag picks an object.
  steer() {
    const controls = this.controls = new OrbitControls(this.camera, this.canvas);
    Object.assign(controls, { minDistance: 0.08, maxDistance: 6, minPolarAngle: 0.005, maxPolarAngle: Math.PI / 2 + 0.4 });
    Object.assign(controls, { rotateSpeed: 0.6, zoomSpeed: 2 });
    controls.mouseButtons.MIDDLE = THREE.MOUSE.PAN;
    controls.addEventListener("change", () => this.draw());
    const keys = {
      ArrowLeft: () => controls.rotateLeft(STEP), ArrowRight: () => controls.rotateLeft(-STEP),
      ArrowUp: () => controls.rotateUp(STEP), ArrowDown: () => controls.rotateUp(-STEP),
      "+": () => controls.dollyIn(ZOOM), "-": () => controls.dollyOut(ZOOM),
    };
    this.canvas.addEventListener("keydown", (event) => {
      if (!keys[event.key]) return;
      event.preventDefault();
      keys[event.key]();
    });
    let press = null;
    this.canvas.addEventListener("pointerdown", (event) => { press = event; });
    this.canvas.addEventListener("click", (event) => {
      if (Math.hypot(event.clientX - press.clientX, event.clientY - press.clientY) < DRAG_PX) this.pick(event);
    });
  }

  rebuild() {
    if (!this.arrays) return;
    const color = this.colors.get(this.selected);
    for (const part of this.parts.children) part.geometry.dispose();
    this.cloud = cloud(this.arrays, this.options.byObject ? this.colors : new Map());
    this.parts.clear().add(this.cloud, grasps(this.arrays, color ? this.selected : -1, this.style("--valid"), this.style("--other")));
    if (this.options.unseen) this.parts.add(unseen(this.arrays, color ? this.selected : null, color || GRAY));
    const planned = Object.keys(this.planned).length > 0;
    if (planned) this.parts.add(ways(this.planned, this.style("--hidden-by"), this.style("--below")));
    const way = planned ? "; the planned way of the fingertips: violet, to the grasp and up red" : "";
    this.says.textContent = (color
      ? `space and grasps of object ${this.selected} (blue: valid, orange: not)`
      : "all space that was never seen") + way;
    this.draw();
  }

  // A color of the style sheet.
  style(name) {
    return new THREE.Color(getComputedStyle(document.documentElement).getPropertyValue(name).trim());
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  draw() {
    this.renderer.setClearColor(this.style("--card"));
    this.renderer.render(this.parts, this.camera);
  }

  // A sphere around the objects; without any, around what the robot watches.
  heap() {
    const { origin, grid, voxel_size_m: size, points, ids, point_unit_m: unit } = this.arrays;
    const box = new THREE.Box3();
    ids.data.forEach((id, i) => { if (id >= 0) box.expandByPoint(new THREE.Vector3().fromArray(points.data, 3 * i).multiplyScalar(unit)); });
    if (box.isEmpty()) box.set(new THREE.Vector3(), new THREE.Vector3(grid[0], grid[1], 0.4 * grid[2]).multiplyScalar(size)).translate(new THREE.Vector3(...origin));
    return box.getBoundingSphere(new THREE.Sphere());
  }

  lookFrom(eye) {
    this.camera.position.copy(eye);
    this.controls.target.copy(this.heap().center);
    this.controls.update();
  }

  // From where the robot's camera is.
  asCamera() {
    if (this.arrays) this.lookFrom(new THREE.Vector3(...this.arrays.T_world_camera.slice(0, 3).map((row) => row[3])));
  }

  from(direction) {
    if (!this.arrays) return;
    const { center, radius } = this.heap();
    const narrow = HALF_VIEW * Math.min(1, this.camera.aspect);
    this.lookFrom(center.addScaledVector(new THREE.Vector3(...direction).normalize(), Math.max(0.3, 0.8 * radius / Math.sin(narrow))));
  }

  // The object whose point is under the pointer, the nearest one to the eye.
  pick(event) {
    if (!this.cloud) return;
    const { width, height, left, top } = this.canvas.getBoundingClientRect();
    const at = new THREE.Vector2(2 * (event.clientX - left) / width - 1, 1 - 2 * (event.clientY - top) / height);
    const ray = new THREE.Raycaster();
    ray.params.Points.threshold = CLICK_PX * 2 * Math.tan(HALF_VIEW) * this.controls.getDistance() / height;
    ray.setFromCamera(at, this.camera);
    const [hit] = ray.intersectObject(this.cloud);
    const id = hit ? this.arrays.ids.data[hit.index] : -1;
    if (id >= 0) this.select(id);
  }
}

export const noWebgl = () => el("p", { class: "padded faint" },
  "This browser has no WebGL, which the 3-D view needs. Everything else works without it.");
