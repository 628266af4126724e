// y = W x + b on standardised x and y.
import { bytes } from "../layers.js";

export const createNetwork = (spec) => {
  const floats = (text) => new Float32Array(bytes(text)), [layer] = spec.network.layers;
  const w = new Int16Array(bytes(layer.weights)), scale = floats(layer.scale), b = floats(layer.biases);
  const mean = floats(spec.xMean), inverse = floats(spec.xScale), yMean = floats(spec.yMean), yStd = floats(spec.yStd);
  return (x) => b.map((bias, r) => {
    let sum = 0;
    for (let c = 0; c < layer.columns; c++) sum += w[r * layer.columns + c] * (x[c] - mean[c]) * inverse[c];
    return (sum * scale[r] + bias) * yStd[r] + yMean[r];
  });
};
