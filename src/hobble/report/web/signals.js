// Computes curves of a walking body over time, for the recogniser. `hobble.gait.cycles` in Python does the same. Units are degrees and leg
// lengths. Angles are relative to the vertical and to the direction of travel.
import { cross, dot, minus } from "./numbers.js";

export const SIDES = ["L", "R"];
const SIDE_NAMES = { L: "left", R: "right" };
export const LIMBS = ["hip_flexion", "hip_abduction", "knee_flexion", "ankle_height", "ankle_forward", "arm_forward"];
export const MIDDLE = ["trunk_forward", "trunk_left", "pelvis_left_up"];
export const SIGN_CHANGES = ["trunk_left", "pelvis_left_up"]; // curves whose sign changes if the walk is mirrored
const TRAVEL_SECONDS = .5; // sigma of the Gaussian that smooths the velocity of the hips, which gives the direction of travel

// The angle in degrees from the two sides of a right triangle: opposite, adjacent.
const angle = (a, b) => Math.atan2(a, b) * 180 / Math.PI;
// The vector of length 1 in the direction of v.
const normalised = (v, least = 1e-9) => { const n = Math.max(Math.hypot(...v), least); return v.map((x) => x / n); };
export const median = (values) => {
  const sorted = [...values].sort((a, b) => a - b), n = sorted.length;
  return n % 2 ? sorted[(n - 1) / 2] : (sorted[n / 2 - 1] + sorted[n / 2]) / 2;
};

// Smooths vectors of three over frames with a Gaussian of `sigma` frames, cut off at 4 sigma. Past the ends, the first and last vector repeat.
export const gaussian = (rows, sigma) => {
  const reach = Math.floor(4 * sigma + .5), n = rows.length, padded = new Float64Array(3 * (n + 2 * reach)), weights = new Float64Array(2 * reach + 1);
  let whole = 0;
  for (let i = -reach; i <= reach; i++) whole += weights[i + reach] = Math.exp(-.5 * (i / sigma) ** 2);
  for (let i = 0; i < n + 2 * reach; i++) padded.set(rows[Math.min(n - 1, Math.max(0, i - reach))], 3 * i);
  return rows.map((_, f) => {
    let x = 0, y = 0, z = 0;
    for (let i = 0, k = 3 * f; i < weights.length; i++, k += 3) {
      const w = weights[i];
      x += w * padded[k];
      y += w * padded[k + 1];
      z += w * padded[k + 2];
    }
    return [x / whole, y / whole, z / whole];
  });
};

// The change per frame: half the difference of the frames before and after. At the ends, the difference of the last two frames there.
const gradient = (rows) => rows.map((row, f) => {
  const a = Math.max(0, f - 1), b = Math.min(rows.length - 1, f + 1);
  return row.map((_, k) => (rows[b][k] - rows[a][k]) / (b - a));
});

// Degrees by which the joint at b is bent between a and c. 0 is straight.
const bendAngle = (a, b, c) => {
  const u = minus(b, a), v = minus(c, b);
  return angle(Math.hypot(...cross(u, v)), dot(u, v));
};

