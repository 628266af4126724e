// The state of one character, at first in a frame of the clips. Fields and units as in `hobble.runtime.controller`.
import { bytes } from "./numbers.js";
import { at3, at4, multiply } from "./turns.js";

// Sets the rotations to draw from those of the network. Joints that move no bone keep the rotation of their parent.
export const createDrawnTurns = (spec) => {
  const still = spec.parents.flatMap((p, j) => (p < 0 || spec.turning.includes(j) ? [] : [[j, p]]));
  return (c) => {
    c.turns.set(c.rotations);
    for (const [j, p] of still) for (let i = 0; i < 4; i++) c.turns[4 * j + i] = c.turns[4 * p + i];
  };
};

// place: [x, z] in cm. heading: radians.
export const createState = (spec, place, heading) => {
  const { joints: J, step, gaits } = spec, T = 2 * spec.window, S = T / step, { sin, cos } = Math;
  const filled = (n, value = 0) => new Float64Array(n).fill(value), L = spec.channels.flatMap(({ columns }) => columns).length;
  const c = {
    px: filled(T, place[0]), pz: filled(T, place[1]), dx: filled(T, sin(heading)), dz: filled(T, cos(heading)),
    gait: filled(T * gaits.length), ground: filled(S * 3), height: 0, phase: 0, root: [place[0], 0, place[1]], placed: false,
    joints: filled(3 * J), velocities: filled(3 * J), rotations: filled(4 * J), pose: filled(3 * J), turns: filled(4 * J),
    channelValues: filled(L), channelTargets: filled(L), memory: filled(spec.network.memory ?? 0),
    velocity: [0, 0], direction: [sin(heading), cos(heading)], strafe: 0, correction: [0, 0],
    lock: [0, 0], hold: [[0, 0], [0, 0]], step: [0, 0], missed: [0, 0], lift: [0, 0], raised: 0,
    added: [0, 1].map(() => [[1, 0, 0, 0], [1, 0, 0, 0]]), shown: [], contacts: [0, 0, 0, 0],
  };
  startInClip(spec, c, place, heading);
  return c;
};

const startInClip = (spec, c, place, heading) => {
  const T = 2 * spec.window, J = spec.joints, { sin, cos } = Math;
  const at = (name) => new Float32Array(bytes(spec.start[name])), [si, co] = [sin(heading), cos(heading)];
  const [path, ahead, joints, velocities] = ["position", "direction", "joint_position", "joint_velocity"].map(at);
  for (let t = 0; t < T; t++) {
    c.px[t] = path[2 * t] * co + path[2 * t + 1] * si + place[0];
    c.pz[t] = path[2 * t + 1] * co - path[2 * t] * si + place[1];
    c.dx[t] = ahead[2 * t] * co + ahead[2 * t + 1] * si;
    c.dz[t] = ahead[2 * t + 1] * co - ahead[2 * t] * si;
  }
  for (let j = 0; j < 3 * J; j += 3) for (const [from, to, a, b] of [[joints, c.joints, ...place], [velocities, c.velocities, 0, 0]]) {
    to[j] = from[j] * co + from[j + 2] * si + a;
    to[j + 1] = from[j + 1];
    to[j + 2] = from[j + 2] * co - from[j] * si + b;
  }
  c.gait.set(at("gait"));
  c.phase = spec.start.phase;
  c.pose.set(c.joints);
  c.shown = spec.legs.map(([, ...below]) => below.map((j) => at3(c.joints, j)));
  const rotations = at("joint_rotation"), facing = [cos(heading / 2), 0, sin(heading / 2), 0];
  for (let j = 0; j < J; j++) c.rotations.set(multiply(facing, at4(rotations, j)), 4 * j);
  createDrawnTurns(spec)(c);
};
