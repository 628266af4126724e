// Computes curves of a walking body over time, for the recogniser. `hobble.gait.cycles` in Python does the same. Units are degrees and leg
// lengths. Angles are relative to the vertical and to the direction of travel.
import { bytes } from "../../models/layers.js";
import { cross, dot, minus } from "./math.js";

export const SIDES = ["L", "R"];
const SIDE_NAMES = { L: "left", R: "right" };
export const LIMBS = ["hip_flexion", "hip_abduction", "knee_flexion", "ankle_height", "ankle_forward", "arm_forward"];
export const MIDDLE = ["trunk_forward", "trunk_left", "pelvis_left_up"];
export const SIGN_CHANGES = ["trunk_left", "pelvis_left_up"]; // curves whose sign changes if the walk is mirrored
const TRAVEL_SECONDS = .5; // sigma of the Gaussian that smooths the velocity of the hips, which gives the direction of travel

// The angle in degrees from the two sides of a right triangle: opposite, adjacent.
const angle = (a, b) => Math.atan2(a, b) * 180 / Math.PI;
// The vector of length 1 in the direction of v.
const normalised = (v, least = 1e-9) => { const n = Math.max(Math.hypot(...v), least); return v.map((x) => x / n); };
export const median = (values) => {
  const sorted = [...values].sort((a, b) => a - b), n = sorted.length;
  return n % 2 ? sorted[(n - 1) / 2] : (sorted[n / 2 - 1] + sorted[n / 2]) / 2;
};

// Smooths vectors of three over frames with a Gaussian of `sigma` frames, cut off at 4 sigma. Past the ends, the first and last vector repeat.
export const gaussian = (rows, sigma) => {
  const reach = Math.floor(4 * sigma + .5), n = rows.length, padded = new Float64Array(3 * (n + 2 * reach)), weights = new Float64Array(2 * reach + 1);
  let whole = 0;
  for (let i = -reach; i <= reach; i++) whole += weights[i + reach] = Math.exp(-.5 * (i / sigma) ** 2);
  for (let i = 0; i < n + 2 * reach; i++) padded.set(rows[Math.min(n - 1, Math.max(0, i - reach))], 3 * i);
  return rows.map((_, f) => {
    let x = 0, y = 0, z = 0;
    for (let i = 0, k = 3 * f; i < weights.length; i++, k += 3) {
      const w = weights[i];
      x += w * padded[k];
      y += w * padded[k + 1];
      z += w * padded[k + 2];
    }
    return [x / whole, y / whole, z / whole];
  });
};

// The change per frame: half the difference of the frames before and after. At the ends, the difference of the last two frames there.
const gradient = (rows) => rows.map((row, f) => {
  const a = Math.max(0, f - 1), b = Math.min(rows.length - 1, f + 1);
  return row.map((_, k) => (rows[b][k] - rows[a][k]) / (b - a));
});

// Degrees by which the joint at b is bent between a and c. 0 is straight.
const bendAngle = (a, b, c) => {
  const u = minus(b, a), v = minus(c, b);
  return angle(Math.hypot(...cross(u, v)), dot(u, v));
};

