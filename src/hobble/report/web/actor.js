// One character that walks in Play or at the top of the page: its controller, its body, its footprints, and its motion of the last seconds.
import { createCharacter } from "./character.js";
import { createFigure } from "./figure.js";
import { drawInputs } from "./inputs.js";
import { createLab } from "./lab.js";
import { channelColour } from "./paint.js";
import { createRig } from "./rig.js";
import { bodyChannel, valueKey } from "./sliders.js";

const MOST_FRAMES = 1200; // the last 20 seconds of motion are kept, so that the user can save them

// view: where the character is drawn, see view.js. spec: its data, from `hobble.report.playable`. place: [x, z] in cm where it starts.
// tint: name of a colour in paint.js for its body, or null. ghost: whether the body is transparent.
export const createActor = (view, spec, { place = [0, 0], tint = null, ghost = false } = {}) => {
  const figure = createFigure(view, spec.body, bodyChannel(spec)?.regions || [], { ghost }), rig = createRig(spec), wasDown = [false, false];
  const lab = createLab(spec.legs), actor = { spec, figure, rig, lab, place, watch: null, falls: 0, milliseconds: 0, frames: [] };
  let footprints = [], groundHeight = () => 0;

  // Starts again. height(x, z): height of the ground in cm.
  actor.start = (height) => {
    groundHeight = height;
    actor.character = createCharacter(spec, place);
    actor.frames = [];
    lab.clear();
    actor.watch?.clear();
    footprints = [];
  };
  // The point on the ground under joint j.
  const groundUnder = (j) => { const [x, z] = [rig.places[3 * j], rig.places[3 * j + 2]]; return [x, groundHeight(x, z), z]; };

  // Runs one frame toward a target (see targets.js). values: Map from `valueKey(channel, column)` to the value of the column. A missing
  // column has the value 0.
  actor.frame = ({ velocity, facing, gait }, values) => {
    const character = actor.character, before = performance.now();
    spec.channels.forEach((channel) => channel.columns.forEach((column, l) => {
      character.channelTargets[channel.first + l] = (values.get(valueKey(channel, column)) || 0) / channel.scale;
    }));
    character.frame(velocity, facing, gait, groundHeight);
    rig.take(character.posePosition, character.poseRotation);
    // The time per frame is smoothed, because it varies much from frame to frame.
    actor.milliseconds += .05 * (performance.now() - before - actor.milliseconds);
    actor.frames.push(Float32Array.from([...rig.places.subarray(0, 3), ...rig.turns]));
    if (actor.frames.length > MOST_FRAMES) actor.frames.shift();
    footprints.forEach((print) => { print.age++; });
    footprints = footprints.filter((print) => print.age < 360); // footprints fade out in 360 frames, which are six seconds
    spec.legs.forEach(([, , heel, toe], f) => {
      const down = character.footLock[f] === 1;
      if (down && !wasDown[f]) footprints.push({ from: groundUnder(heel), to: groundUnder(toe), age: 0, side: f });
      wasDown[f] = down;
    });
    lab.add(rig.places, [0, 1].map((f) => character.contacts[2 * f] > .5 || character.contacts[2 * f + 1] > .5));
    actor.watch?.add(rig.places);
    // Predictions of a network with too little training may grow without end. Then the character starts again.
    if (!character.posePosition.every(Number.isFinite)) { actor.falls++; actor.start(groundHeight); }
  };
  const drawGround = (withPath) => {
    if (withPath === null) return;
    const character = actor.character, { paint, marks } = view;
    for (const { from, to, age } of footprints) marks.addPrint(from, to, paint.ink, (paint.dark ? .16 : .13) * (1 - age / 360));
    if (!withPath) return;
    for (let i = 5; i < character.px.length; i += 5) {
      const [a, b] = [i - 5, i].map((t) => [character.px[t], groundHeight(character.px[t], character.pz[t]) + .2, character.pz[t]]);
      marks.addStrip(a, b, 2.2, tint ? paint[tint] : paint.accent, i > character.px.length / 2 ? .85 : .35);
    }
  };
  // withPath: true draws the footprints, the past path and the predicted path on the ground; false only the footprints; null nothing.
  actor.draw = (withPath = true) => {
    const character = actor.character, { paint } = view, plainColour = tint ? paint[tint] : paint.body, channel = bodyChannel(spec);
    drawGround(withPath);
    if (view.inputs) drawInputs(view, character, spec);
    figure.copyPose(rig);
    figure.pose((columns) => {
      const share = channel ? Math.max(0, ...columns.map((l) => character.channelValues[channel.first + l])) * channel.scale / channel.highest : 0;
      return channelColour(paint, share, plainColour);
    });
  };
  // The part of the body at the point (x, y) of the canvas, in pixels; null if there is none. columns: its columns in the channel that
  // has parts of the body. deep: its distance from the camera, cm.
  actor.under = (x, y) => {
    const found = figure.under(x, y);
    return found && { deep: found.deep, columns: found.links.map((l) => bodyChannel(spec).columns[l]) };
  };
  return actor;
};
