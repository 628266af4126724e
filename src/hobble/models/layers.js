// Layers with K sets of weights each, packed by `packed_rows`. Their outputs are blended by shares, with an ELU between layers.
import { bytes } from "../report/web/numbers.js";

export const floats = (text) => new Float32Array(bytes(text));

const unpacked = ({ points, rows, columns, weights, scale, biases }) => {
  const integers = new Int16Array(bytes(weights)), factors = floats(scale), w = new Float32Array(integers.length);
  for (let r = 0, i = 0; r < points * rows; r++) for (let c = 0; c < columns; c++, i++) w[i] = integers[i] * factors[r];
  return { points, rows, columns, w, b: floats(biases), out: new Float32Array(rows) };
};

const applied = ({ points, rows, columns, w, b, out }, shares, x, last) => {
  for (let r = 0; r < rows; r++) {
    let y = 0;
    for (let k = 0; k < points; k++) {
      const share = shares ? shares[k] : 1, start = (k * rows + r) * columns;
      let sum = b[k * rows + r];
      for (let c = 0; c < columns; c++) sum += w[start + c] * x[c];
      y += share * sum;
    }
    out[r] = last || y >= 0 ? y : Math.exp(y) - 1;
  }
  return out;
};

// Returns (x, shares) => outputs, in an array that the next call overwrites. Without shares there is one set of weights.
export const createLayers = (packed) => {
  const layers = packed.map(unpacked);
  return (x, shares) => layers.reduce((h, one, i) => applied(one, shares, h, i === layers.length - 1), x);
};

// standardise: raw inputs x into z, without those that have no weight. restore: outputs to raw units, in place.
export const createScales = (spec) => {
  const mean = floats(spec.xMean), inverse = floats(spec.xScale), seen = Int32Array.from(spec.seen);
  const yMean = floats(spec.yMean), yStd = floats(spec.yStd);
  return {
    inputs: mean.length,
    standardise: (x, z) => { for (let c = 0; c < mean.length; c++) z[c] = (x[seen[c]] - mean[c]) * inverse[c]; },
    restore: (y) => { for (let r = 0; r < y.length; r++) y[r] = y[r] * yStd[r] + yMean[r]; return y; },
  };
};
