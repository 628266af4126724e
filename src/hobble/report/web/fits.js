// Terrain fits: the ground of one cycle, the soles that it was fitted to, and the figure at three moments.
import { material } from "./base.js";
import { createFigure } from "./figure.js";
import { bytes, mix } from "./numbers.js";
import { createView } from "./view.js";

export const startFits = () => {
  const grounds = material.grounds, canvas = document.getElementById("ground");
  if (!canvas || !grounds || !grounds.pictures.length) return;
  const choice = document.getElementById("ground-choice");
  const unpacked = new Map();
  const unpack = (index) => {
    if (!unpacked.has(index)) {
      const p = grounds.pictures[index], steps = (text) => Array.from(new Int16Array(bytes(text)), (v) => v / 10);
      const triples = (values) => values.reduce((out, v, i) => (i % 3 ? out.at(-1).push(v) : out.push([v]), out), []);
      const soles = triples(steps(p.soles)), down = new Uint8Array(bytes(p.contacts));
      const places = steps(p.pose), turns = Array.from(new Int16Array(bytes(p.turn)), (v) => v / 32767), J = grounds.joints;
      unpacked.set(index, {
        heights: steps(p.ground), n: p.n, x: p.x, z: p.z, standing: soles.filter((_, i) => down[i]),
        poses: [0, 1, 2].map((k) => [places.slice(3 * k * J, 3 * (k + 1) * J), turns.slice(4 * k * J, 4 * (k + 1) * J)]),
      });
    }
    return unpacked.get(index);
  };
  const DOT = [[-1, 0], [0, -1], [1, 0], [0, 1]];
  const view = createView(canvas, { yaw: .9, pitch: .5, distance: 560 }, () => {
    const g = unpack(choice.selectedIndex), { paint } = view, middle = g.poses[1][0];
    view.aim([middle[0], middle[1] - 35, middle[2]]);
    view.land.piece(g.n, g.x, g.z, g.heights);
    for (const [x, y, z] of g.standing) {
      view.marks.piece(DOT.map(([a, b]) => [x + 1.6 * a, y + .4, z + 1.6 * b]), paint.accent, .85);
    }
    const pale = mix(paint.body, paint.dark ? [40, 46, 52] : [244, 243, 239], .6);
    g.poses.forEach(([places, turns], k) => {
      figures[k].places.set(places);
      figures[k].turns.set(turns);
      figures[k].pose(() => (k === 1 ? paint.body : pale));
    });
    view.land.under(figures.flatMap((figure) => figure.balls(8)));
  });
  const figures = [0, 1, 2].map(() => createFigure(view, grounds.body));
  choice.addEventListener("change", view.ask);
  view.orbit.listen(document.getElementById("ground-stage"));
};
