// What the 3-D view draws, as objects of three.js.

import {
  BoxGeometry, BufferGeometry, DoubleSide, Float32BufferAttribute, LineBasicMaterial, LineSegments, Matrix4, Mesh,
  MeshBasicMaterial, Points, PointsMaterial, Vector3,
} from "./vendor/three/three.module.min.js";

// Half the angle of view, up and down.
export const HALF_VIEW = 0.4;
const POINT_M = 0.0045, PAD_M = 0.012, FINGER_M = 0.045;
const VALID = 0;

const SURFACE = new PointsMaterial({ size: POINT_M / Math.tan(HALF_VIEW), vertexColors: true });
SURFACE.onBeforeCompile = (shader) => {
  shader.vertexShader = shader.vertexShader.replace("#include <fog_vertex>", "gl_PointSize = clamp(gl_PointSize, 1.5, 24.0);");
};
const LINES = new LineBasicMaterial({ vertexColors: true });
const UNSEEN = new MeshBasicMaterial({ vertexColors: true, transparent: true, opacity: 0.2, depthWrite: false, side: DoubleSide });

// Six vertices for each face of a voxel, and the faces' brightness.
const CUBE = new BoxGeometry().toNonIndexed().attributes;
const LIGHT = [0.82, 0.82, 0.9, 0.9, 1, 0.7];

const geometry = (positions, colors) => new BufferGeometry()
  .setAttribute("position", new Float32BufferAttribute(positions, 3))
  .setAttribute("color", new Float32BufferAttribute(colors, 3));

// Surface points in metres; colors: by id, in place of those that the camera saw.
export function cloud(arrays, colors) {
  const rgb = Float32Array.from(arrays.colors.data, (v) => v / 255);
  arrays.ids.data.forEach((id, i) => colors.get(id)?.toArray(rgb, 3 * i));
  return new Points(geometry(Float32Array.from(arrays.points.data, (v) => v * arrays.point_unit_m), rgb), SURFACE);
}

// The outer faces of the unseen voxels, or of those that one object hides.
export function unseen(arrays, hiddenBy, color) {
  const { voxels, hider, hiders, grid } = arrays;
  const chosen = [], positions = [], light = [];
  for (let i = 0; i < voxels.shape[0]; i++) {
    const mask = hiddenBy === null ? 1 : hiders.data[2 * hider.data[i] + (hiddenBy >> 5)] >> hiddenBy % 32;
    if (mask & 1) chosen.push(voxels.data.subarray(3 * i, 3 * i + 3));
  }
  // One empty layer around the grid spares the faces at its border a test.
  const at = (x, y, z) => ((x + 1) * (grid[1] + 2) + y + 1) * (grid[2] + 2) + z + 1;
  const inside = new Uint8Array((grid[0] + 2) * (grid[1] + 2) * (grid[2] + 2));
  for (const voxel of chosen) inside[at(...voxel)] = 1;
  for (const [x, y, z] of chosen) {
    for (let face = 0; face < 6; face++) {
      const [dx, dy, dz] = CUBE.normal.array.subarray(18 * face);
      if (inside[at(x + dx, y + dy, z + dz)]) continue;
      for (let k = 18 * face; k < 18 * face + 18; k += 3) {
        positions.push(x + CUBE.position.array[k], y + CUBE.position.array[k + 1], z + CUBE.position.array[k + 2]);
        light.push(LIGHT[face], LIGHT[face], LIGHT[face]);
      }
    }
  }
  UNSEEN.color.copy(color);
  const mesh = new Mesh(geometry(positions, light), UNSEEN);
  mesh.position.fromArray(arrays.origin).addScalar(arrays.voxel_size_m / 2);
  mesh.scale.setScalar(arrays.voxel_size_m);
  return mesh;
}

// The places of the fingertips along the planned motions, by their names: lines.
export function ways(planned, color, closeColor) {
  const positions = [], colors = [];
  for (const [name, places] of Object.entries(planned)) {
    const own = name === "approach" || name === "lift" ? closeColor : color;
    for (let i = 1; i < places.length; i++) {
      positions.push(...places[i - 1], ...places[i]);
      colors.push(...own, ...own);
    }
  }
  return new LineSegments(geometry(positions, colors), LINES);
}

// The grasps of an object as little forks: palm, two fingers, and where the gripper comes from.
export function grasps(arrays, id, validColor, otherColor) {
  const positions = [], colors = [];
  arrays.grasp_ids.data.forEach((owner, i) => {
    if (owner !== id) return;
    const pose = new Matrix4().fromArray(arrays.grasps.data, 16 * i).transpose();
    const half = arrays.grasp_widths.data[i] / 2 + PAD_M / 2;
    const fork = [
      [-half, 0], [-half, -FINGER_M], [-half, -FINGER_M], [half, -FINGER_M], [half, -FINGER_M], [half, 0],
      [0, -FINGER_M], [0, -2.2 * FINGER_M],
    ];
    const color = arrays.grasp_status.data[i] === VALID ? validColor : otherColor;
    for (const [x, z] of fork) {
      positions.push(...new Vector3(x, 0, z).applyMatrix4(pose));
      colors.push(...color);
    }
  });
  return new LineSegments(geometry(positions, colors), LINES);
}
