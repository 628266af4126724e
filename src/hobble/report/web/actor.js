// One character in Play: its controller, its body, its footprints, and its motion in the last seconds.
import { createCharacter } from "./character.js";
import { createFigure } from "./figure.js";
import { drawInputs } from "./inputs.js";
import { createLab } from "./lab.js";
import { channelColour } from "./paint.js";
import { createRig } from "./rig.js";
import { bodyChannel, keyed } from "./sliders.js";

const KEPT = 1200; // frames that can be saved as motion

export const createActor = (view, spec, { place = [0, 0], tint = null, ghost = false } = {}) => {
  const figure = createFigure(view, spec.body, bodyChannel(spec)?.regions || [], { ghost }), rig = createRig(spec), stood = [false, false];
  const lab = createLab(spec.legs), actor = { spec, figure, rig, lab, place, watch: null, falls: 0, milliseconds: 0, frames: [] };
  let trail = [], floor = () => 0;

  actor.start = (height) => {
    floor = height;
    actor.character = createCharacter(spec, place);
    actor.frames = [];
    lab.clear();
    actor.watch?.clear();
    trail = [];
  };
  const sole = (j) => { const [x, z] = [rig.places[3 * j], rig.places[3 * j + 2]]; return [x, floor(x, z), z]; };

  // Runs one frame. values: Map from `keyed(channel, column)` to its value. A missing column has the value 0.
  actor.frame = ({ velocity, facing, gait }, values) => {
    const c = actor.character, before = performance.now();
    spec.channels.forEach((one) => one.columns.forEach((column, l) => { c.channelTargets[one.first + l] = (values.get(keyed(one, column)) || 0) / one.scale; }));
    c.frame(velocity, facing, gait, floor);
    rig.take(c.posePosition, c.poseRotation);
    actor.milliseconds += .05 * (performance.now() - before - actor.milliseconds);
    actor.frames.push(Float32Array.from([...rig.places.subarray(0, 3), ...rig.turns]));
    if (actor.frames.length > KEPT) actor.frames.shift();
    trail.forEach((print) => { print.age++; });
    trail = trail.filter((print) => print.age < 360);
    spec.legs.forEach(([, , heel, toe], f) => {
      const down = c.footLock[f] === 1;
      if (down && !stood[f]) trail.push({ from: sole(heel), to: sole(toe), age: 0, side: f });
      stood[f] = down;
    });
    lab.add(rig.places, [0, 1].map((f) => c.contacts[2 * f] > .5 || c.contacts[2 * f + 1] > .5));
    actor.watch?.add(rig.places);
    if (!c.posePosition.every(Number.isFinite)) { actor.falls++; actor.start(floor); } // after too little training, predictions may grow without end
  };
  const drawGround = (withPath) => {
    if (withPath === null) return;
    const c = actor.character, { paint, marks } = view;
    for (const { from, to, age } of trail) marks.print(from, to, paint.ink, (paint.dark ? .16 : .13) * (1 - age / 360));
    if (!withPath) return;
    for (let i = 5; i < c.px.length; i += 5) {
      const [a, b] = [i - 5, i].map((t) => [c.px[t], floor(c.px[t], c.pz[t]) + .2, c.pz[t]]);
      marks.strip(a, b, 2.2, tint ? paint[tint] : paint.accent, i > c.px.length / 2 ? .85 : .35);
    }
  };
  // withPath: whether the past and the predicted path are drawn on the ground. If it is null, footprints are not drawn either.
  actor.draw = (withPath = true) => {
    const c = actor.character, { paint } = view, plain = tint ? paint[tint] : paint.body, one = bodyChannel(spec);
    drawGround(withPath);
    if (view.inputs) drawInputs(view, c, spec);
    figure.take(rig);
    figure.pose((columns) => {
      const most = one ? Math.max(0, ...columns.map((l) => c.channelValues[one.first + l])) * one.scale / one.highest : 0;
      return channelColour(paint, most, plain);
    });
  };
  // The part of the body at a point of the screen, or null. columns: the columns of this part in the channel that has parts of the
  // body. deep: distance from the camera.
  actor.under = (x, y) => {
    const found = figure.under(x, y);
    return found && { deep: found.deep, columns: found.links.map((l) => bodyChannel(spec).columns[l]) };
  };
  return actor;
};
