// The phase-functioned network. It predicts from a row of inputs and a phase. Its layers have K sets of weights, the control points, which
// belong to K phases. In each layer, the outputs of the four control points around the phase are blended, not their weights.
// `PfnnPredictor` in Python does the same in its mode "cubic".
import { floats, unpackLayer } from "../layers.js";

export const createNetwork = (spec) => {
  const layers = spec.network.layers.map(unpackLayer);
  const K = spec.network.layers[0].points, mean = floats(spec.xMean), inverseStd = floats(spec.xScale);
  const columnsOfX = Int32Array.from(spec.inputColumns), yMean = floats(spec.yMean), yStd = floats(spec.yStd), z = new Float32Array(mean.length);
  const index = new Int32Array(4), share = new Float64Array(4);

  // Writes the four control points around the phase into `index`, and their shares (a Catmull-Rom spline) into `share`.
  const findControlPoints = (phase) => {
    const scaled = (phase - Math.floor(phase)) * K, first = Math.min(Math.floor(scaled), K - 1), t = scaled - first;
    for (let k = 0; k < 4; k++) index[k] = (first + k - 1 + K) % K;
    share[0] = .5 * (-t + 2 * t * t - t * t * t);
    share[1] = .5 * (2 - 5 * t * t + 3 * t * t * t);
    share[2] = .5 * (t + 4 * t * t - 3 * t * t * t);
    share[3] = .5 * (-t * t + t * t * t);
  };
  // The outputs of a layer for the inputs x. All layers except the last have an ELU.
  const applyLayer = ({ rows, columns, w, b, out }, x, last) => {
    const size = rows * columns, [i, j, m, n] = index, [p, q, s, u] = share;
    for (let r = 0; r < rows; r++) {
      let a0 = 0, a1 = 0, a2 = 0, a3 = 0, at = r * columns;
      for (let c = 0; c < columns; c++, at++) {
        const v = x[c];
        a0 += w[i * size + at] * v;
        a1 += w[j * size + at] * v;
        a2 += w[m * size + at] * v;
        a3 += w[n * size + at] * v;
      }
      const y = p * (a0 + b[i * rows + r]) + q * (a1 + b[j * rows + r]) + s * (a2 + b[m * rows + r]) + u * (a3 + b[n * rows + r]);
      out[r] = last || y >= 0 ? y : Math.exp(y) - 1;
    }
    return out;
  };
  // Returns the raw outputs for raw inputs x. The next call overwrites them. x may have inputs that the network does not read.
  return (x, phase) => {
    for (let c = 0; c < z.length; c++) z[c] = (x[columnsOfX[c]] - mean[c]) * inverseStd[c];
    findControlPoints(phase);
    let h = z;
    layers.forEach((layer, l) => { h = applyLayer(layer, h, l === layers.length - 1); });
    for (let r = 0; r < h.length; r++) h[r] = h[r] * yStd[r] + yMean[r];
    return h;
  };
};