// spec: has `names` (of joints) and `roles` (role -> joint). frames: the positions of all joints (3 J) of each frame, cm, Y up.
// In the result, leg: leg length, cm. curves: name -> value in each frame. heading: direction of travel, degrees. ahead: cosine of the angle
// between facing and travel. hips: path [x, z]. ankleSpeed: of each side, leg lengths a second. across: how far each ankle is to the left of
// the hips.
export const signals = (spec, frames, fps = 60) => {
  const joint = (role) => spec.names.indexOf(spec.roles[role]);
  const at = Object.fromEntries(Object.keys(spec.roles).map((role) => {
    const j = 3 * joint(role);
    return [role, frames.map((p) => [p[j], p[j + 1], p[j + 2]])];
  }));
  const ahead = gaussian(gradient(at.hips), TRAVEL_SECONDS * fps).map(([x, , z]) => normalised([x, 0, z]));
  const left = ahead.map((a) => cross([0, 1, 0], a));
  const bone = (a, b) => median(at[a].map((p, f) => Math.hypot(...minus(p, at[b][f]))));
  const leg = ["left", "right"].reduce((sum, side) => sum + bone(`${side}_hip`, `${side}_knee`) + bone(`${side}_knee`, `${side}_heel`), 0) / 2;
  const trunkTop = ["neck", "chest", "head"].find((role) => role in spec.roles);
  const curves = {}, frameNumbers = frames.map((_, f) => f);
  for (const side of SIDES) {
    const limb = (part) => at[`${SIDE_NAMES[side]}_${part}`], out = side === "L" ? left : left.map((v) => v.map((x) => -x));
    const hand = limb("elbow") || limb("wrist"), thigh = frameNumbers.map((f) => minus(limb("knee")[f], limb("hip")[f]));
    Object.assign(curves, {
      [`hip_flexion_${side}`]: frameNumbers.map((f) => angle(dot(thigh[f], ahead[f]), -thigh[f][1])),
      [`hip_abduction_${side}`]: frameNumbers.map((f) => angle(dot(thigh[f], out[f]), -thigh[f][1])),
      [`knee_flexion_${side}`]: frameNumbers.map((f) => bendAngle(limb("hip")[f], limb("knee")[f], limb("heel")[f])),
      [`ankle_height_${side}`]: frameNumbers.map((f) => limb("heel")[f][1] / leg),
      [`ankle_forward_${side}`]: frameNumbers.map((f) => dot(minus(limb("heel")[f], at.hips[f]), ahead[f]) / leg),
      [`arm_forward_${side}`]: frameNumbers.map((f) => {
        if (!hand) return 0;
        const arm = minus(hand[f], limb("shoulder")[f]);
        return angle(dot(arm, ahead[f]), -arm[1]);
      }),
    });
  }
  const trunk = frameNumbers.map((f) => minus(at[trunkTop][f], at.hips[f]));
  const pelvis = frameNumbers.map((f) => minus(at.left_hip[f], at.right_hip[f])), shoulders = frameNumbers.map((f) => minus(at.left_shoulder[f], at.right_shoulder[f]));
  curves.trunk_forward = frameNumbers.map((f) => angle(dot(trunk[f], ahead[f]), trunk[f][1]));
  curves.trunk_left = frameNumbers.map((f) => angle(dot(trunk[f], left[f]), trunk[f][1]));
  curves.pelvis_left_up = frameNumbers.map((f) => angle(pelvis[f][1], Math.hypot(dot(pelvis[f], left[f]), dot(pelvis[f], ahead[f]))));
  const across = frameNumbers.map((f) => { const [a, b] = [normalised(pelvis[f]), normalised(shoulders[f])]; return a.map((v, i) => v + b[i]); });
  const facing = gaussian(across.map((v) => cross(v, [0, 1, 0])), TRAVEL_SECONDS * fps).map((v) => normalised(v));
  const speed = (points) => gradient(points).map(([x, , z]) => Math.hypot(x, z) * fps / leg);
  return {
    fps, leg, curves,
    heading: unwrapped(ahead.map(([x, , z]) => Math.atan2(x, z))).map((v) => v * 180 / Math.PI),
    ahead: frameNumbers.map((f) => dot(facing[f], ahead[f])),
    hips: at.hips.map(([x, , z]) => [x / leg, z / leg]),
    ankleSpeed: Object.fromEntries(SIDES.map((side) => [side, speed(at[`${SIDE_NAMES[side]}_heel`])])),
    across: Object.fromEntries(SIDES.map((side) => [side, frameNumbers.map((f) => dot(minus(at[`${SIDE_NAMES[side]}_heel`][f], at.hips[f]), left[f]) / leg)])),
  };
};

// The same angles (radians), without jumps of a whole turn.
const unwrapped = (angles) => {
  let turns = 0;
  return angles.map((angle, i) => {
    if (i) turns -= Math.round((angle - angles[i - 1]) / (2 * Math.PI));
    return angle + 2 * Math.PI * turns;
  });
};

