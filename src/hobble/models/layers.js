// Layers with K sets of weights each. In each layer, the outputs of the sets are blended by shares. An ELU follows each layer but the last.
// 16-bit weights are packed by `packed_rows`, with a factor for each row. 8-bit weights are packed by
// `hobble.report.rounded_weights`, with a factor for each group of columns.
import { bytes } from "../report/web/numbers.js";

export const floats = (text) => new Float32Array(bytes(text));

export const unpacked = ({ points, rows, columns, weights, scale, biases, bits = 16, group = columns }) => {
  const integers = new (bits === 8 ? Int8Array : Int16Array)(bytes(weights)), factors = floats(scale), w = new Float32Array(integers.length);
  for (let r = 0, i = 0, f = 0; r < points * rows; r++) {
    for (let from = 0; from < columns; from += group, f++) {
      for (const end = i + Math.min(group, columns - from); i < end; i++) w[i] = integers[i] * factors[f];
    }
  }
  return { points, rows, columns, w, b: floats(biases), out: new Float32Array(rows) };
};

// Sum of w[from + c] x[c]. Four sums run side by side, because each addition has to wait for the one before it.
const product = (w, from, x, n) => {
  const whole = n - n % 4;
  let p = 0, q = 0, s = 0, t = 0;
  for (let c = 0, i = from; c < whole; c += 4, i += 4) {
    p += w[i] * x[c];
    q += w[i + 1] * x[c + 1];
    s += w[i + 2] * x[c + 2];
    t += w[i + 3] * x[c + 3];
  }
  for (let c = whole; c < n; c++) p += w[from + c] * x[c];
  return p + q + s + t;
};

// The outputs of one layer, computed from one set of weights after another, so that memory is read in order.
const applied = ({ points, rows, columns, w, b, out }, shares, x, last) => {
  out.fill(0);
  for (let k = 0; k < points; k++) {
    const share = shares ? shares[k] : 1;
    for (let r = 0, i = k * rows; r < rows; r++, i++) out[r] += share * (b[i] + product(w, i * columns, x, columns));
  }
  if (!last) for (let r = 0; r < rows; r++) if (out[r] < 0) out[r] = Math.exp(out[r]) - 1;
  return out;
};

// Returns (x, shares) => outputs, in an array that the next call overwrites. Layers with one set of weights need no shares.
export const createLayers = (packed) => {
  const layers = packed.map(unpacked);
  return (x, shares) => layers.reduce((h, one, i) => applied(one, shares, h, i === layers.length - 1), x);
};

// standardise: raw inputs x into z; inputs that the network does not read are left out. restore: outputs to raw units, in place.
export const createScales = (spec) => {
  const mean = floats(spec.xMean), inverse = floats(spec.xScale), columnsOfX = Int32Array.from(spec.inputColumns);
  const yMean = floats(spec.yMean), yStd = floats(spec.yStd);
  return {
    inputs: mean.length,
    standardise: (x, z) => { for (let c = 0; c < mean.length; c++) z[c] = (x[columnsOfX[c]] - mean[c]) * inverse[c]; },
    restore: (y) => { for (let r = 0; r < y.length; r++) y[r] = y[r] * yStd[r] + yMean[r]; return y; },
  };
};
