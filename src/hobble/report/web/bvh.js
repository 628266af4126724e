// Writes the played motion as a BVH file.
import { at4, conjugate, multiply } from "./turns.js";

const FPS = 60;

// Angles [z, x, y] in degrees with rotation = Rz Rx Ry.
const angles = ([w, x, y, z]) => {
  const degrees = 180 / Math.PI, sine = Math.min(1, Math.max(-1, 2 * (y * z + w * x)));
  return [
    Math.atan2(-2 * (x * y - w * z), 1 - 2 * (x * x + z * z)), Math.asin(sine),
    Math.atan2(-2 * (x * z - w * y), 1 - 2 * (x * x + y * y)),
  ].map((a) => a * degrees);
};

// spec: `names`, `parents` and `offsets` of the joints. frames: place of the root, then world rotations of all joints.
export const bvh = ({ names, parents, offsets }, frames) => {
  const children = names.map((_, j) => parents.flatMap((p, k) => (p === j ? [k] : []))), header = [], order = [];
  const joint = (j, indent) => {
    const pad = "\t".repeat(indent), root = parents[j] < 0;
    order.push(j);
    header.push(`${pad}${root ? "ROOT" : "JOINT"} ${names[j]}`, `${pad}{`, `${pad}\tOFFSET ${(root ? [0, 0, 0] : offsets[j]).map((v) => v.toFixed(6)).join(" ")}`);
    header.push(`${pad}\tCHANNELS ${root ? "6 Xposition Yposition Zposition" : "3"} Zrotation Xrotation Yrotation`);
    children[j].forEach((k) => joint(k, indent + 1));
    if (!children[j].length) header.push(`${pad}\tEnd Site`, `${pad}\t{`, `${pad}\t\tOFFSET 0 0 0`, `${pad}\t}`);
    header.push(`${pad}}`);
  };
  joint(parents.findIndex((p) => p < 0), 0);
  const lines = frames.map((frame) => {
    const turns = frame.slice(3), numbers = Array.from(frame.slice(0, 3), (v) => v.toFixed(4));
    for (const j of order) {
      const own = at4(turns, j), local = parents[j] < 0 ? own : multiply(conjugate(at4(turns, parents[j])), own);
      numbers.push(...angles(local).map((v) => v.toFixed(4)));
    }
    return numbers.join(" ");
  });
  return `HIERARCHY\n${header.join("\n")}\nMOTION\nFrames: ${frames.length}\nFrame Time: ${(1 / FPS).toFixed(7)}\n${lines.join("\n")}\n`;
};
