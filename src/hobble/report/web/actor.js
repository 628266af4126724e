// Writes the played motion as a BVH file.
import { bodyChannel, channelColour, valueKey } from "./base.js";
import { createCharacter } from "./character.js";
import { createFigure } from "./figure.js";
import { at3, at4, conjugate, multiply } from "./math.js";

const FPS = 60;

// The angles [z, y, x] of a rotation, in degrees: it is first turned about X, then about Y, then about Z (Rz Ry Rx).
const angles = ([w, x, y, z]) => {
  const degrees = 180 / Math.PI, sine = Math.min(1, Math.max(-1, 2 * (w * y - x * z)));
  return [
    Math.atan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z)), Math.asin(sine),
    Math.atan2(2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
  ].map((a) => a * degrees);
};

// The text of a BVH file. names, parents, offsets: of the joints. frames: an array for each frame. It has the position of the root (3
// numbers, cm) and then the world rotations of all joints (4 numbers each).
export const bvhText = ({ names, parents, offsets }, frames) => {
  const children = names.map((_, j) => parents.flatMap((p, k) => (p === j ? [k] : []))), header = [], joints = [];
  const addJoint = (j, indent) => {
    const pad = "\t".repeat(indent), root = parents[j] < 0;
    joints.push(j);
    header.push(`${pad}${root ? "ROOT" : "JOINT"} ${names[j]}`, `${pad}{`, `${pad}\tOFFSET ${(root ? [0, 0, 0] : offsets[j]).map((v) => v.toFixed(6)).join(" ")}`);
    header.push(`${pad}\tCHANNELS ${root ? "6 Xposition Yposition Zposition" : "3"} Zrotation Yrotation Xrotation`);
    children[j].forEach((k) => addJoint(k, indent + 1));
    if (!children[j].length) header.push(`${pad}\tEnd Site`, `${pad}\t{`, `${pad}\t\tOFFSET 0 0 0`, `${pad}\t}`);
    header.push(`${pad}}`);
  };
  addJoint(parents.findIndex((p) => p < 0), 0);
  const lines = frames.map((frame) => {
    const rotations = frame.slice(3), numbers = Array.from(frame.slice(0, 3), (v) => v.toFixed(4));
    for (const j of joints) {
      const world = at4(rotations, j), local = parents[j] < 0 ? world : multiply(conjugate(at4(rotations, parents[j])), world);
      numbers.push(...angles(local).map((v) => v.toFixed(4)));
    }
    return numbers.join(" ");
  });
  return `HIERARCHY\n${header.join("\n")}\nMOTION\nFrames: ${frames.length}\nFrame Time: ${(1 / FPS).toFixed(7)}\n${lines.join("\n")}\n`;
};

// Counts the frames of 1/60 s that have to run before a picture. frames(now): how many, at most eight. rest(): no pictures are drawn for a while.
export const createTicker = () => {
  let last = null, due = 0;
  return {
    frames(now) {
      due = Math.min(8, due + (last === null ? 1 : (now - last) * .06));
      last = now;
      const whole = Math.floor(due);
      due -= whole;
      return whole;
    },
    rest() { last = null; },
  };
};

// One character that walks in Play or at the top of the page: its controller, its body, its footprints, and its motion of the last seconds.

const MOST_FRAMES = 1200; // the last 20 seconds of motion are kept, so that the user can save them

// view: where the character is drawn, see view.js. spec: its data, from `hobble.report.character`. place: [x, z] in cm where it starts.
// tint: name of a colour in the palette for its body, or null. ghost: whether the body is transparent.
export const createActor = (view, spec, { place = [0, 0], tint = null, ghost = false } = {}) => {
  const figure = createFigure(view, spec.body, bodyChannel(spec)?.regions || [], { ghost }), wasDown = [false, false];
  // rig: the pose that is drawn, with bones of constant length.
  const J = spec.names.length, character = createCharacter(spec, place), rig = { places: new Float64Array(3 * J), turns: new Float64Array(4 * J) };
  const actor = { spec, figure, character, rig, place, watch: null, milliseconds: 0, frames: [] };
  let footprints = [], groundHeight = () => 0;

  const takePose = () => {
    const [places, turns] = character.skeleton;
    rig.places.set(places);
    rig.turns.set(turns);
  };
  // Starts again. height(x, z): height of the ground in cm.
  actor.start = (height) => {
    groundHeight = height;
    character.reset();
    takePose();
    actor.frames = [];
    actor.watch?.clear();
    footprints = [];
  };
  actor.remove = () => { figure.remove(); character.release(); };
  // The point on the ground under joint j.
  const groundUnder = (j) => { const [x, z] = [rig.places[3 * j], rig.places[3 * j + 2]]; return [x, groundHeight(x, z), z]; };

  // Runs one frame toward a target. values: Map from `valueKey(channel, column)` to the value of the column. A missing
  // column has the start value of its channel.
  actor.frame = ({ velocity, facing, gait }, values) => {
    const before = performance.now();
    spec.channels.forEach((channel) => channel.columns.forEach((column, l) => (
      character.set(channel.first + l, values.get(valueKey(channel, column)) ?? channel.start))));
    character.frame(velocity, facing, gait, groundHeight);
    takePose();
    // The time per frame is smoothed, because it varies much from frame to frame.
    actor.milliseconds += .05 * (performance.now() - before - actor.milliseconds);
    actor.frames.push(Float32Array.from([...rig.places.subarray(0, 3), ...rig.turns]));
    if (actor.frames.length > MOST_FRAMES) actor.frames.shift();
    footprints.forEach((print) => { print.age++; });
    footprints = footprints.filter((print) => print.age < 360); // footprints fade out in 360 frames, which are six seconds
    const { held } = character;
    spec.legs.forEach(([, , heel, toe], f) => {
      const down = held[f] === 1;
      if (down && !wasDown[f]) footprints.push({ from: groundUnder(heel), to: groundUnder(toe), age: 0, side: f });
      wasDown[f] = down;
    });
    actor.watch?.add(rig.places);
  };
  const drawGround = (withPath) => {
    if (withPath === null) return;
    const { path } = character, { paint, marks } = view;
    for (const { from, to, age } of footprints) marks.addPrint(from, to, paint.ink, (paint.dark ? .16 : .13) * (1 - age / 360));
    if (!withPath) return;
    for (let i = 10; i < path.length; i += 10) {
      const [a, b] = [i - 10, i].map((t) => [path[t], groundHeight(path[t], path[t + 1]) + .2, path[t + 1]]);
      marks.addStrip(a, b, 2.2, tint ? paint[tint] : paint.accent, i > path.length / 2 ? .85 : .35);
    }
  };
  // withPath: true draws the footprints, the past path and the predicted path on the ground; false only the footprints; null nothing.
  // shift: [x, z] in cm from where the figure is to where it is drawn.
  actor.draw = (withPath = true, shift = [0, 0]) => {
    const { values } = character, { paint } = view, plainColour = tint ? paint[tint] : paint.body, channel = bodyChannel(spec);
    drawGround(withPath);
    figure.copyPose(rig, shift);
    figure.pose((columns) => {
      const share = channel ? Math.max(0, ...columns.map((l) => values[channel.first + l])) * channel.scale / channel.highest : 0;
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