// The signals of the mirrored walk: left and right are swapped.
export const mirroredSignals = (walk) => {
  const curves = {}, other = { L: "R", R: "L" };
  for (const limb of LIMBS) for (const side of SIDES) curves[`${limb}_${side}`] = walk.curves[`${limb}_${other[side]}`];
  for (const name of MIDDLE) curves[name] = SIGN_CHANGES.includes(name) ? walk.curves[name].map((v) => -v) : walk.curves[name];
  return {
    ...walk, curves,
    heading: walk.heading.map((v) => -v),
    hips: walk.hips.map(([x, z]) => [-x, z]),
    ankleSpeed: { L: walk.ankleSpeed.R, R: walk.ankleSpeed.L },
    across: { L: walk.across.R.map((v) => -v), R: walk.across.L.map((v) => -v) },
  };
};

// Finds the gait cycles of a walk and measures them, as `hobble.gait.cycles` and `hobble.gait.profile` do in Python. A cycle goes from one
// landing of a foot to its next. A foot lands when its ankle is furthest ahead of the hips. Lengths are in leg lengths.

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

// Recognises a limp: what hurts, on which side, and with what probability. It compares a walk with the healthy walk of the same figure.
// It computes the same as `hobble.gait.profile` and `hobble.gait.recognise` in Python. The page contains statistics of people's limps.

const LEAST_RANGE = 3; // degrees: smaller ranges of an angle are raised to this, so that the ratio of two ranges has a meaning
const MOST_RATIO = 5; // larger ratios of two ranges are lowered to this
export const SECONDS = 3; // of motion are used, because in two seconds half of all limps have no whole cycle of both legs

const clip = (v, low, high) => Math.min(Math.max(v, low), high);

// About twenty features that distinguish limps, by name, in the same order as in Python. walk, healthy: profiles, see profile.
export const features = (walk, healthy) => {
  const change = (name) => walk[name] - healthy[name], sides = (name) => change(`${name}_R`) - change(`${name}_L`);
  const share = (name) => Math.min(Math.max(walk[`range ${name}`], LEAST_RANGE) / Math.max(healthy[`range ${name}`], LEAST_RANGE), MOST_RATIO);
  const out = {
    "stance L - R": -sides("stance_share"),
    "left landing": change("left_strike_phase"),
    "step R - L": sides("step"),
    "step width": change("step_width"),
    "range hip_abduction R - L": sides("range hip_abduction"),
    "range ankle_height R - L": sides("range ankle_height"),
  };
  for (const part of ["knee_flexion", "hip_flexion"]) out[`range ${part} R - L`] = share(`${part}_R`) - share(`${part}_L`);
  out["range arm_forward R - L"] = clip(Math.log(share("arm_forward_R") / share("arm_forward_L")), -Math.log(MOST_RATIO), Math.log(MOST_RATIO));
  for (const part of ["knee_flexion", "hip_flexion", "hip_abduction"]) for (const side of "RL") out[`mean ${part} ${side}`] = change(`mean ${part}_${side}`);
  for (const part of ["trunk_forward", "trunk_left", "pelvis_left_up"]) for (const kind of ["range", "mean"]) out[`${kind} ${part}`] = change(`${kind} ${part}`);
  return out;
};

// The lower triangular matrix L (D, D), flat, row by row, with L L^T = matrix.
const cholesky = (matrix, D) => {
  const low = new Float64Array(D * D);
  for (let i = 0; i < D; i++) {
    for (let j = 0; j <= i; j++) {
      let sum = matrix[i * D + j];
      for (let k = 0; k < j; k++) sum -= low[i * D + k] * low[j * D + k];
      low[i * D + j] = i === j ? Math.sqrt(sum) : sum / low[j * D + j];
    }
  }
  return low;
};

