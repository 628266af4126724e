// Motion matching: plays the clips, searches every few frames for the recorded frame that fits best, and smooths the transitions. It
// computes the same as `predictor.py` and `inertia.py` in Python. Each character has a memory: an array of `spec.network.memory`
// numbers, zeros at first. It contains the last row shown and, for each joint, offsets that are added to the recorded poses.
import { bytes, createScales, floats } from "../layers.js";

// Indices in the memory: 1 + the last row shown (0 before the first frame), frames since the last search, the first offset.
const ROW = 0, SINCE = 1, OFFSETS = 2;
const OFFSETS_PER_JOINT = 12; // offsets of position, velocity, rotation and rotation speed, three numbers each
const FASTEST_PULL = .002; // cycles a frame: the phase is corrected toward the clip's phase by at most this
const SURROUNDING = 20; // a row that is at most this many rows from the following one is not worth a transition
const { sqrt, sin, cos, atan2, exp, floor, min, max, abs } = Math;

// The quaternion of the vector v[i], v[i + 1], v[i + 2], which is an axis times half an angle.
const toQuaternion = (v, i) => {
  const half = sqrt(v[i] * v[i] + v[i + 1] * v[i + 1] + v[i + 2] * v[i + 2]), scale = half > 1e-8 ? sin(half) / half : 1;
  return [cos(half), v[i] * scale, v[i + 1] * scale, v[i + 2] * scale];
};
// The inverse of `toQuaternion` for the product of the quaternions a and b. Writes the vector of the shorter rotation into v at index i.
const toVector = (a, b, v, i) => {
  let w = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], x = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2];
  let y = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1], z = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0];
  if (w < 0) [w, x, y, z] = [-w, -x, -y, -z];
  const length = sqrt(x * x + y * y + z * z), scale = length > 1e-8 ? atan2(length, w) / length : 1;
  v[i] = x * scale;
  v[i + 1] = y * scale;
  v[i + 2] = z * scale;
};
const invert = ([w, x, y, z]) => [w, -x, -y, -z];