// spec: has `names` (of joints) and `roles` (role -> joint). frames: the positions of all joints (3 J) of each frame, cm, Y up.
// In the result, leg: leg length, cm. curves: name -> value in each frame. heading: direction of travel, degrees. ahead: cosine of the angle
// between facing and travel. hips: path [x, z]. ankleSpeed: of each side, leg lengths a second. across: how far each ankle is to the left of
// the hips.
export const signals = (spec, frames, fps = 60) => {
  const joint = (role) => spec.names.indexOf(spec.roles[role]);
  const at = Object.fromEntries(Object.keys(spec.roles).map((role) => {
    const j = 3 * joint(role);
    return [role, frames.map((p) => [p[j], p[j + 1], p[j + 2]])];
  }));
  const ahead = gaussian(gradient(at.hips), TRAVEL_SECONDS * fps).map(([x, , z]) => normalised([x, 0, z]));
  const left = ahead.map((a) => cross([0, 1, 0], a));
  const bone = (a, b) => median(at[a].map((p, f) => Math.hypot(...minus(p, at[b][f]))));
  const leg = ["left", "right"].reduce((sum, side) => sum + bone(`${side}_hip`, `${side}_knee`) + bone(`${side}_knee`, `${side}_heel`), 0) / 2;
  const trunkTop = ["neck", "chest", "head"].find((role) => role in spec.roles);
  const curves = {}, frameNumbers = frames.map((_, f) => f);
  for (const side of SIDES) {
    const limb = (part) => at[`${SIDE_NAMES[side]}_${part}`], out = side === "L" ? left : left.map((v) => v.map((x) => -x));
    const hand = limb("elbow") || limb("wrist"), thigh = frameNumbers.map((f) => minus(limb("knee")[f], limb("hip")[f]));
    Object.assign(curves, {
      [`hip_flexion_${side}`]: frameNumbers.map((f) => angle(dot(thigh[f], ahead[f]), -thigh[f][1])),
      [`hip_abduction_${side}`]: frameNumbers.map((f) => angle(dot(thigh[f], out[f]), -thigh[f][1])),
      [`knee_flexion_${side}`]: frameNumbers.map((f) => bendAngle(limb("hip")[f], limb("knee")[f], limb("heel")[f])),
      [`ankle_height_${side}`]: frameNumbers.map((f) => limb("heel")[f][1] / leg),
      [`ankle_forward_${side}`]: frameNumbers.map((f) => dot(minus(limb("heel")[f], at.hips[f]), ahead[f]) / leg),
      [`arm_forward_${side}`]: frameNumbers.map((f) => {
        if (!hand) return 0;
        const arm = minus(hand[f], limb("shoulder")[f]);
        return angle(dot(arm, ahead[f]), -arm[1]);
      }),
    });
  }
  const trunk = frameNumbers.map((f) => minus(at[trunkTop][f], at.hips[f]));
  const pelvis = frameNumbers.map((f) => minus(at.left_hip[f], at.right_hip[f])), shoulders = frameNumbers.map((f) => minus(at.left_shoulder[f], at.right_shoulder[f]));
  curves.trunk_forward = frameNumbers.map((f) => angle(dot(trunk[f], ahead[f]), trunk[f][1]));
  curves.trunk_left = frameNumbers.map((f) => angle(dot(trunk[f], left[f]), trunk[f][1]));
  curves.pelvis_left_up = frameNumbers.map((f) => angle(pelvis[f][1], Math.hypot(dot(pelvis[f], left[f]), dot(pelvis[f], ahead[f]))));
  const across = frameNumbers.map((f) => { const [a, b] = [normalised(pelvis[f]), normalised(shoulders[f])]; return a.map((v, i) => v + b[i]); });
  const facing = gaussian(across.map((v) => cross(v, [0, 1, 0])), TRAVEL_SECONDS * fps).map((v) => normalised(v));
  const speed = (points) => gradient(points).map(([x, , z]) => Math.hypot(x, z) * fps / leg);
  return {
    fps, leg, curves,
    heading: unwrapped(ahead.map(([x, , z]) => Math.atan2(x, z))).map((v) => v * 180 / Math.PI),
    ahead: frameNumbers.map((f) => dot(facing[f], ahead[f])),
    hips: at.hips.map(([x, , z]) => [x / leg, z / leg]),
    ankleSpeed: Object.fromEntries(SIDES.map((side) => [side, speed(at[`${SIDE_NAMES[side]}_heel`])])),
    across: Object.fromEntries(SIDES.map((side) => [side, frameNumbers.map((f) => dot(minus(at[`${SIDE_NAMES[side]}_heel`][f], at.hips[f]), left[f]) / leg)])),
  };
};

// The same angles (radians), without jumps of a whole turn.
const unwrapped = (angles) => {
  let turns = 0;
  return angles.map((angle, i) => {
    if (i) turns -= Math.round((angle - angles[i - 1]) / (2 * Math.PI));
    return angle + 2 * Math.PI * turns;
  });
};

// The signals of the mirrored walk: left and right are swapped.
export const mirroredSignals = (walk) => {
  const curves = {}, other = { L: "R", R: "L" };
  for (const limb of LIMBS) for (const side of SIDES) curves[`${limb}_${side}`] = walk.curves[`${limb}_${other[side]}`];
  for (const name of MIDDLE) curves[name] = SIGN_CHANGES.includes(name) ? walk.curves[name].map((v) => -v) : walk.curves[name];
  return {
    ...walk, curves,
    heading: walk.heading.map((v) => -v),
    hips: walk.hips.map(([x, z]) => [-x, z]),
    ankleSpeed: { L: walk.ankleSpeed.R, R: walk.ankleSpeed.L },
    across: { L: walk.across.R.map((v) => -v), R: walk.across.L.map((v) => -v) },
  };
};
