// What is drawn over the picture: outlines or tints, numbers, and the selected object brought out.
// Lengths are those of the screen, at any zoom.

const OUTLINE = 1.6, RING = 2.6, CASING = 4.2, TAG = 22;
const TINT = 0.4, GLOW = 0.25, PALE = 0.45;

// By id, the rim of its pixels as a closed path through the middles of the pixels' edges, in pixels of the picture.
export function rims({ data, shape: [height, width] }) {
  const edges = new Map();
  const id = (x, y) => (x < 0 || y < 0 || x >= width || y >= height ? -1 : data[y * width + x]);
  const add = (own, from, to) => {
    if (!edges.has(own)) edges.set(own, new Map());
    const starts = edges.get(own);
    const key = from[1] * (width + 1) + from[0];
    starts.set(key, [...(starts.get(key) || []), [from, to]]);
  };
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) {
      const own = id(x, y);
      if (own < 0) continue;
      if (id(x, y - 1) !== own) add(own, [x, y], [x + 1, y]);
      if (id(x + 1, y) !== own) add(own, [x + 1, y], [x + 1, y + 1]);
      if (id(x, y + 1) !== own) add(own, [x + 1, y + 1], [x, y + 1]);
      if (id(x - 1, y) !== own) add(own, [x, y + 1], [x, y]);
    }
  }
  return new Map([...edges].map(([own, starts]) => [own, follow(starts, width)]));
}

function follow(starts, width) {
  const path = new Path2D();
  for (const [first, list] of starts) {
    while (list.length) {
      for (let key = first, begun = false; starts.get(key)?.length; begun = true) {
        const [from, to] = starts.get(key).pop();
        path[begun ? "lineTo" : "moveTo"]((from[0] + to[0]) / 2, (from[1] + to[1]) / 2);
        key = to[1] * (width + 1) + to[0];
      }
      path.closePath();
    }
  }
  return path;
}

// The place of a tag on the screen: it grows with the zoom up to a size. view: {scale, x, y}
export function tagBox([left, top, width, height], { scale, x, y }) {
  const grow = Math.min(scale, TAG / height);
  const [w, h] = [width * grow, height * grow];
  return { left: x + (left + width / 2) * scale - w / 2, top: y + (top + height / 2) * scale - h / 2, width: w, height: h };
}

// what: {objects, rims, own: whether the picture comes without marks, tints, selected, hovered}
export function drawMarks(context, view, what) {
  const px = 1 / view.scale;
  const rim = (id) => what.rims.get(id);
  const shown = what.objects.filter((o) => rim(o.id));
  const ratio = window.devicePixelRatio;
  context.setTransform(ratio * view.scale, 0, 0, ratio * view.scale, ratio * view.x, ratio * view.y);
  if (what.own) {
    for (const o of shown) {
      context.globalAlpha = what.selected === null || o.id === what.selected ? 1 : PALE;
      if (what.tints) fill(context, rim(o.id), o.color, TINT);
      inside(context, rim(o.id), () => stroke(context, rim(o.id), o.color, 2 * OUTLINE * px));
    }
    context.globalAlpha = 1;
  }
  if (rim(what.hovered) && what.hovered !== what.selected) fill(context, rim(what.hovered), "#fff", GLOW);
  if (rim(what.selected)) ring(context, what.rims, what.selected, px);
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  if (what.own) drawTags(context, view, what.objects.filter((o) => o.tag), what.selected);
}

function stroke(context, path, color, width) {
  Object.assign(context, { strokeStyle: color, lineWidth: width, lineJoin: "round" });
  context.stroke(path);
}

function fill(context, path, color, alpha) {
  context.save();
  context.globalAlpha *= alpha;
  context.fillStyle = color;
  context.fill(path);
  context.restore();
}

function inside(context, path, draw, rule = "nonzero") {
  context.save();
  context.clip(path, rule);
  draw();
  context.restore();
}

// White, in black, around the object: over the background only, never over another object, and thin within its own.
function ring(context, all, id, px) {
  const free = new Path2D();
  free.rect(-1e4, -1e4, 3e4, 3e4);
  for (const path of all.values()) free.addPath(path);
  inside(context, free, () => {
    stroke(context, all.get(id), "#000", 2 * CASING * px);
    stroke(context, all.get(id), "#fff", 2 * RING * px);
  }, "evenodd");
  inside(context, all.get(id), () => stroke(context, all.get(id), "#fff", 2 * OUTLINE * px));
}

function drawTags(context, view, objects, selected) {
  for (const o of objects.filter(({ tag }) => tag.leader)) {
    const box = tagBox(o.tag.box, view);
    const line = new Path2D();
    line.moveTo(box.left + box.width / 2, box.top + box.height / 2);
    line.lineTo(view.x + (o.tag.anchor[0] + 0.5) * view.scale, view.y + (o.tag.anchor[1] + 0.5) * view.scale);
    stroke(context, line, "#000", 3.5);
    stroke(context, line, o.color, 1.5);
  }
  Object.assign(context, { textAlign: "center", textBaseline: "middle" });
  for (const o of objects) {
    const { left, top, width, height } = tagBox(o.tag.box, view);
    context.fillStyle = o.id === selected ? "#fff" : "#000";
    context.fillRect(left, top, width, height);
    context.strokeStyle = o.id === selected ? "#000" : o.color;
    context.lineWidth = 1.5;
    context.strokeRect(left + 0.75, top + 0.75, width - 1.5, height - 1.5);
    context.fillStyle = o.id === selected ? "#000" : "#fff";
    context.font = `700 ${0.72 * height}px system-ui, sans-serif`;
    context.fillText(String(o.id), left + width / 2, top + 0.54 * height, width - 3);
  }
}
