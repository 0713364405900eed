// What the 3-D view draws, as plain arrays of vertices.

const FACES = [
  // direction, two axes of the face, brightness
  [[1, 0, 0], 1, 2, 0.82], [[-1, 0, 0], 1, 2, 0.82], [[0, 1, 0], 0, 2, 0.9],
  [[0, -1, 0], 0, 2, 0.9], [[0, 0, 1], 0, 1, 1.0], [[0, 0, -1], 0, 1, 0.7],
];
const PAD_M = 0.012, FINGER_M = 0.045;
const VALID = 0;

// Surface points: positions in metres, colours 0..255.
export function cloud(arrays, byObject, colors) {
  const { data, shape: [count] } = arrays.points;
  const positions = Float32Array.from(data, (v) => v * arrays.point_unit_m);
  const rgba = new Uint8Array(4 * count);
  for (let i = 0; i < count; i++) {
    const own = byObject && colors.get(arrays.ids.data[i]);
    rgba.set(own || arrays.colors.data.subarray(3 * i, 3 * i + 3), 4 * i);
    rgba[4 * i + 3] = 255;
  }
  return { positions, rgba, count };
}

// The outer faces of the unseen voxels, or of those that one object hides.
export function unseen(arrays, hiddenBy, color) {
  const [nx, ny, nz] = arrays.grid;
  const { data: index, shape: [count] } = arrays.voxels;
  const inside = new Uint8Array(nx * ny * nz);
  const rows = rowsHiddenBy(arrays, hiddenBy);
  const chosen = [];
  for (let i = 0; i < count; i++) {
    if (rows && !rows[arrays.hider.data[i]]) continue;
    inside[(index[3 * i] * ny + index[3 * i + 1]) * nz + index[3 * i + 2]] = 1;
    chosen.push(i);
  }
  const holds = (x, y, z) => x >= 0 && y >= 0 && z >= 0 && x < nx && y < ny && z < nz && inside[(x * ny + y) * nz + z];
  const positions = [], rgba = [];
  for (const i of chosen) {
    const cell = [index[3 * i], index[3 * i + 1], index[3 * i + 2]];
    for (const [direction, u, v, light] of FACES) {
      if (holds(cell[0] + direction[0], cell[1] + direction[1], cell[2] + direction[2])) continue;
      const base = cell.map((c, k) => c + (direction[k] > 0 ? 1 : 0));
      for (const [a, b] of [[0, 0], [1, 0], [1, 1], [0, 0], [1, 1], [0, 1]]) {
        const corner = [...base];
        corner[u] += a;
        corner[v] += b;
        for (let k = 0; k < 3; k++) positions.push(arrays.origin[k] + corner[k] * arrays.voxel_size_m);
        rgba.push(color[0] * light, color[1] * light, color[2] * light, 52);
      }
    }
  }
  return { positions: new Float32Array(positions), rgba: new Uint8Array(rgba), count: positions.length / 3 };
}

// Which masks of hiders hold the object; null: all voxels, whoever hides them.
function rowsHiddenBy(arrays, id) {
  if (id === null) return null;
  const { data, shape: [count] } = arrays.hiders;
  const bit = 1 << (id % 32);
  return Uint8Array.from({ length: count }, (_, i) => ((data[2 * i + (id < 32 ? 0 : 1)] & bit) !== 0 ? 1 : 0));
}

// The grasps of an object as little forks: palm, two fingers, and where the gripper comes from.
export function grasps(arrays, id, validColor, otherColor) {
  const positions = [], rgba = [];
  const { data: poses, shape: [count] } = arrays.grasps;
  for (let i = 0; i < count; i++) {
    if (arrays.grasp_ids.data[i] !== id) continue;
    const T = poses.subarray(16 * i, 16 * i + 16);
    const half = arrays.grasp_widths.data[i] / 2 + PAD_M / 2;
    const at = (x, z) => [0, 1, 2].map((r) => T[4 * r] * x + T[4 * r + 2] * z + T[4 * r + 3]);
    const fork = [
      [-half, 0], [-half, -FINGER_M], [-half, -FINGER_M], [half, -FINGER_M], [half, -FINGER_M], [half, 0],
      [0, -FINGER_M], [0, -2.2 * FINGER_M],
    ];
    const color = arrays.grasp_status.data[i] === VALID ? validColor : otherColor;
    for (const [x, z] of fork) {
      positions.push(...at(x, z));
      rgba.push(...color, 255);
    }
  }
  return { positions: new Float32Array(positions), rgba: new Uint8Array(rgba), count: positions.length / 3 };
}
