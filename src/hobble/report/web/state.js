// The state of one character. It starts in the pose of a frame of the clips. Fields and units are those of `hobble.runtime.character` and
// `hobble.runtime.controller`, with names in camel case. The path has an entry for each frame: px, pz (position) and dx, dz (direction).
import { bytes } from "./numbers.js";
import { at3, at4, multiply } from "./turns.js";

// Returns a function (c) that sets the rotations to draw to those that the network predicted. The network predicts no rotations of joints
// that move no part of the body, so such a joint gets the rotation of its parent.
export const createDrawnTurns = (spec) => {
  const still = spec.parents.flatMap((p, j) => (p < 0 || spec.turning.includes(j) ? [] : [[j, p]]));
  return (c) => {
    c.poseRotation.set(c.jointRotation);
    for (const [j, p] of still) for (let i = 0; i < 4; i++) c.poseRotation[4 * j + i] = c.poseRotation[4 * p + i];
  };
};

// place: [x, z] in cm, and heading: yaw in radians, where the character starts. T: entries of the path. S: samples of it that the network gets.
export const createState = (spec, place, heading) => {
  const { joints: J, step, gaits } = spec, T = 2 * spec.window, S = T / step, { sin, cos } = Math;
  const filled = (n, value = 0) => new Float64Array(n).fill(value), L = spec.channels.flatMap(({ columns }) => columns).length;
  const c = {
    px: filled(T, place[0]), pz: filled(T, place[1]), dx: filled(T, sin(heading)), dz: filled(T, cos(heading)),
    gait: filled(T * gaits.length), ground: filled(S * 3), rootHeight: 0, phase: 0, root: [place[0], 0, place[1]], placed: false,
    jointPosition: filled(3 * J), jointVelocity: filled(3 * J), jointRotation: filled(4 * J),
    posePosition: filled(3 * J), poseRotation: filled(4 * J),
    channelValues: filled(L), channelTargets: filled(L), memory: filled(spec.network.memory ?? 0),
    smoothedVelocity: [0, 0], smoothedDirection: [sin(heading), cos(heading)], strafe: 0, correction: [0, 0],
    footLock: [0, 0], footHold: [[0, 0], [0, 0]], footStep: [0, 0], footMissed: [0, 0], footLift: [0, 0], bodyLift: 0,
    footAdded: [0, 1].map(() => [[1, 0, 0, 0], [1, 0, 0, 0]]), legShown: [], contacts: [0, 0, 0, 0],
  };
  startInClip(spec, c, place, heading);
  return c;
};

// Sets path, gait, phase and pose of `c` to those of spec.start, turned by `heading` and moved to `place`.
const startInClip = (spec, c, place, heading) => {
  const T = 2 * spec.window, J = spec.joints, { sin, cos } = Math;
  const startArray = (name) => new Float32Array(bytes(spec.start[name])), [si, co] = [sin(heading), cos(heading)];
  const [path, ahead, joints, velocities] = ["position", "direction", "joint_position", "joint_velocity"].map(startArray);
  for (let t = 0; t < T; t++) {
    c.px[t] = path[2 * t] * co + path[2 * t + 1] * si + place[0];
    c.pz[t] = path[2 * t + 1] * co - path[2 * t] * si + place[1];
    c.dx[t] = ahead[2 * t] * co + ahead[2 * t + 1] * si;
    c.dz[t] = ahead[2 * t + 1] * co - ahead[2 * t] * si;
  }
  for (let j = 0; j < 3 * J; j += 3) for (const [from, to, a, b] of [[joints, c.jointPosition, ...place], [velocities, c.jointVelocity, 0, 0]]) {
    to[j] = from[j] * co + from[j + 2] * si + a;
    to[j + 1] = from[j + 1];
    to[j + 2] = from[j + 2] * co - from[j] * si + b;
  }
  c.gait.set(startArray("gait"));
  c.phase = spec.start.phase;
  c.posePosition.set(c.jointPosition);
  c.legShown = spec.legs.map(([, ...below]) => below.map((j) => at3(c.jointPosition, j)));
  const rotations = startArray("joint_rotation"), facing = [cos(heading / 2), 0, sin(heading / 2), 0];
  for (let j = 0; j < J; j++) c.jointRotation.set(multiply(facing, at4(rotations, j)), 4 * j);
  createDrawnTurns(spec)(c);
};
