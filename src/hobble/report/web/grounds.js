// The grounds in Play. height(x, z): height in cm. tile: only for grounds of level tiles, which are drawn with vertical edges. It is the size
// [x, z] of a tile in cm, with 0 for an unlimited size.
const randomOfTile = (i, k) => { // a random number from 0 to 1, always the same for the tile (i, k)
  const n = Math.sin(12.9898 * i + 78.233 * k) * 43758.5453;
  return n - Math.floor(n);
};
// About a quarter of the tiles are boxes, 6 to 28 cm high. There are none where the character starts.
const boxHeight = (x, z) => {
  const i = Math.round(x / 80), k = Math.round(z / 80);
  if (Math.abs(i) <= 1 && Math.abs(k) <= 1) return 0;
  const random = randomOfTile(i, k);
  return random > .72 ? 6 + 22 * (random - .72) / .28 : 0;
};

export const GROUNDS = new Map(Object.entries({
  flat: { height: () => 0 },
  rolling: { height: (x, z) => 14 * Math.sin(x / 170) * Math.cos(z / 140) + 8 * Math.sin((x + z) / 260) },
  slope: { height: (x, z) => .14 * z },
  steps: { height: (x, z) => 12 * Math.round(z / 110), tile: [0, 110] },
  boxes: { height: boxHeight, tile: [80, 80] },
}));
