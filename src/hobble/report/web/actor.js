// One character that is played: the controller, its figure, what it leaves on the ground, and its last seconds.
import { createCharacter } from "./character.js";
import { createFigure } from "./figure.js";
import { severityColour } from "./paint.js";

const KEPT = 1200; // frames that can be saved as motion

export const createActor = (view, spec, { place = [0, 0], tint = null } = {}) => {
  const figure = createFigure(view, spec.body), { keep } = spec.body, stood = [false, false];
  const actor = { spec, figure, falls: 0, milliseconds: 0, frames: [] };
  let trail = [], floor = () => 0;

  actor.start = (height) => {
    floor = height;
    actor.character = createCharacter(spec, place);
    actor.frames = [];
    trail = [];
  };
  const point = (j) => {
    const at = actor.character.pose;
    return [at[3 * j], at[3 * j + 1], at[3 * j + 2]];
  };
  const sole = (j) => { const [x, , z] = point(j); return [x, floor(x, z), z]; };

  actor.frame = ({ velocity, ahead, gait }, severity) => {
    const c = actor.character, before = performance.now();
    spec.links.forEach((link, l) => { c.wished[l] = severity.get(link) / spec.severityScale; });
    c.frame(velocity, ahead, gait, floor);
    actor.milliseconds += .05 * (performance.now() - before - actor.milliseconds);
    actor.frames.push(Float32Array.from(c.pose));
    if (actor.frames.length > KEPT) actor.frames.shift();
    trail.forEach((print) => { print.age++; });
    trail = trail.filter((print) => print.age < 360);
    spec.legs.forEach(([, , heel, toe], f) => {
      const down = c.lock[f] === 1;
      if (down && !stood[f]) trail.push({ from: sole(heel), to: sole(toe), age: 0 });
      stood[f] = down;
    });
    if (!c.pose.every(Number.isFinite)) { actor.falls++; actor.start(floor); } // a network that has learnt nothing runs away
  };
  actor.draw = () => {
    const c = actor.character, { paint, marks } = view, healthy = tint ? paint[tint] : paint.body;
    for (const { from, to, age } of trail) marks.print(from, to, paint.ink, (paint.dark ? .2 : .3) * (1 - age / 360));
    for (let i = 5; i < c.px.length; i += 5) {
      const [a, b] = [i - 5, i].map((t) => [c.px[t], floor(c.px[t], c.pz[t]) + .2, c.pz[t]]);
      marks.strip(a, b, 2.2, tint ? healthy : paint.accent, i > c.px.length / 2 ? .85 : .35);
    }
    figure.pose((j) => point(keep[j]), (links) => {
      const most = Math.max(0, ...links.map((l) => c.severity[l])) * spec.severityScale;
      return severityColour(paint, most, healthy);
    });
  };
  // The links, by name, of the part under a point of the screen.
  actor.under = (x, y) => figure.under(x, y)?.map((l) => spec.links[l]) ?? null;
  return actor;
};
