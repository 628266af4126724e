// Finds the gait cycles of a walk and measures them, as `hobble.gait.cycles` and `hobble.gait.profile` do in Python. A cycle goes from one
// landing of a foot to its next. A foot lands when its ankle is furthest ahead of the hips. Lengths are in leg lengths.
import { LIMBS, MIDDLE, SIDES, SIGN_CHANGES, median, mirroredSignals, signals } from "./signals.js";

const SAMPLES = 50; // samples of each curve in a cycle
// Measures of a cycle. stride_seconds: its length. speed_per_leg: leg lengths a second. left_strike_phase: share of the cycle that has passed
// as the left foot lands. stance_share: share of the cycle in which the ankle stands. step: how far the landing ankle is ahead of the other
// one. step_width: distance of the ankles from side to side at the landings.
const SCALARS = ["stride_seconds", "speed_per_leg", "left_strike_phase", "stance_share_R", "stance_share_L", "step_R", "step_L", "step_width"];
const CURVES = [...SIDES.flatMap((side) => LIMBS.map((limb) => `${limb}_${side}`)), ...MIDDLE];
const STANDING_SPEED = .35; // share of the walking speed; an ankle that is slower than this stands
const [SHORTEST_CYCLE, LONGEST_CYCLE] = [.4, 3.5]; // length of a cycle, s
const LEAST_TRAVEL = .2; // leg lengths: if the hips travel less in a cycle, the figure stands
const LEAST_SWING = .12; // leg lengths: if an ankle moves back and forth by less, this is no step
const LEAST_SWING_SHARE = .4; // the same as a share of the range of the ankle within LONGEST_CYCLE seconds
const MOST_TURN = 25; // degrees: if the path turns more in a cycle, the walk is not straight
const LEAST_AHEAD = .7; // mean cosine between facing and travel: if it is less, the figure walks backward or sideways

const mean = (values) => values.reduce((a, b) => a + b, 0) / values.length;
const range = (values) => Math.max(...values) - Math.min(...values);
// The share of the time in which values are below a limit, interpolated between frames.
const shareBelow = (values, limit) => mean(values.slice(1).map((value, i) => {
  const under = Math.max(limit - values[i], 0) + Math.max(limit - value, 0);
  return under > 0 ? under / (Math.abs(limit - values[i]) + Math.abs(limit - value)) : 0;
}));

// Largest minus smallest value within `reach` frames of frame i.
const rangeAround = (values, i, reach) => {
  let low = Infinity, high = -Infinity;
  for (let k = Math.max(0, i - reach), end = Math.min(values.length, i + reach + 1); k < end; k++) {
    if (values[k] < low) low = values[k];
    if (values[k] > high) high = values[k];
  }
  return high - low;
};

// The frames in which an ankle is furthest ahead. forward: how far it is ahead of the hips in each frame. After a landing it must go back, and
// before the next landing forward again, each time by at least both LEAST_SWING and LEAST_SWING_SHARE of its range.
export const landings = (forward, fps) => {
  const reach = Math.floor(LONGEST_CYCLE * fps / 2), found = [];
  const leastSwing = (at) => Math.max(LEAST_SWING, LEAST_SWING_SHARE * rangeAround(forward, at, reach));
  let high = 0, low = 0, rising = true;
  forward.forEach((value, i) => {
    if (rising) {
      if (value > forward[high]) high = i;
      if (forward[high] - value >= leastSwing(high)) { found.push(high); rising = false; low = i; }
    } else {
      if (value < forward[low]) low = i;
      if (value - forward[low] >= leastSwing(low)) { rising = true; high = i; }
    }
  });
  return found.filter((i) => i > 0);
};