// In spec.network, frames: the table of output rows Y, one for each recorded frame. columns: which inputs the search compares.
// features: their values (rows, n) in the recorded frames, multiplied by `weights`. start: the rows that a search may find. remaining: how
// many rows follow each row in its clip. every: frames between two searches. halflife: of the offsets, in frames. at: the first columns
// in Y of joint positions and velocities, and the column of the phase's change. turning: [joint, first column of its rotation in Y].
export const createNetwork = (spec) => {
  const { columns, every, halflife, joints, at, turning, frames: table } = spec.network;
  const values = new Int16Array(bytes(table.values)), scale = floats(table.scale), width = table.columns, rows = table.rows;
  const features = floats(spec.network.features), weights = floats(spec.network.weights), n = columns.length;
  const phases = floats(spec.network.phases), remaining = new Int32Array(bytes(spec.network.remaining));
  const starts = new Int32Array(bytes(spec.network.start)), { inputs } = createScales(spec);
  const columnsOfX = Int32Array.from(spec.inputColumns), query = new Float32Array(n), out = new Float32Array(width);
  const [position, velocity, change] = at, damping = 2 * Math.LN2 / halflife;
  if (inputs !== columnsOfX.length) throw new Error(`the page has ${columnsOfX.length} input columns, but the network reads ${inputs}; make the page again`);

  // The outputs of a row of the table, unpacked.
  const readRow = (row, into = new Float32Array(width)) => {
    for (let i = 0, from = row * width; i < width; i++) into[i] = values[from + i] * scale[i];
    return into;
  };
  // Squared distance of a row from the query. The sum stops above `most`, because such a row is not the nearest.
  const distance = (row, most) => {
    let sum = 0;
    for (let i = 0, from = row * n; i < n && sum <= most; i++) {
      const d = query[i] - features[from + i];
      sum += d * d;
    }
    return sum;
  };
  // The row to show for inputs x. following: the row after the last one in its clip, or -1 if the clip has ended.
  const searchRow = (x, following) => {
    for (let i = 0; i < n; i++) query[i] = x[columnsOfX[columns[i]]] * weights[i];
    let best = -1, least = following < 0 ? Infinity : distance(following, Infinity);
    for (const row of starts) {
      const d = distance(row, least);
      if (d < least) [best, least] = [row, d];
    }
    return best < 0 || (following >= 0 && abs(best - following) <= SURROUNDING) ? following : best;
  };

  // Adds to the offsets the difference between the pose that would have come next (row `following`) and the pose of `row`. If the
  // clip has ended, the last pose shown takes the place of the next one.
  const startTransition = (offsets, lastRow, following, row) => {
    const past = readRow(lastRow), old = following < 0 ? past : readRow(following), next = readRow(row), earlier = readRow(max(row - 1, 0));
    for (let j = 0; j < joints; j++) for (let i = 0; i < 3; i++) {
      offsets[OFFSETS_PER_JOINT * j + i] += old[position + 3 * j + i] - next[position + 3 * j + i];
      offsets[OFFSETS_PER_JOINT * j + 3 + i] += old[velocity + 3 * j + i] - next[velocity + 3 * j + i];
    }
    const turn = [0, 0, 0];
    for (const [j, r] of turning) {
      const k = OFFSETS_PER_JOINT * j;
      toVector(toQuaternion(old, r), invert(toQuaternion(next, r)), turn, 0);
      toVector(toQuaternion(offsets, k + 6), toQuaternion(turn, 0), offsets, k + 6);
      if (following < 0) continue;
      toVector(toQuaternion(old, r), invert(toQuaternion(past, r)), turn, 0);
      for (let i = 0; i < 3; i++) offsets[k + 9 + i] += turn[i];
      toVector(toQuaternion(next, r), invert(toQuaternion(earlier, r)), turn, 0);
      for (let i = 0; i < 3; i++) offsets[k + 9 + i] -= turn[i];
    }
  };
  // Advances the offsets and their speeds by a frame: they decay like a critically damped spring.
  const decayOffsets = (offsets) => {
    const fade = exp(-damping);
    for (let k = 0; k < offsets.length; k += 6) for (let i = k; i < k + 3; i++) {
      const j = offsets[i + 3] + offsets[i] * damping;
      [offsets[i], offsets[i + 3]] = [fade * (offsets[i] + j), fade * (offsets[i + 3] - j * damping)];
    }
  };
  // Adds the offsets to the outputs y.
  const addOffsets = (offsets, y) => {
    for (let j = 0; j < joints; j++) for (let i = 0; i < 3; i++) {
      y[position + 3 * j + i] += offsets[OFFSETS_PER_JOINT * j + i];
      y[velocity + 3 * j + i] += offsets[OFFSETS_PER_JOINT * j + 3 + i];
    }
    for (const [j, r] of turning) toVector(toQuaternion(offsets, OFFSETS_PER_JOINT * j + 6), toQuaternion(y, r), y, r);
  };

  // Returns the raw outputs for raw inputs x, and updates the memory. The next call overwrites the outputs.
  return (x, phase, memory = new Float64Array(spec.network.memory)) => {
    const hasRow = memory[ROW] >= 1 && memory[ROW] <= rows, lastRow = hasRow ? memory[ROW] - 1 : -1;
    const following = hasRow && remaining[lastRow] > 0 ? lastRow + 1 : -1, mustSearch = following < 0 || !(memory[SINCE] + 1 < every);
    const row = mustSearch ? searchRow(x, following) : following;
    readRow(row, out);
    if (hasRow) {
      const offsets = memory.subarray(OFFSETS);
      if (row !== following) startTransition(offsets, lastRow, following, row);
      decayOffsets(offsets);
      addOffsets(offsets, out);
      let lag = phases[row] - phase;
      lag -= floor(lag + .5);
      out[change] += min(max(lag, -FASTEST_PULL), FASTEST_PULL);
    } else memory.fill(0);
    memory[ROW] = row + 1;
    memory[SINCE] = mustSearch ? 0 : memory[SINCE] + 1;
    return out;
  };
};
