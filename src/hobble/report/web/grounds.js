// The grounds that one may play on: height in cm at x, z.
export const GROUNDS = {
  flat: () => 0,
  rolling: (x, z) => 14 * Math.sin(x / 170) * Math.cos(z / 140) + 8 * Math.sin((x + z) / 260),
  slope: (x, z) => .14 * z,
  steps: (x, z) => 12 * Math.round(z / 110),
};
