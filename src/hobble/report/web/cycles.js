// The gait cycles of a walk and their measures, as in `hobble.gait.cycles` and `hobble.gait.profile`. A foot lands when
// its ankle is furthest ahead of the hips.
import { LIMBS, MIDDLE, SIDES, SIGN_CHANGES, median, mirroredSignals, signals } from "./signals.js";

const SAMPLES = 50;
const SCALARS = ["stride_seconds", "speed_per_leg", "left_strike_phase", "stance_share_R", "stance_share_L", "step_R", "step_L", "step_width"];
const CURVES = [...SIDES.flatMap((side) => LIMBS.map((limb) => `${limb}_${side}`)), ...MIDDLE];
const STANDING_SPEED = .35; // share of the walking speed; a slower ankle counts as standing
const [SHORTEST, LONGEST] = [.4, 3.5]; // s, a cycle
const LEAST_TRAVEL = .2; // leg lengths in a cycle; with less the figure stands
const LEAST_SWING = .12; // leg lengths; an ankle that swings less makes no step
const LEAST_SWING_SHARE = .4; // share of the ankle's range within LONGEST seconds; smaller swings are no steps
const STRAIGHT = 25; // degrees; if the path turns more in a cycle, the walk is not straight
const AHEAD = .7; // least mean cosine between facing and travel; with less the figure walks backward or sideways

const mean = (values) => values.reduce((a, b) => a + b, 0) / values.length;
const range = (values) => Math.max(...values) - Math.min(...values);

// Largest minus smallest value within `reach` frames of frame i.
const rangeAround = (values, i, reach) => {
  let low = Infinity, high = -Infinity;
  for (let k = Math.max(0, i - reach), end = Math.min(values.length, i + reach + 1); k < end; k++) {
    if (values[k] < low) low = values[k];
    if (values[k] > high) high = values[k];
  }
  return high - low;
};

// The frames in which an ankle is furthest ahead. forward: its distance ahead of the hips in each frame, in leg lengths.
export const landings = (forward, fps) => {
  const reach = Math.floor(LONGEST * fps / 2), found = [];
  let high = 0, low = 0, rising = true;
  forward.forEach((value, i) => {
    const least = Math.max(LEAST_SWING, LEAST_SWING_SHARE * rangeAround(forward, i, reach));
    if (rising) {
      if (value > forward[high]) high = i;
      if (forward[high] - value >= least) { found.push(high); rising = false; low = i; }
    } else {
      if (value < forward[low]) low = i;
      if (value - forward[low] >= least) { rising = true; high = i; }
    }
  });
  return found.filter((i) => i > 0);
};

const cycle = (walk, a, other, b) => {
  const { fps, curves, hips } = walk, seconds = (b - a) / fps, part = (values) => values.slice(a, b);
  const speed = Math.hypot(hips[b][0] - hips[a][0], hips[b][1] - hips[a][1]) / seconds;
  const apart = (f) => curves.ankle_forward_R[f] - curves.ankle_forward_L[f];
  const standing = (side) => mean(part(walk.ankleSpeed[side]).map((v) => Number(v < STANDING_SPEED * speed)));
  const width = mean([a, other].map((f) => walk.across.L[f] - walk.across.R[f]));
  const scalars = [seconds, speed, (other - a) / (b - a), standing("R"), standing("L"), apart(a), -apart(other), width];
  const sampled = (values) => Array.from({ length: SAMPLES }, (_, k) => {
    const t = a + (b - a) * k / SAMPLES, f = Math.min(Math.floor(t), b - 1);
    return values[f] + (t - f) * (values[f + 1] - values[f]);
  });
  return { start: a, end: b, scalars, curves: CURVES.map((name) => sampled(curves[name])) };
};

const cycles = (walk) => {
  const [right, left] = ["R", "L"].map((side) => landings(walk.curves[`ankle_forward_${side}`], walk.fps)), out = [];
  for (let i = 1; i < right.length; i++) {
    const [a, b] = [right[i - 1], right[i]], between = left.filter((f) => a < f && f < b);
    if (between.length !== 1 || b - a < SHORTEST * walk.fps || b - a > LONGEST * walk.fps) continue;
    let travel = 0;
    for (let f = a; f < b; f++) travel += Math.hypot(walk.hips[f + 1][0] - walk.hips[f][0], walk.hips[f + 1][1] - walk.hips[f][1]);
    const straight = Math.abs(walk.heading[b] - walk.heading[a]) <= STRAIGHT;
    if (travel >= LEAST_TRAVEL && straight && mean(walk.ahead.slice(a, b)) >= AHEAD) out.push(cycle(walk, a, between[0], b));
  }
  return out;
};

// The cycles in which a figure walks straight ahead: those of the right leg, and those of the left leg, mirrored.
export const measureWalk = (spec, frames, fps = 60) => {
  if (frames.length < SHORTEST * fps) return { right: [], left: [] };
  const walk = signals(spec, frames, fps);
  return { right: cycles(walk), left: cycles(mirroredSignals(walk)) };
};

const ofCycles = (some) => {
  const out = {};
  SCALARS.forEach((name, s) => { out[name] = median(some.map(({ scalars }) => scalars[s])); });
  CURVES.forEach((name, c) => {
    const curve = Array.from({ length: SAMPLES }, (_, k) => median(some.map(({ curves }) => curves[c][k])));
    out[`range ${name}`] = range(curve);
    out[`mean ${name}`] = mean(curve);
  });
  return out;
};

const mirroredProfile = (values) => Object.fromEntries(Object.keys(values).map((name) => {
  if (name === "left_strike_phase") return [name, 1 - values[name]];
  if (SIGN_CHANGES.some((curve) => name === `mean ${curve}`)) return [name, -values[name]];
  const across = name.endsWith("_R") ? `${name.slice(0, -1)}L` : name.endsWith("_L") ? `${name.slice(0, -1)}R` : name;
  return [name, values[across]];
}));

// Measures of a walk: medians over its cycles, with equal weight for both legs; null if a leg has no cycle.
export const profile = ({ right, left }) => {
  if (!right.length || !left.length) return null;
  const [a, b] = [ofCycles(right), mirroredProfile(ofCycles(left))];
  return Object.fromEntries(Object.keys(a).map((name) => [name, (a[name] + b[name]) / 2]));
};
