// The mode-adaptive network: a small network computes the shares in which the experts' outputs are blended. See `forward.py`.
import { createLayers, createScales } from "../layers.js";

export const createNetwork = (spec) => {
  const experts = createLayers(spec.network.layers), gate = createLayers(spec.network.gateLayers), gateColumns = spec.network.gate;
  const { inputs, standardise, restore } = createScales(spec);
  const z = new Float32Array(inputs), g = new Float32Array(gateColumns.length), shares = new Float32Array(spec.network.layers[0].points);
  return (x) => {
    standardise(x, z);
    gateColumns.forEach((at, i) => { g[i] = z[at]; });
    const logits = gate(g), most = Math.max(...logits);
    let sum = 0;
    for (let k = 0; k < shares.length; k++) sum += shares[k] = Math.exp(logits[k] - most);
    for (let k = 0; k < shares.length; k++) shares[k] /= sum;
    return restore(experts(z, shares));
  };
};
