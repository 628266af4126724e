// Foot placement, as in `feet`, `foot_lock` and `leg_reach` of `hobble.runtime`. It holds feet in contact where they landed, keeps feet out
// of the ground, and bends the legs so that they reach the feet. It changes the drawn pose of the character `c`. The
// network's foot is the foot where the network predicts it. Feet are numbered: 0 is the left one, 1 the right one. `k` has the constants of
// the Python runtime. The comments on them are in the three Python modules.
import { at3, at4, between, dot, minus, multiply, rotate } from "./math.js";

export const createFeet = (spec, c) => {
  const { constants: k } = spec, { atan2, sin, cos, hypot, min, max, abs, sqrt } = Math;

  // The drawn position of joint j. Writing to it moves the joint.
  const joint = (j) => c.posePosition.subarray(3 * j, 3 * j + 3);
  // How deep foot f is in the ground, cm; negative if it is above the ground. ground(x, z): height, cm.
  const soleDepth = (f, ground) => {
    const [heel, toe] = [2, 3].map((i) => {
      const [px, py, pz] = joint(spec.legs[f][i]);
      return ground(px, pz) + spec.sole[i - 2] - py;
    });
    return max(heel, toe);
  };
  // Raises or lowers the body so that standing feet are on the ground. The hips stay in the range of heights above the ground that they had in
  // training.
  const hips = spec.names.indexOf(spec.roles.hips);
  const carryBody = (ground) => {
    let wanted = 0, weight = 0;
    for (let f = 0; f < 2; f++) {
      const rise = soleDepth(f, ground), stands = min(max(c.contacts[2 * f], c.contacts[2 * f + 1], 0), 1);
      wanted += stands * (max(rise - k.bodyFree, 0) + min(rise + k.bodyFree, 0));
      weight += stands;
    }
    if (weight > k.bodyMinContact) c.bodyLift += k.bodyMix * (wanted / weight - c.bodyLift);
    const [hx, hy, hz] = joint(hips), above = hy - ground(hx, hz), [low, high] = spec.bounds.hips;
    c.bodyLift = min(max(c.bodyLift, low - above), high - above);
    for (let j = 1; j < c.posePosition.length; j += 3) c.posePosition[j] += c.bodyLift;
  };
  // Places foot f: decides where it is, bends its leg to reach it, and moves the joints of the foot.
  const placeFoot = (f, ground) => {
    const [hip, knee, heel, toe] = spec.legs[f], toePlace = joint(toe);
    const [shiftX, shiftZ] = holdFoot(f, toePlace), depth = soleDepth(f, ground);
    const rise = max(depth, 0) + (c.footStep[f] ? 0 : c.footLock[f] * min(depth + k.floating, 0));
    c.footLift[f] += min(max(k.heightMix * (rise - c.footLift[f]), -k.fastestLift), k.fastestLift);
    const shift = [shiftX, c.footLift[f], shiftZ];
    if (c.footStep[f]) {
      shift[1] += max(4 * k.stepHeight * c.footStep[f] * (1 - c.footStep[f]) - max(-depth, 0), 0);
      c.contacts[2 * f] = c.contacts[2 * f + 1] = 0;
    }
    const footTurn = c.footLock[f] > 0 ? raiseHeel(joint(hip), joint(knee), joint(heel), toePlace, shift) : [1, 0, 0, 0];
    const before = Array.from(joint(heel));
    bend(joint(hip), joint(knee), joint(heel), shift, hip, knee, c.footAdded[f], c.legShown[f]);
    carryFoot(f, before, footTurn);
    holdToesBack(f);
    c.legShown[f] = [knee, heel, toe].map((j) => { // heights are relative to the body, because the whole body may rise in a frame
      const [x, y, z] = joint(j);
      return [x, y - c.rootHeight - c.bodyLift, z];
    });
    // How far the held toe is from where it is to be held, cm.
    c.footMissed[f] = c.footLock[f] === 1 ? hypot(c.footHold[f][0] - toePlace[0], c.footHold[f][1] - toePlace[2]) : 0;
  };
  // Holds a foot from its landing until the network lifts it, or until the foot has to step because the network's foot is too far away. Returns
  // the shift [x, z] from the network's foot to the place of the foot. point: the toe of the network's foot.
  const holdFoot = (f, point) => {
    let away = [c.footHold[f][0] - point[0], c.footHold[f][1] - point[2]];
    if (!spec.footLocking) {
      c.footLock[f] = c.footStep[f] = 0;
      return [0, 0];
    }
    const far = hypot(...away);
    if (c.footLock[f] < 1 && far > k.tooFarAlone) { // a foot in the air stays near the network's foot
      away = away.map((v) => v * k.tooFarAlone / far);
      c.footHold[f] = [point[0] + away[0], point[2] + away[1]];
    }
    if (c.footStep[f] > 0 && (c.footStep[f] += 1 / k.stepFrames) > 1 - 1e-6) c.footStep[f] = c.footLock[f] = 0;
    if (c.footStep[f] === 0) {
      const alone = c.footLock[1 - f] !== 1; // the other foot is in the air
      if (c.contacts[2 * f + 1] < k.lockAt) c.footLock[f] = max(0, c.footLock[f] - k.release);
      else if (c.footLock[f] < 1) {
        away = limitShift(away.map((v) => v * c.footLock[f]), point, c.legShown[f][2]);
        c.footHold[f] = [point[0] + away[0], point[2] + away[1]];
        c.footLock[f] = 1;
      } else if (far >= (alone ? k.tooFarAlone : k.tooFar) || c.footMissed[f] > (alone ? k.missedAlone : k.missed)) c.footStep[f] = 1 / k.stepFrames;
    }
    if (c.footStep[f] > 0) c.footLock[f] = 1 - c.footStep[f] * c.footStep[f] * (3 - 2 * c.footStep[f]);
    return limitShift(away.map((v) => c.footLock[f] * v), point, c.legShown[f][2]);
  };
  // The shift `by` [x, z] of a toe from `point`, limited so that the toe is at most spec.bounds.fastest from `shown`, where it was last drawn.
  const limitShift = (by, point, shown) => {
    const to = [point[0] + by[0] - shown[0], point[2] + by[1] - shown[2]], share = spec.bounds.fastest / hypot(...to);
    return share >= 1 ? by : [shown[0] + share * to[0] - point[0], shown[2] + share * to[1] - point[2]];
  };
  // Moves a point toward `shown`, where it was last drawn, until it is at most spec.bounds.fastest away. Returns whether it was moved.
  const holdBack = (point, shown) => {
    const to = [point[0] - shown[0], point[1] - shown[1] - c.rootHeight - c.bodyLift, point[2] - shown[2]];
    const share = 1 - spec.bounds.fastest / hypot(...to);
    if (!(share > 0)) return false;
    for (let i = 0; i < 3; i++) point[i] -= share * to[i];
    return true;
  };
  // Limits how far a toe moves in a frame, and moves the joints below it along.
  const holdToesBack = (f) => {
    const toe = spec.legs[f][3], before = Array.from(joint(toe));
    if (!holdBack(joint(toe), c.legShown[f][2])) return;
    const moved = minus(joint(toe), before);
    for (const j of spec.toes[f]) if (j !== toe) for (let i = 0; i < 3; i++) c.posePosition[3 * j + i] += moved[i];
  };
  // If the leg of a held foot would stretch too far, its heel rises and `shift` changes. Returns the rotation of the foot about its toe.
  const raiseHeel = (hip, knee, heel, toe, shift) => {
    const noTurn = [1, 0, 0, 0], leg = minus(heel, hip);
    const whole = k.stretch * (hypot(...minus(knee, hip)) + hypot(...minus(heel, knee)));
    const aim = leg.map((v, i) => v + shift[i]), needed = dot(aim, aim), least = max(dot(leg, leg), whole * whole);
    const along = hypot(toe[0] - heel[0], toe[2] - heel[2]), high = heel[1] - toe[1];
    if (needed <= least || along < 1e-6) return noTurn;
    const fx = (toe[0] - heel[0]) / along, fz = (toe[2] - heel[2]) / along;
    const [wx, up, wz] = minus(toe, hip).map((v, i) => v + shift[i]), ahead = wx * fx + wz * fz;
    if (ahead >= 0) return noTurn;
    const most = least + max(1 + ahead / k.behind, 0) * (needed - least);
    // The heel is at (-along, high) from the toe. Find the angle about the toe at which the squared distance from hip to heel is `most`.
    const cosine = up * high - ahead * along, sine = ahead * high + up * along;
    const share = .5 * (most - wx * wx - up * up - wz * wz - along * along - high * high) / hypot(cosine, sine);
    const angle = min(max(atan2(sine, cosine) + Math.acos(min(max(share, -1), 1)), 0), k.mostAdded);
    const forward = along * (1 - cos(angle)) + high * sin(angle);
    shift[0] += forward * fx;
    shift[1] += along * sin(angle) - high * (1 - cos(angle));
    shift[2] += forward * fz;
    return [cos(angle / 2), sin(angle / 2) * fz, 0, -sin(angle / 2) * fx];
  };
  // Moves the joints below a heel that was at `before`. The foot is turned by the rotation `footTurn`. The toes keep their rotation.
  const carryFoot = (f, before, footTurn) => {
    const [, , heel, toe] = spec.legs[f], now = joint(heel);
    const place = (point) => rotate(footTurn, minus(point, before)).map((v, i) => v + now[i]);
    const moved = minus(place(joint(toe)), joint(toe));
    c.poseRotation.set(multiply(footTurn, at4(c.poseRotation, heel)), 4 * heel);
    for (const j of spec.carried[f]) {
      if (spec.toes[f].includes(j)) for (let i = 0; i < 3; i++) c.posePosition[3 * j + i] += moved[i];
      else {
        c.posePosition.set(place(joint(j)), 3 * j);
        c.poseRotation.set(multiply(footTurn, at4(c.poseRotation, j)), 4 * j);
      }
    }
  };
  // Turns the rotation `held` toward the rotation `aim`, by at most k.mostAdded. Returns true if it does not reach `aim`.
  const approach = (held, aim) => {
    const near = held[0] * aim[0] + held[1] * aim[1] + held[2] * aim[2] + held[3] * aim[3], to = near < 0 ? aim.map((v) => -v) : aim;
    const whole = Math.acos(min(abs(near), 1)), most = .5 * k.mostAdded, late = whole > most;
    const [keep, take] = late ? [sin(whole - most) / sin(whole), sin(most) / sin(whole)] : [0, 1];
    for (let i = 0; i < 4; i++) held[i] = keep * held[i] + take * to[i];
    return late;
  };
  // Like `reach`, but the rotations `added` to thigh and shank change by at most k.mostAdded in a frame, and knee and heel move by a limited
  // distance. hip, knee, heel: their positions. hipJoint, kneeJoint: which joints hip and knee are. shown: knee and heel as last drawn.
  const bend = (hip, knee, heel, shift, hipJoint, kneeJoint, added, shown) => {
    const thigh = minus(knee, hip), shank = minus(heel, knee);
    reach(hip, knee, heel, shift, rotate(at4(c.poseRotation, hipJoint), spec.ahead));
    const limited = [[thigh, minus(knee, hip)], [shank, minus(heel, knee)]].map(([a, b], i) => approach(added[i], between(a, b)));
    if (limited[0] || limited[1]) {
      const [t, s] = [rotate(added[0], thigh), rotate(added[1], shank)];
      for (let i = 0; i < 3; i++) {
        knee[i] = hip[i] + t[i];
        heel[i] = knee[i] + s[i];
      }
    }
    const held = [holdBack(knee, shown[0]), holdBack(heel, shown[1])];
    if (held[0] || held[1]) {
      added[0] = between(thigh, minus(knee, hip));
      added[1] = between(shank, minus(heel, knee));
    }
    c.poseRotation.set(multiply(added[0], at4(c.poseRotation, hipJoint)), 4 * hipJoint);
    c.poseRotation.set(multiply(added[1], at4(c.poseRotation, kneeJoint)), 4 * kneeJoint);
  };
  // Moves the heel by `shift`, and the knee so that thigh and shank keep their lengths (law of cosines). ahead: the direction in which a
  // straight knee bends.
  const reach = (hip, knee, heel, shift, ahead) => {
    const thigh = minus(knee, hip), shank = minus(heel, knee);
    const upper = hypot(...thigh), lower = hypot(...shank);
    const leg = thigh.map((v, i) => v + shank[i]), before = hypot(...leg);
    const aim = leg.map((v, i) => v + shift[i]), distance = hypot(...aim);
    if (min(before, distance, upper, lower) < 1e-6) return;
    const oldWay = leg.map((v) => v / before), newWay = aim.map((v) => v / distance);
    const length = min(max(distance, abs(upper - lower) * 1.001 + 1e-6), (upper + lower) * .999);
    const cosine = min(max((upper * upper + length * length - lower * lower) / (2 * upper * length), -1), 1);
    // The knee is at least k.kneeAhead (cm) in front of the line from hip to heel. The direction in which it bends turns with the leg.
    const along = dot(thigh, oldWay), front = dot(ahead, oldWay), forward = ahead.map((v, i) => v - front * oldWay[i]);
    const forwardSize = max(hypot(...forward), 1e-6);
    let side = thigh.map((v, i) => v - along * oldWay[i]);
    const more = max(k.kneeAhead - dot(side, forward) / forwardSize, 0);
    if (more === 0 && abs(shift[0]) + abs(shift[1]) + abs(shift[2]) < 1e-9) return;
    side = side.map((v, i) => v + more * forward[i] / forwardSize);
    const factor = dot(side, newWay) / max(1 + dot(oldWay, newWay), 1e-6);
    const bendWay = side.map((v, i) => v - factor * (oldWay[i] + newWay[i])), size = hypot(...bendWay);
    if (size < 1e-6) return;
    const sine = sqrt(1 - cosine * cosine) / size;
    for (let i = 0; i < 3; i++) {
      knee[i] = hip[i] + upper * (newWay[i] * cosine + bendWay[i] * sine);
      heel[i] = hip[i] + newWay[i] * length;
    }
  };

  return { carryBody, placeFoot };
};

// Places joints on bones of constant length, from predicted rotations. Legs are bent so that the toes are where the network predicted them.
// `hobble.runtime.export.restore_bone_lengths` in Python computes the same.

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
