// Writes the played motion as a BVH file.
import { at4, conjugate, multiply } from "./turns.js";

const FPS = 60;

// The angles [z, x, y] of a rotation, in degrees: it is first turned about Y, then about X, then about Z (Rz Rx Ry).
const angles = ([w, x, y, z]) => {
  const degrees = 180 / Math.PI, sine = Math.min(1, Math.max(-1, 2 * (y * z + w * x)));
  return [
    Math.atan2(-2 * (x * y - w * z), 1 - 2 * (x * x + z * z)), Math.asin(sine),
    Math.atan2(-2 * (x * z - w * y), 1 - 2 * (x * x + y * y)),
  ].map((a) => a * degrees);
};

// The text of a BVH file. names, parents, offsets: of the joints. frames: an array for each frame. It has the position of the root (3
// numbers, cm) and then the world rotations of all joints (4 numbers each).
export const bvhText = ({ names, parents, offsets }, frames) => {
  const children = names.map((_, j) => parents.flatMap((p, k) => (p === j ? [k] : []))), header = [], joints = [];
  const addJoint = (j, indent) => {
    const pad = "\t".repeat(indent), root = parents[j] < 0;
    joints.push(j);
    header.push(`${pad}${root ? "ROOT" : "JOINT"} ${names[j]}`, `${pad}{`, `${pad}\tOFFSET ${(root ? [0, 0, 0] : offsets[j]).map((v) => v.toFixed(6)).join(" ")}`);
    header.push(`${pad}\tCHANNELS ${root ? "6 Xposition Yposition Zposition" : "3"} Zrotation Xrotation Yrotation`);
    children[j].forEach((k) => addJoint(k, indent + 1));
    if (!children[j].length) header.push(`${pad}\tEnd Site`, `${pad}\t{`, `${pad}\t\tOFFSET 0 0 0`, `${pad}\t}`);
    header.push(`${pad}}`);
  };
  addJoint(parents.findIndex((p) => p < 0), 0);
  const lines = frames.map((frame) => {
    const rotations = frame.slice(3), numbers = Array.from(frame.slice(0, 3), (v) => v.toFixed(4));
    for (const j of joints) {
      const world = at4(rotations, j), local = parents[j] < 0 ? world : multiply(conjugate(at4(rotations, parents[j])), world);
      numbers.push(...angles(local).map((v) => v.toFixed(4)));
    }
    return numbers.join(" ");
  });
  return `HIERARCHY\n${header.join("\n")}\nMOTION\nFrames: ${frames.length}\nFrame Time: ${(1 / FPS).toFixed(7)}\n${lines.join("\n")}\n`;
};
