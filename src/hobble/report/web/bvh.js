// What was played as a BVH file. The page knows places of joints and no rotations, so each joint is turned to where its
// children are: by the shortest way where it has one, by the best fit where it has several.
import { cross, dot, minus, unit } from "./numbers.js";

const FPS = 60, TINY = 1e-6;

// Quaternions, w first.
const multiply = ([a, b, c, d], [e, f, g, h]) => [
  a * e - b * f - c * g - d * h, a * f + b * e + c * h - d * g, a * g - b * h + c * e + d * f, a * h + b * g - c * f + d * e,
];
const rotate = (q, v) => {
  const axis = q.slice(1), t = cross(axis, v).map((x) => 2 * x), more = cross(axis, t);
  return v.map((x, i) => x + q[0] * t[i] + more[i]);
};
const conjugate = ([w, x, y, z]) => [w, -x, -y, -z];
const normal = (q) => { const n = Math.hypot(...q) || 1; return q.map((v) => v / n); };
const between = (a, b) => {
  const [u, v] = [unit(a), unit(b)], c = dot(u, v);
  if (c < -.9999) return normal([0, ...(Math.abs(u[0]) < .9 ? cross(u, [1, 0, 0]) : cross(u, [0, 1, 0]))]);
  return normal([1 + c, ...cross(u, v)]);
};
// The rotation that brings `rest` vectors nearest to `now` (Horn 1987), by power iteration from a first guess.
const fitted = (rest, now, guess) => {
  const s = [0, 1, 2].map((i) => [0, 1, 2].map((j) => rest.reduce((sum, r, k) => sum + r[i] * now[k][j], 0)));
  const [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = s, size = rest.reduce((sum, r, k) => sum + Math.hypot(...r) * Math.hypot(...now[k]), 0);
  const n = [
    [xx + yy + zz, yz - zy, zx - xz, xy - yx], [yz - zy, xx - yy - zz, xy + yx, zx + xz],
    [zx - xz, xy + yx, yy - xx - zz, yz + zy], [xy - yx, zx + xz, yz + zy, zz - xx - yy],
  ];
  let q = guess;
  for (let turn = 0; turn < 40; turn++) q = normal(n.map((row, i) => row.reduce((sum, v, j) => sum + v * q[j], size * q[i])));
  return q;
};
// Angles [z, x, y] in degrees with rotation = Rz Rx Ry.
const angles = ([w, x, y, z]) => {
  const degrees = 180 / Math.PI, sine = Math.min(1, Math.max(-1, 2 * (y * z + w * x)));
  return [
    Math.atan2(-2 * (x * y - w * z), 1 - 2 * (x * x + z * z)), Math.asin(sine),
    Math.atan2(-2 * (x * z - w * y), 1 - 2 * (x * x + y * y)),
  ].map((a) => a * degrees);
};

// spec: `names`, `parents` and `offsets` of its joints; frames: places of all joints, 3 numbers each.
export const bvh = ({ names, parents, offsets }, frames) => {
  const place = (frame, j) => [frame[3 * j], frame[3 * j + 1], frame[3 * j + 2]];
  const children = names.map((_, j) => parents.flatMap((p, k) => (p === j ? [k] : [])));
  // Bones as long as they were on average.
  const bones = offsets.map((offset, j) => {
    const length = Math.hypot(...offset), p = parents[j];
    if (p < 0 || length < TINY || !frames.length) return offset;
    const mean = frames.reduce((sum, f) => sum + Math.hypot(...minus(place(f, j), place(f, p))), 0) / frames.length;
    return offset.map((v) => v * mean / length);
  });
  // The nearest joints below one that lie apart from it, with their rest vectors.
  const below = (j) => children[j].flatMap((k) => (Math.hypot(...bones[k]) > .1 ? [[k, bones[k]]] : below(k)));
  const reaches = names.map((_, j) => below(j));

  const header = [];
  const joint = (j, indent) => {
    const pad = "\t".repeat(indent), root = parents[j] < 0;
    header.push(`${pad}${root ? "ROOT" : "JOINT"} ${names[j]}`, `${pad}{`, `${pad}\tOFFSET ${(root ? [0, 0, 0] : bones[j]).map((v) => v.toFixed(6)).join(" ")}`);
    header.push(`${pad}\tCHANNELS ${root ? "6 Xposition Yposition Zposition" : "3"} Zrotation Xrotation Yrotation`);
    children[j].forEach((k) => joint(k, indent + 1));
    if (!children[j].length) header.push(`${pad}\tEnd Site`, `${pad}\t{`, `${pad}\t\tOFFSET 0 0 0`, `${pad}\t}`);
    header.push(`${pad}}`);
  };
  const root = parents.findIndex((p) => p < 0), order = [];
  const visit = (j) => { order.push(j); children[j].forEach(visit); };
  visit(root);
  joint(root, 0);

  const world = names.map(() => [1, 0, 0, 0]);
  const lines = frames.map((frame) => {
    const numbers = place(frame, root).map((v) => v.toFixed(4));
    for (const j of order) {
      const above = parents[j] < 0 ? [1, 0, 0, 0] : world[parents[j]];
      const now = reaches[j].map(([k]) => minus(place(frame, k), place(frame, j))), rest = reaches[j].map(([, v]) => v);
      if (!rest.length) world[j] = above;
      else if (rest.length === 1) world[j] = multiply(between(rotate(above, rest[0]), now[0]), above);
      else world[j] = fitted(rest, now, world[j]);
      numbers.push(...angles(multiply(conjugate(above), world[j])).map((v) => v.toFixed(4)));
    }
    return numbers.join(" ");
  });
  return `HIERARCHY\n${header.join("\n")}\nMOTION\nFrames: ${frames.length}\nFrame Time: ${(1 / FPS).toFixed(7)}\n${lines.join("\n")}\n`;
};
