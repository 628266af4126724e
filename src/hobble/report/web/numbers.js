// Reads numbers that the page contains as base64, and computes with vectors of three numbers.

// The bytes of a base64 text, as an ArrayBuffer.
export const bytes = (text) => {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text).buffer;
  const raw = atob(text), out = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) out[i] = raw.charCodeAt(i);
  return out.buffer;
};

export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
// The vector of length 1 in the direction of a.
export const unit = (a) => { const n = Math.hypot(...a) || 1; return a.map((v) => v / n); };
// The vector between a (t = 0) and b (t = 1).
export const mix = (a, b, t) => a.map((v, i) => v + (b[i] - v) * t);
// The same angle in -pi to pi.
export const wrap = (angle) => angle - 2 * Math.PI * Math.floor((angle + Math.PI) / (2 * Math.PI));
