// The grounds in Play. height(x, z): cm. Grounds with `tile` consist of level tiles of this size in cm along x and z (0: unlimited)
// and are drawn with vertical edges.
const scattered = (i, k) => { // a random number from 0 to 1, always the same for a tile
  const n = Math.sin(12.9898 * i + 78.233 * k) * 43758.5453;
  return n - Math.floor(n);
};
const box = (x, z) => {
  const i = Math.round(x / 80), k = Math.round(z / 80);
  if (Math.abs(i) <= 1 && Math.abs(k) <= 1) return 0;
  const much = scattered(i, k);
  return much > .72 ? 6 + 22 * (much - .72) / .28 : 0;
};

export const GROUNDS = new Map(Object.entries({
  flat: { height: () => 0 },
  rolling: { height: (x, z) => 14 * Math.sin(x / 170) * Math.cos(z / 140) + 8 * Math.sin((x + z) / 260) },
  slope: { height: (x, z) => .14 * z },
  steps: { height: (x, z) => 12 * Math.round(z / 110), tile: [0, 110] },
  boxes: { height: box, tile: [80, 80] },
}));
