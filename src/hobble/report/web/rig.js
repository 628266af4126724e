// Places joints on bones of constant length, from predicted rotations. Legs are bent so that the toes are where the network predicted them.
// `hobble.runtime.export.restore_bone_lengths` in Python computes the same.
import { dot, minus } from "./numbers.js";
import { at3, at4, between, multiply } from "./turns.js";

// take(places, turns): sets the rig from the predicted world positions and rotations of all joints.
export const createRig = ({ parents, offsets, legs }) => {
  const J = parents.length, rig = { places: new Float64Array(3 * J), turns: new Float64Array(4 * J) };
  const root = parents.findIndex((p) => p < 0);

  // Places all joints but the root, each from its parent's position and rotation.
  const placeJoints = () => {
    const { places: p, turns: q } = rig;
    for (let j = 0; j < J; j++) {
      if (j === root) continue;
      const a = parents[j], [w, x, y, z] = [q[4 * a], q[4 * a + 1], q[4 * a + 2], q[4 * a + 3]], [u, v, s] = offsets[j];
      const tx = 2 * (y * s - z * v), ty = 2 * (z * u - x * s), tz = 2 * (x * v - y * u);
      p[3 * j] = p[3 * a] + u + w * tx + y * tz - z * ty;
      p[3 * j + 1] = p[3 * a + 1] + v + w * ty + z * tx - x * tz;
      p[3 * j + 2] = p[3 * a + 2] + s + w * tz + x * ty - y * tx;
    }
  };
  // Turns joint j by the rotation from direction `from` to direction `to`.
  const turnJoint = (j, from, to) => rig.turns.set(multiply(between(from, to), at4(rig.turns, j)), 4 * j);
  // Turns thigh and shank so that the toe comes to its position in `wanted` (law of cosines).
  const bendLeg = ([hip, knee, heel, toe], wanted) => {
    const p = rig.places, [hipPlace, kneePlace, heelPlace] = [at3(p, hip), at3(p, knee), at3(p, heel)];
    const goal = heelPlace.map((v, i) => v + wanted[3 * toe + i] - p[3 * toe + i]);
    const thigh = minus(kneePlace, hipPlace), shank = minus(heelPlace, kneePlace), upper = Math.hypot(...thigh), lower = Math.hypot(...shank);
    const leg = minus(goal, hipPlace), size = Math.max(Math.hypot(...leg), 1e-9), along = leg.map((v) => v / size);
    const distance = Math.min(Math.max(size, Math.abs(upper - lower) * 1.001 + 1e-6), (upper + lower) * .999);
    const cosine = Math.min(1, Math.max(-1, (upper * upper + distance * distance - lower * lower) / (2 * upper * distance)));
    const ahead = dot(thigh, along), out = thigh.map((v, i) => v - ahead * along[i]), wide = Math.max(Math.hypot(...out), 1e-9);
    const sine = Math.sqrt(1 - cosine * cosine);
    const bent = along.map((v, i) => upper * (v * cosine + out[i] / wide * sine)), end = along.map((v) => v * distance);
    turnJoint(hip, thigh, bent);
    turnJoint(knee, shank, minus(end, bent));
  };
  rig.take = (places, turns) => {
    rig.turns.set(turns);
    for (let i = 0; i < 3; i++) rig.places[3 * root + i] = places[3 * root + i];
    placeJoints();
    for (const leg of legs) bendLeg(leg, places);
    placeJoints();
    return rig;
  };
  return rig;
};
