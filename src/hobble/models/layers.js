// Layers of a network. Each layer has K sets of weights. Its output is the sum of the outputs of the sets, each multiplied by the
// share of its set. An ELU follows each layer except the last.
// The page contains weights as integers, with factors to multiply them by. 16-bit weights come from `packed_rows` of
// `hobble.models.network`, with a factor for each row. 8-bit weights come from `hobble.report.rounded_weights`, with a factor for
// each group of columns.
// The bytes of a base64 text, as an ArrayBuffer.
export const bytes = (text) => {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text).buffer;
  const raw = atob(text), out = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) out[i] = raw.charCodeAt(i);
  return out.buffer;
};

// The float32 array in a base64 text.
export const floats = (text) => new Float32Array(bytes(text));

// A layer from the page's data. points: K. group: number of columns that share a factor. In the result, w: weights (K, rows, columns) and
// b: biases (K, rows), both flat. out: the array into which the outputs are written.
export const unpackLayer = ({ points, rows, columns, weights, scale, biases, bits = 16, group = columns }) => {
  const integers = new (bits === 8 ? Int8Array : Int16Array)(bytes(weights)), factors = floats(scale), w = new Float32Array(integers.length);
  for (let r = 0, i = 0, f = 0; r < points * rows; r++) {
    for (let from = 0; from < columns; from += group, f++) {
      for (const end = i + Math.min(group, columns - from); i < end; i++) w[i] = integers[i] * factors[f];
    }
  }
  return { points, rows, columns, w, b: floats(biases), out: new Float32Array(rows) };
};

// Sum of w[from + c] x[c] over n columns c. There are four partial sums, because an addition has to wait for the last addition to
// the same sum.
const dotProduct = (w, from, x, n) => {
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

// The outputs of a layer for the inputs x. The sets of weights are used one after another, so that memory is read in order.
// last: whether it is the last layer, which has no ELU.
const applyLayer = ({ points, rows, columns, w, b, out }, shares, x, last) => {
  out.fill(0);
  for (let k = 0; k < points; k++) {
    const share = shares ? shares[k] : 1;
    if (share === 0) continue;
    for (let r = 0, i = k * rows; r < rows; r++, i++) out[r] += share * (b[i] + dotProduct(w, i * columns, x, columns));
  }
  if (!last) for (let r = 0; r < rows; r++) if (out[r] < 0) out[r] = Math.exp(out[r]) - 1;
  return out;
};

// Returns a function (x, shares) => outputs. The next call overwrites the outputs. shares: (K,) share of each set of weights. They are
// not needed if each layer has one set.
export const createLayers = (packed) => {
  const layers = packed.map(unpackLayer);
  return (x, shares) => layers.reduce((h, layer, i) => applyLayer(layer, shares, h, i === layers.length - 1), x);
};

// Returns {inputs, standardise, restore}. inputs: how many columns of X the network reads. standardise(x, z): writes these columns of the
// raw inputs x into z, standardised. restore(y): converts outputs y to raw units, in place, and returns them.
export const createScales = (spec) => {
  const mean = floats(spec.xMean), inverseStd = floats(spec.xScale), columnsOfX = Int32Array.from(spec.inputColumns);
  const yMean = floats(spec.yMean), yStd = floats(spec.yStd);
  return {
    inputs: mean.length,
    standardise: (x, z) => { for (let c = 0; c < mean.length; c++) z[c] = (x[columnsOfX[c]] - mean[c]) * inverseStd[c]; },
    restore: (y) => { for (let r = 0; r < y.length; r++) y[r] = y[r] * yStd[r] + yMean[r]; return y; },
  };
};
