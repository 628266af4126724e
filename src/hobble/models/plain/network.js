// A feed-forward network. Its inputs are the input row of the character, and the sine and cosine of the phase. See `network.py`.
import { createLayers, createScales } from "../layers.js";

export const createNetwork = (spec) => {
  const layers = createLayers(spec.network.layers), { inputs, standardise, restore } = createScales(spec);
  const z = new Float32Array(inputs + 2);
  // Returns the raw outputs for raw inputs x. The next call overwrites them.
  return (x, phase) => {
    standardise(x, z);
    z[inputs] = Math.sin(2 * Math.PI * phase);
    z[inputs + 1] = Math.cos(2 * Math.PI * phase);
    return restore(layers(z));
  };
};
