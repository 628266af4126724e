// Characters that the runtime in C moves, by WebAssembly. Units are centimetres and frames of 1/60 s. Yaw 0 faces +Z, and yaw grows toward +X.
import wasm from "engine"; // its bytes, see bundle.py
import { Engine } from "../../engine/examples/hobble.mjs";
import { bytes } from "./math.js";

let program; // the runtime, compiled
const engines = new WeakMap(); // spec -> the engine with its network

export const engineOf = (spec) => {
  program ??= new WebAssembly.Module(wasm);
  if (!engines.has(spec)) engines.set(spec, new Engine(program, new Uint8Array(bytes(spec.file))));
  return engines.get(spec);
};

// spec: the character's data, from `hobble.report.character`. place: [x, z] in cm, and heading: yaw in radians, where it starts.
export const createCharacter = (spec, place = [0, 0], heading = 0) => {
  const crowd = engineOf(spec).characters(), { joints, columns } = crowd, frames = crowd.c.hobble_path_frames(crowd.h);
  crowd.reset(0, ...place, heading);
  crowd.vary(0, 0);
  return {
    // Runs one frame. velocity: [x, z], cm. facing: [x, z], or null to look where it goes. gait: its name, or null to choose by speed.
    // ground(x, z): height of the ground in cm.
    frame(velocity, facing, gait, ground) { crowd.aim(0, velocity, facing, gait); crowd.frame(ground); },
    // Sets the value of a channel column: its number among the columns of all channels.
    set: (column, value) => crowd.set(0, column, value),
    // How much its steps differ from each other: 0 not at all, 1 as those of people do.
    vary: (amount, seed = 0) => crowd.vary(0, amount, seed),
    // Starts again.
    reset: () => crowd.reset(0, ...place, heading),
    release: () => crowd.release(),
    // What follows are views, which are valid until another character is made. skeleton: [positions, rotations] with bones of constant length.
    get skeleton() { return crowd.skeleton(); },
    get positions() { return crowd.positions(); },
    get rotations() { return crowd.rotations(); },
    get root() { return crowd.root(); },
    get phase() { return crowd.view("state", 6)[1]; },
    // Left heel, left toe, right heel, right toe: 0 to 1.
    get contacts() { return crowd.view("state", 6).subarray(2); },
    // For the left and the right foot 1 if it is held where it landed, 0 if it is free.
    get held() { return crowd.view("feet", 2); },
    get values() { return crowd.view("values", columns); },
    // The path has an entry for each frame, half of them past and half to come: [x, z], and the shares of the gaits.
    get path() { return crowd.view("path", 2 * frames); },
    get gaits() { return crowd.view("path_gaits", 6 * frames); },
  };
};

// The mean speed of a character over the last frames, cm a frame.
export const paceOf = ({ path }, frames) => {
  const now = path.length / 2, then = now - 2 * frames;
  return Math.hypot(path[now] - path[then], path[now + 1] - path[then + 1]) / frames;
};

// Recognises the limp of the played character. add(places): adds a frame with the positions of all joints. say(): the answer {text, share} for
// the last SECONDS, with its probability `share`. If there is no answer, {text} with the reason.
export const SECONDS = 3; // of motion are used, because in two seconds half of all limps have no whole cycle of both legs
export const createWatch = (spec) => {
  const { words, learnt, healthy, joints } = spec.recogniser, engine = engineOf(spec), { c } = engine, most = 60 * SECONDS, width = spec.names.length;
  const stored = (values) => { const at = engine.take(8 * values.length); engine.doubles(at, values.length).set(values); return at; };
  const given = stored(new Float64Array(bytes(learnt))), usual = stored(healthy), profile = stored(healthy);
  const answer = engine.take(8 * (4 + words.length)), places = engine.take(24 * width * most), columns = engine.take(4 * joints.length);
  engine.integers(columns, joints.length).set(joints);
  let frames = [];
  return {
    add(positions) { frames.push(Float64Array.from(positions)); if (frames.length > most) frames.shift(); },
    clear() { frames = []; },
    say() {
      if (frames.length < most) return { text: "collecting motion" };
      frames.forEach((frame, f) => engine.doubles(places + 24 * width * f, 3 * width).set(frame));
      if (!c.hobble_gait_profile(places, most, width, columns, profile)) return { text: "no answer: walk straight ahead" };
      c.hobble_gait_recognise(given, profile, usual, answer);
      const [kind, , , normal, ...kinds] = engine.doubles(answer, 4 + words.length);
      return kind < 0 ? { text: "nothing hurts", share: normal } : { text: words[kind], share: kinds[kind] };
    },
  };
};
