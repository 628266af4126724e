// Marks: strips, dots, footprints and needles on the ground or in the air. For every picture, they are cleared and added again.
import { BufferAttribute, BufferGeometry, Color, DoubleSide, DynamicDrawUsage, Mesh, MeshBasicMaterial } from "three";
import { cross, minus, unit } from "./numbers.js";
import { linear } from "./paint.js";

// most: the largest number of quads (faces with four corners). over: whether they are drawn in front of the body.
export const createMarks = (scene, { most = 4000, over = false } = {}) => {
  const geometry = new BufferGeometry(), colour = new Color(), index = [];
  const place = new BufferAttribute(new Float32Array(12 * most), 3), shade = new BufferAttribute(new Float32Array(16 * most), 4);
  for (const attribute of [place, shade]) attribute.setUsage(DynamicDrawUsage);
  for (let q = 0; q < most; q++) index.push(4 * q, 4 * q + 1, 4 * q + 2, 4 * q, 4 * q + 2, 4 * q + 3);
  geometry.setAttribute("position", place);
  geometry.setAttribute("color", shade);
  geometry.setIndex(index);
  const material = new MeshBasicMaterial({
    vertexColors: true, transparent: true, depthWrite: false, depthTest: !over, side: DoubleSide, polygonOffset: true, polygonOffsetFactor: -2, polygonOffsetUnits: -4,
  });
  const mesh = new Mesh(geometry, material);
  mesh.frustumCulled = false;
  if (over) mesh.renderOrder = 3;
  scene.add(mesh);
  let used = 0;

  const marks = {
    clear() { used = 0; },
    // Adds a quad. points: its corners. rgb: its colour, 0 to 255. alpha: its opacity.
    addQuad(points, rgb, alpha) {
      if (used === most || alpha < .02) return;
      linear(rgb, colour);
      points.forEach((p, i) => {
        place.array.set(p, 12 * used + 3 * i);
        shade.array.set([colour.r, colour.g, colour.b, alpha], 16 * used + 4 * i);
      });
      used++;
    },
    // A strip on the ground from a to b, `width` cm wide, a little above it.
    addStrip(a, b, width, rgb, alpha) {
      const [x, z] = [b[0] - a[0], b[2] - a[2]], n = Math.hypot(x, z) || 1, [sx, sz] = [width / 2 * z / n, -width / 2 * x / n], up = .35;
      marks.addQuad([
        [a[0] - sx, a[1] + up, a[2] - sz], [a[0] + sx, a[1] + up, a[2] + sz],
        [b[0] + sx, b[1] + up, b[2] + sz], [b[0] - sx, b[1] + up, b[2] - sz],
      ], rgb, alpha);
    },
    // A needle in the air from a to b: two crossed blades, `width` cm wide at a and pointed at b.
    addNeedle(a, b, width, rgb, alpha) {
      const way = unit(minus(b, a)), side = unit(Math.abs(way[1]) < .9 ? cross(way, [0, 1, 0]) : [1, 0, 0]);
      for (const out of [side, cross(way, side)]) {
        const [left, right] = [1, -1].map((s) => a.map((v, i) => v + s * width / 2 * out[i]));
        marks.addQuad([left, right, b, b], rgb, alpha);
      }
    },
    // A footprint. heel, toe: the points on the ground where they stood. outline: cm ahead of the heel, and half the width there in cm.
    addPrint(heel, toe, rgb, alpha) {
      const way = minus(toe, heel), size = Math.hypot(...way) || 1, at = (cm) => heel.map((v, i) => v + way[i] * cm / size);
      const [sx, sz] = [way[2] / size, -way[0] / size];
      const across = ([cm, half]) => { const [x, y, z] = at(cm); return [[x - half * sx, y + .3, z - half * sz], [x + half * sx, y + .3, z + half * sz]]; };
      const outline = [[-5, 1.6], [-3.5, 3.1], [2, 3], [size, 4.6], [size + 5, 3.9], [size + 8, 1.6]].map(across);
      for (let i = 1; i < outline.length; i++) marks.addQuad([...outline[i - 1], outline[i][1], outline[i][0]], rgb, alpha);
    },
    // Passes the marks to the graphics card, before a picture is drawn.
    upload() {
      geometry.setDrawRange(0, 6 * used);
      place.needsUpdate = shade.needsUpdate = true;
      mesh.visible = used > 0;
    },
  };
  return marks;
};
