// The mode-adaptive network. Its layers have several sets of weights, the experts. A small gating network computes the shares in
// which the outputs of the experts are blended. See `forward.py`.
import { createLayers, createScales } from "../layers.js";

export const createNetwork = (spec) => {
  const experts = createLayers(spec.network.layers), gate = createLayers(spec.network.gateLayers), gateColumns = spec.network.gate;
  const { inputs, standardise, restore } = createScales(spec);
  const z = new Float32Array(inputs), gateInputs = new Float32Array(gateColumns.length), shares = new Float32Array(spec.network.layers[0].points);
  // Returns the raw outputs for raw inputs x. The next call overwrites them.
  return (x) => {
    standardise(x, z);
    gateColumns.forEach((column, i) => { gateInputs[i] = z[column]; });
    // The shares are the softmax of the gating network's outputs.
    const logits = gate(gateInputs), highest = Math.max(...logits);
    let sum = 0;
    for (let k = 0; k < shares.length; k++) sum += shares[k] = Math.exp(logits[k] - highest);
    for (let k = 0; k < shares.length; k++) shares[k] /= sum;
    return restore(experts(z, shares));
  };
};