// learnt: from `learnt` in `hobble.report.character`. A kind of limp is a label for what may hurt, with a side. Returns a function of the
// profiles of a walk and of the healthy walk: (walk, healthy) => {label, kind, strength, distance, probabilities, sides}.
// label: the most likely one, or "normal". kind: its most likely kind, an entry of learnt.kinds, or null. strength: of the limp; 1 is the mean
// of people. distance: from the likeliest limp or healthy walk, in standard deviations. probabilities: by label. sides: of each kind.
export const createGrader = (learnt) => {
  const D = learnt.features.length, healthy = new Float64Array(bytes(learnt.healthySpread)), densities = [];
  const numbers = (text) => new Float64Array(bytes(text));
  // A density is a normal distribution of the features of healthy walks, or of limps of one kind and strength. mean, spread (a covariance): of
  // limps of strength 1. peak: log of the largest density times the prior probability, up to a constant.
  const addDensity = (mean, spread, strength, kind) => {
    const factor = cholesky(healthy.map((v, i) => v + strength * strength * (spread ? spread[i] : 0)), D);
    let peak = kind ? -Math.log(learnt.kinds.length * learnt.strengths.length) : 0;
    for (let i = 0; i < D; i++) peak -= Math.log(factor[i * D + i]);
    densities.push({ mean: mean ? mean.map((v) => strength * v) : new Float64Array(D), factor, peak, kind, strength });
  };
  addDensity(null, null, 0, null);
  for (const kind of learnt.kinds) {
    const [mean, spread] = [numbers(kind.mean), numbers(kind.spread)];
    for (const strength of learnt.strengths) addDensity(mean, spread, strength, kind);
  }
  // The squared Mahalanobis distance of the features x from the mean, by forward substitution.
  const squaredDistance = ({ mean, factor }, x) => {
    const z = new Float64Array(D);
    let sum = 0;
    for (let i = 0; i < D; i++) {
      let v = x[i] - mean[i];
      for (let k = 0; k < i; k++) v -= factor[i * D + k] * z[k];
      z[i] = v / factor[i * D + i];
      sum += z[i] * z[i];
    }
    return sum;
  };
  return (walk, healthyWalk) => {
    const found = features(walk, healthyWalk), x = learnt.features.map((name) => found[name]);
    const squares = densities.map((density) => squaredDistance(density, x)), scores = densities.map(({ peak }, i) => peak - .5 * squares[i]);
    const best = Math.max(...scores), likely = scores.map((score) => Math.exp(score - best)), total = likely.reduce((a, b) => a + b);
    const sides = learnt.kinds.map(() => 0), strengths = learnt.kinds.map(() => 0);
    densities.forEach(({ kind, strength }, i) => {
      if (!kind) return;
      const k = learnt.kinds.indexOf(kind);
      sides[k] += likely[i] / total;
      strengths[k] += strength * likely[i] / total;
    });
    const probabilities = { normal: likely[0] / total };
    learnt.kinds.forEach(({ label }, k) => { probabilities[label] = (probabilities[label] || 0) + sides[k]; });
    const label = Object.keys(probabilities).reduce((a, b) => (probabilities[b] > probabilities[a] ? b : a));
    const ofLabel = learnt.kinds.map((kind, k) => k).filter((k) => learnt.kinds[k].label === label);
    const k = ofLabel.length ? ofLabel.reduce((a, b) => (sides[b] > sides[a] ? b : a)) : -1;
    return {
      label, kind: k < 0 ? null : learnt.kinds[k], strength: k < 0 ? 0 : strengths[k] / sides[k],
      distance: Math.sqrt(squares[scores.indexOf(best)] / D), probabilities, sides,
    };
  };
};

// Recognises the limp of the played character. add(places): adds a frame with the positions of all joints. say(): the answer {text, share} for
// the last SECONDS, with its probability `share`. If there is no answer, {text} with the reason.
export const createWatch = (spec) => {
  const { learnt, healthy } = spec.recogniser, grade = createGrader(learnt), most = 60 * SECONDS;
  let frames = [];
  return {
    add(places) { frames.push(Float32Array.from(places)); if (frames.length > most) frames.shift(); },
    clear() { frames = []; },
    say() {
      if (frames.length < most) return { text: "collecting motion" };
      const walk = profile(measureWalk(spec, frames));
      if (!walk) return { text: "no answer: walk straight ahead" };
      const { kind, probabilities, sides } = grade(walk, healthy);
      const share = kind ? sides[learnt.kinds.indexOf(kind)] : probabilities.normal;
      return { text: kind ? kind.words : "nothing hurts", share };
    },
  };
};
