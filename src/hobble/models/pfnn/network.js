// The phase-functioned network. It predicts from a row of inputs and a phase. Its layers have K sets of weights, the control points, which
// belong to K phases. In each layer, the outputs of the four control points around the phase are blended, not their weights. See `forward.py`.
import { createLayers, createScales } from "../layers.js";

export const createNetwork = (spec) => {
  const layers = createLayers(spec.network.layers), { inputs, standardise, restore } = createScales(spec);
  const K = spec.network.layers[0].points, z = new Float32Array(inputs), shares = new Float64Array(K);

  // Writes the shares of the four control points around the phase (a Catmull-Rom spline) into `shares`.
  const findShares = (phase) => {
    const scaled = (phase - Math.floor(phase)) * K, first = Math.min(Math.floor(scaled), K - 1), t = scaled - first;
    shares.fill(0);
    shares[(first + K - 1) % K] = .5 * (-t + 2 * t * t - t * t * t);
    shares[first] = .5 * (2 - 5 * t * t + 3 * t * t * t);
    shares[(first + 1) % K] = .5 * (t + 4 * t * t - 3 * t * t * t);
    shares[(first + 2) % K] = .5 * (-t * t + t * t * t);
  };
  // Returns the raw outputs for raw inputs x. The next call overwrites them. x may have inputs that the network does not read.
  return (x, phase) => {
    standardise(x, z);
    findShares(phase);
    return restore(layers(z, shares));
  };
};
