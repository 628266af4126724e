// Recognises a limp: what hurts, on which side, and with what probability. It compares a walk with the healthy walk of the same figure.
// It computes the same as `hobble.gait.profile` and `hobble.gait.recognise` in Python. The page contains statistics of people's limps.
import { measureWalk, profile } from "./cycles.js";
import { bytes } from "./numbers.js";

const LEAST_RANGE = 3; // degrees: smaller ranges of an angle are raised to this, so that the ratio of two ranges has a meaning
const MOST_RATIO = 5; // larger ratios of two ranges are lowered to this
export const SECONDS = 3; // of motion are used, because in two seconds half of all limps have no whole cycle of both legs

const clip = (v, low, high) => Math.min(Math.max(v, low), high);

// About twenty features that distinguish limps, by name, in the same order as in Python. walk, healthy: profiles, see cycles.js.
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

// learnt: from `learnt` in `hobble.report.pack_recogniser`. A kind of limp is a label for what may hurt, with a side. Returns a function of the
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
