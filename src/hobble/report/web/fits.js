// Shows terrain fits. A picture has the ground of one gait cycle, dots for the soles to which it was fitted, and the figure at three moments.
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
      const picture = grounds.pictures[index], unpackLengths = (text) => Array.from(new Int16Array(bytes(text)), (v) => v / 10);
      const triples = (values) => values.reduce((out, v, i) => (i % 3 ? out.at(-1).push(v) : out.push([v]), out), []);
      const soles = triples(unpackLengths(picture.soles)), down = new Uint8Array(bytes(picture.contacts));
      const places = unpackLengths(picture.pose), turns = Array.from(new Int16Array(bytes(picture.turn)), (v) => v / 32767), boneCount = grounds.joints;
      unpacked.set(index, {
        heights: unpackLengths(picture.ground), n: picture.n, x: picture.x, z: picture.z, standing: soles.filter((_, i) => down[i]),
        poses: [0, 1, 2].map((k) => [places.slice(3 * k * boneCount, 3 * (k + 1) * boneCount), turns.slice(4 * k * boneCount, 4 * (k + 1) * boneCount)]),
      });
    }
    return unpacked.get(index);
  };
  // Corners of a dot, in the plane of the ground.
  const DOT = [[-1, 0], [0, -1], [1, 0], [0, 1]];
  const view = createView(canvas, { yaw: .9, pitch: .5, distance: 560 }, () => {
    const fit = unpack(choice.selectedIndex), { paint } = view, middle = fit.poses[1][0];
    view.aim([middle[0], middle[1] - 35, middle[2]]);
    view.land.drawPiece(fit.n, fit.x, fit.z, fit.heights);
    for (const [x, y, z] of fit.standing) {
      view.marks.addQuad(DOT.map(([a, b]) => [x + 1.6 * a, y + .4, z + 1.6 * b]), paint.accent, .85);
    }
    const pale = mix(paint.body, paint.dark ? [40, 46, 52] : [244, 243, 239], .6);
    fit.poses.forEach(([places, turns], k) => {
      figures[k].places.set(places);
      figures[k].turns.set(turns);
      figures[k].pose(() => (k === 1 ? paint.body : pale));
    });
    view.land.darkenUnder(figures.flatMap((figure) => figure.balls(8)));
  });
  const figures = [0, 1, 2].map(() => createFigure(view, grounds.body));
  choice.addEventListener("change", view.requestDraw);
  view.orbit.listen(document.getElementById("ground-stage"));
};
