// Motion matching: plays the clips, searches every few frames, smooths the transitions. It computes the same as `predictor.py`
// and `inertia.py` in Python. memory: an array of `spec.network.memory` numbers for each character, zeros at first.
import { bytes } from "../../report/web/numbers.js";
import { createScales, floats } from "../layers.js";

const ROW = 0, SINCE = 1, OFFSETS = 2, OFFSETS_PER_JOINT = 12, FASTEST_PULL = .002, SURROUNDING = 20;
const { sqrt, sin, cos, atan2, exp, floor, min, max, abs } = Math;

const toQuaternion = (v, i) => {
  const half = sqrt(v[i] * v[i] + v[i + 1] * v[i + 1] + v[i + 2] * v[i + 2]), scale = half > 1e-8 ? sin(half) / half : 1;
  return [cos(half), v[i] * scale, v[i + 1] * scale, v[i + 2] * scale];
};
// Writes into v, from index i on, the axis times half the angle of the product a b, along the shorter way.
const toVector = (a, b, v, i) => {
  let w = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], x = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2];
  let y = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1], z = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0];
  if (w < 0) [w, x, y, z] = [-w, -x, -y, -z];
  const length = sqrt(x * x + y * y + z * z), scale = length > 1e-8 ? atan2(length, w) / length : 1;
  v[i] = x * scale;
  v[i + 1] = y * scale;
  v[i + 2] = z * scale;
};
const inverted = ([w, x, y, z]) => [w, -x, -y, -z];

export const createNetwork = (spec) => {
  const { columns, every, halflife, joints, at, turning, frames: table } = spec.network;
  const values = new Int16Array(bytes(table.values)), scale = floats(table.scale), width = table.columns, rows = table.rows;
  const features = floats(spec.network.features), weights = floats(spec.network.weights), n = columns.length;
  const phases = floats(spec.network.phases), remaining = new Int32Array(bytes(spec.network.remaining));
  const starts = new Int32Array(bytes(spec.network.start)), { inputs } = createScales(spec);
  const columnsOfX = Int32Array.from(spec.inputColumns), query = new Float32Array(n), out = new Float32Array(width);
  const [position, velocity, change] = at, damping = 2 * Math.LN2 / halflife;
  if (inputs !== columnsOfX.length) throw new Error("the columns of X do not fit the network");

  const frame = (row, into = new Float32Array(width)) => {
    for (let i = 0, from = row * width; i < width; i++) into[i] = values[from + i] * scale[i];
    return into;
  };
  // Squared distance of a row from the query. If it is above `most`, the result may be any number above `most`.
  const distance = (row, most) => {
    let sum = 0;
    for (let i = 0, from = row * n; i < n && sum <= most; i++) {
      const d = query[i] - features[from + i];
      sum += d * d;
    }
    return sum;
  };
  const searched = (x, following) => {
    for (let i = 0; i < n; i++) query[i] = x[columnsOfX[columns[i]]] * weights[i];
    let best = -1, least = following < 0 ? Infinity : distance(following, Infinity);
    for (const row of starts) {
      const d = distance(row, least);
      if (d < least) [best, least] = [row, d];
    }
    return best < 0 || (following >= 0 && abs(best - following) <= SURROUNDING) ? following : best;
  };

  const begin = (o, before, following, row) => {
    const past = frame(before), old = following < 0 ? past : frame(following), next = frame(row), earlier = frame(max(row - 1, 0));
    for (let j = 0; j < joints; j++) for (let i = 0; i < 3; i++) {
      o[OFFSETS_PER_JOINT * j + i] += old[position + 3 * j + i] - next[position + 3 * j + i];
      o[OFFSETS_PER_JOINT * j + 3 + i] += old[velocity + 3 * j + i] - next[velocity + 3 * j + i];
    }
    const turn = [0, 0, 0];
    for (const [j, r] of turning) {
      const k = OFFSETS_PER_JOINT * j;
      toVector(toQuaternion(old, r), inverted(toQuaternion(next, r)), turn, 0);
      toVector(toQuaternion(o, k + 6), toQuaternion(turn, 0), o, k + 6);
      if (following < 0) continue;
      toVector(toQuaternion(old, r), inverted(toQuaternion(past, r)), turn, 0);
      for (let i = 0; i < 3; i++) o[k + 9 + i] += turn[i];
      toVector(toQuaternion(next, r), inverted(toQuaternion(earlier, r)), turn, 0);
      for (let i = 0; i < 3; i++) o[k + 9 + i] -= turn[i];
    }
  };
  const decay = (o) => {
    const fade = exp(-damping);
    for (let k = 0; k < o.length; k += 6) for (let i = k; i < k + 3; i++) {
      const j = o[i + 3] + o[i] * damping;
      [o[i], o[i + 3]] = [fade * (o[i] + j), fade * (o[i + 3] - j * damping)];
    }
  };
  const add = (o, y) => {
    for (let j = 0; j < joints; j++) for (let i = 0; i < 3; i++) {
      y[position + 3 * j + i] += o[OFFSETS_PER_JOINT * j + i];
      y[velocity + 3 * j + i] += o[OFFSETS_PER_JOINT * j + 3 + i];
    }
    for (const [j, r] of turning) toVector(toQuaternion(o, OFFSETS_PER_JOINT * j + 6), toQuaternion(y, r), y, r);
  };

  return (x, phase, memory = new Float64Array(spec.network.memory)) => {
    const known = memory[ROW] >= 1 && memory[ROW] <= rows, before = known ? memory[ROW] - 1 : -1;
    const following = known && remaining[before] > 0 ? before + 1 : -1, due = following < 0 || !(memory[SINCE] + 1 < every);
    const row = due ? searched(x, following) : following;
    frame(row, out);
    if (known) {
      const o = memory.subarray(OFFSETS);
      if (row !== following) begin(o, before, following, row);
      decay(o);
      add(o, out);
      let off = phases[row] - phase;
      off -= floor(off + .5);
      out[change] += min(max(off, -FASTEST_PULL), FASTEST_PULL);
    } else memory.fill(0);
    memory[ROW] = row + 1;
    memory[SINCE] = due ? 0 : memory[SINCE] + 1;
    return out;
  };
};
