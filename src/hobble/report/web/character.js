// The controller of `hobble.runtime` in JavaScript, for one character. It has the same steps in the same order, so the
// same test data check both languages. Units are centimetres and frames of 1/60 s. Yaw 0 faces +Z, and yaw grows toward +X.
import { networks } from "networks"; // kind -> createNetwork; made by `bundle.networks_module` from the folders of hobble.models
import { createFeet } from "./feet.js";
import { bytes } from "./numbers.js";
import { createRows } from "./rows.js";
import { createState } from "./state.js";
import { createTargets } from "./targets.js";
import { createTrajectory } from "./trajectory.js";

// Characters with the same network share its predictor, because a predictor remembers nothing between two predictions.
const predictors = new WeakMap();
const predictor = (spec) => {
  if (!predictors.has(spec)) predictors.set(spec, networks[spec.network.kind](spec));
  return predictors.get(spec);
};

// spec: the character's data, from `hobble.report.playable`. place: [x, z] in cm, and heading: yaw in radians, where it starts. Returns its
// state `c` (see state.js) with the functions `frame` and `follow`.
export const createCharacter = (spec, place = [0, 0], heading = 0) => {
  const c = createState(spec, place, heading), targets = createTargets(spec, c), path = createTrajectory(spec, c);
  const rows = createRows(spec, c), feet = createFeet(spec, c), predict = predictor(spec), { min, max } = Math;
  const x = new Float32Array(spec.x.size);
  // Inputs and outputs are clipped to the range that they had in training.
  const [xLow, xHigh, yLow, yHigh] = ["xLow", "xHigh", "yLow", "yHigh"].map((name) => new Float32Array(bytes(spec.bounds[name])));
  const clipRow = (row, low, high) => { for (let i = 0; i < row.length; i++) row[i] = min(max(row[i], low[i]), high[i]); };
  // The largest change of each channel column in a frame.
  const rates = spec.channels.flatMap((one) => one.columns.map(() => one.rate));
  const changeChannels = () => rates.forEach((rate, l) => {
    c.channelValues[l] += min(max(c.channelTargets[l] - c.channelValues[l], -rate), rate);
  });

  // Copies the state of another character, or a state from the page's data, and moves it by `shift` [x, z], cm.
  c.follow = (other, shift = [0, 0]) => {
    for (const [name, value] of Object.entries(other)) {
      if (ArrayBuffer.isView(c[name])) c[name].set(value);
      else if (typeof value !== "function") c[name] = structuredClone(value);
    }
    for (let t = 0; t < c.px.length; t++) { c.px[t] += shift[0]; c.pz[t] += shift[1]; }
    for (const points of [c.jointPosition, c.posePosition]) for (let j = 0; j < points.length; j += 3) { points[j] += shift[0]; points[j + 2] += shift[1]; }
    for (const hold of c.footHold) { hold[0] += shift[0]; hold[1] += shift[1]; }
    for (const point of c.legShown.flat()) { point[0] += shift[0]; point[2] += shift[1]; }
    c.root = [c.root[0] + shift[0], c.root[1], c.root[2] + shift[1]];
  };
  // Runs one frame. velocity, facing, gait: the target, see targets.js. ground(x, z): height of the ground in cm.
  c.frame = (velocity, facing, gait, ground) => {
    const [strafe, direction] = targets.chooseFacing(velocity, facing), share = targets.gaitShares(velocity, direction, gait);
    velocity = targets.limitSpeed(velocity, share);
    path.steer(velocity, direction, strafe, share);
    path.sample(ground);
    changeChannels();
    rows.writeInputs(x);
    clipRow(x, xLow, xHigh);
    const y = predict(x, c.phase, c.memory);
    clipRow(y, yLow, yHigh);
    rows.takeOutputs(y);
    feet.carryBody(ground);
    for (let f = 0; f < 2; f++) feet.placeFoot(f, ground);
    path.advance(y, velocity);
  };
  return c;
};