// The measures of the cycle of the right leg from frame a to frame b. other: the frame in which the left foot lands. scalars: in the order of
// SCALARS. curves: those of CURVES, at SAMPLES equal steps.
const measureCycle = (walk, a, other, b) => {
  const { fps, curves, hips } = walk, seconds = (b - a) / fps;
  const speed = Math.hypot(hips[b][0] - hips[a][0], hips[b][1] - hips[a][1]) / seconds;
  const stepLength = (f) => curves.ankle_forward_R[f] - curves.ankle_forward_L[f];
  const standing = (side) => shareBelow(walk.ankleSpeed[side].slice(a, b + 1), STANDING_SPEED * speed);
  const width = mean([a, other].map((f) => walk.across.L[f] - walk.across.R[f]));
  const scalars = [seconds, speed, (other - a) / (b - a), standing("R"), standing("L"), stepLength(a), -stepLength(other), width];
  const sampled = (values) => Array.from({ length: SAMPLES }, (_, k) => {
    const t = a + (b - a) * k / SAMPLES, f = Math.min(Math.floor(t), b - 1);
    return values[f] + (t - f) * (values[f + 1] - values[f]);
  });
  return { start: a, end: b, scalars, curves: CURVES.map((name) => sampled(curves[name])) };
};

// The cycles of the right leg in which the figure walks straight ahead.
const rightCycles = (walk) => {
  const [right, left] = ["R", "L"].map((side) => landings(walk.curves[`ankle_forward_${side}`], walk.fps)), out = [];
  for (let i = 1; i < right.length; i++) {
    const [a, b] = [right[i - 1], right[i]], between = left.filter((f) => a < f && f < b);
    if (between.length !== 1 || b - a < SHORTEST_CYCLE * walk.fps || b - a > LONGEST_CYCLE * walk.fps) continue;
    let travel = 0;
    for (let f = a; f < b; f++) travel += Math.hypot(walk.hips[f + 1][0] - walk.hips[f][0], walk.hips[f + 1][1] - walk.hips[f][1]);
    const straight = Math.abs(walk.heading[b] - walk.heading[a]) <= MOST_TURN;
    if (travel >= LEAST_TRAVEL && straight && mean(walk.ahead.slice(a, b)) >= LEAST_AHEAD) out.push(measureCycle(walk, a, between[0], b));
  }
  return out;
};

// The cycles in which a figure walks straight ahead. right: those of the right leg. left: those of the left leg, measured in the mirrored walk.
// frames: the positions of all joints (3 J) of each frame, cm.
export const measureWalk = (spec, frames, fps = 60) => {
  if (frames.length < SHORTEST_CYCLE * fps) return { right: [], left: [] };
  const walk = signals(spec, frames, fps);
  return { right: rightCycles(walk), left: rightCycles(mirroredSignals(walk)) };
};

// The medians of SCALARS over cycles, and the range and mean of the median curves.
const mediansOf = (cyclesOfLeg) => {
  const out = {};
  SCALARS.forEach((name, s) => { out[name] = median(cyclesOfLeg.map(({ scalars }) => scalars[s])); });
  CURVES.forEach((name, c) => {
    const curve = Array.from({ length: SAMPLES }, (_, k) => median(cyclesOfLeg.map(({ curves }) => curves[c][k])));
    out[`range ${name}`] = range(curve);
    out[`mean ${name}`] = mean(curve);
  });
  return out;
};

// The profile (see `profile`) of the mirrored walk.
const mirroredProfile = (values) => Object.fromEntries(Object.keys(values).map((name) => {
  if (name === "left_strike_phase") return [name, 1 - values[name]];
  if (SIGN_CHANGES.some((curve) => name === `mean ${curve}`)) return [name, -values[name]];
  const otherSide = name.endsWith("_R") ? `${name.slice(0, -1)}L` : name.endsWith("_L") ? `${name.slice(0, -1)}R` : name;
  return [name, values[otherSide]];
}));

// The profile of a walk: its measures by name. They are medians over the cycles of a leg, then the mean of the two legs. null if a leg has no
// cycle.
export const profile = ({ right, left }) => {
  if (!right.length || !left.length) return null;
  const [a, b] = [mediansOf(right), mirroredProfile(mediansOf(left))];
  return Object.fromEntries(Object.keys(a).map((name) => [name, (a[name] + b[name]) / 2]));
};
