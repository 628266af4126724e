// Terrain fits: the ground under one cycle, the soles that it was fitted to, and the figure at three moments.
import { material } from "./base.js";
import { bytes, cross, dot, minus, mix, unit } from "./numbers.js";
import { bodyParts, createView, css } from "./view.js";

(() => {
  const grounds = material.grounds, canvas = document.getElementById("ground");
  if (!canvas || !grounds || !grounds.pictures.length) return;
  const choice = document.getElementById("ground-choice");
  const unpacked = new Map();
  const unpack = (index) => {
    if (!unpacked.has(index)) {
      const p = grounds.pictures[index], steps = (text) => Array.from(new Int16Array(bytes(text)), (v) => v / 10);
      const triples = (values) => values.reduce((out, v, i) => (i % 3 ? out.at(-1).push(v) : out.push([v]), out), []);
      const soles = triples(steps(p.soles)), down = new Uint8Array(bytes(p.contacts));
      const joints = triples(steps(p.pose)), J = grounds.joints;
      unpacked.set(index, {
        heights: steps(p.ground), n: p.n, x: p.x, z: p.z, standing: soles.filter((_, i) => down[i]),
        poses: [0, 1, 2].map((k) => joints.slice(k * J, (k + 1) * J)),
      });
    }
    return unpacked.get(index);
  };
  const LIGHT = unit([.4, .8, -.35]);

  const view = createView(canvas, { yaw: .9, pitch: .5, distance: 560 }, () => {
    const g = unpack(choice.selectedIndex), { n, heights, x, z } = g, { context, paint, project } = view;
    const at = (i, k) => [x[0] + (x[1] - x[0]) * i / (n - 1), heights[i * n + k], z[0] + (z[1] - z[0]) * k / (n - 1)];
    const middle = g.poses[1][0];
    view.aim([middle[0], middle[1] - 35, middle[2]]);
    const quads = [];
    for (let i = 0; i + 1 < n; i++) {
      for (let k = 0; k + 1 < n; k++) {
        const corners = [at(i, k), at(i + 1, k), at(i + 1, k + 1), at(i, k + 1)];
        const normal = unit(cross(minus(corners[3], corners[0]), minus(corners[1], corners[0])));
        const flat = corners.map(project);
        quads.push({ flat, depth: flat.reduce((sum, p) => sum + p[2], 0), light: Math.max(0, dot(normal, LIGHT)) });
      }
    }
    quads.sort((a, b) => b.depth - a.depth);
    for (const { flat, light } of quads) {
      if (flat.some((p) => p[2] < 20)) continue;
      const colour = mix(mix(paint.ground, paint.ink, paint.dark ? 0 : .45), paint.ground, Math.min(1, light * 1.15) ** 1.5);
      context.beginPath();
      flat.forEach((p, i) => (i ? context.lineTo(p[0], p[1]) : context.moveTo(p[0], p[1])));
      context.closePath();
      context.fillStyle = css(paint.dark ? mix([8, 10, 12], paint.ground, light) : colour);
      context.fill();
      context.strokeStyle = css(paint.line, .25);
      context.lineWidth = .5;
      context.stroke();
    }
    for (const point of g.standing) {
      const p = project(point);
      context.fillStyle = css(paint.accent, .8);
      context.beginPath();
      context.arc(p[0], p[1], Math.max(1.2, view.zoom * 1.3 / p[2]), 0, 2 * Math.PI);
      context.fill();
    }
    const depth = (pose) => project(pose[0])[2];
    const pale = mix(paint.body, paint.dark ? [40, 46, 52] : [244, 243, 239], .6);
    g.poses.map((pose, k) => [pose, k === 1 ? paint.body : pale]).sort((a, b) => depth(b[0]) - depth(a[0]))
      .forEach(([pose, colour]) => view.body(bodyParts(grounds.capsules, pose, () => -Infinity, () => colour)));
  });
  choice.addEventListener("change", view.ask);
  view.listen(document.getElementById("ground-stage"));
})();
