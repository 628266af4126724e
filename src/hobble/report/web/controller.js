// The state of one character. It starts in the pose of a frame of the clips. Fields and units are those of `hobble.runtime.character` and
// `hobble.runtime.controller`, with names in camel case. The path has an entry for each frame: px, pz (position) and dx, dz (direction).
import { networks } from "networks"; // kind -> createNetwork; made by `bundle.networks_module` from the folders of hobble.models
import { createFeet } from "./feet.js";
import { bytes } from "../../models/layers.js";
import { at3, at4, multiply, wrap } from "./math.js";

// Returns a function (c) that sets the rotations to draw to those that the network predicted. The network predicts no rotations of joints
// that move no part of the body, so such a joint gets the rotation of its parent.
export const createDrawnTurns = (spec) => {
  const still = spec.parents.flatMap((p, j) => (p < 0 || spec.turning.includes(j) ? [] : [[j, p]]));
  return (c) => {
    c.poseRotation.set(c.jointRotation);
    for (const [j, p] of still) for (let i = 0; i < 4; i++) c.poseRotation[4 * j + i] = c.poseRotation[4 * p + i];
  };
};

// place: [x, z] in cm, and heading: yaw in radians, where the character starts. T: entries of the path. S: samples of it that the network gets.
export const createState = (spec, place, heading) => {
  const { joints: J, step, gaits } = spec, T = 2 * spec.window, S = T / step, { sin, cos } = Math;
  const filled = (n, value = 0) => new Float64Array(n).fill(value);
  const atStart = spec.channels.flatMap(({ columns, start, scale }) => columns.map(() => start / scale));
  const c = {
    px: filled(T, place[0]), pz: filled(T, place[1]), dx: filled(T, sin(heading)), dz: filled(T, cos(heading)),
    gait: filled(T * gaits.length), ground: filled(S * 3), rootHeight: 0, phase: 0, root: [place[0], 0, place[1]], placed: false,
    jointPosition: filled(3 * J), jointVelocity: filled(3 * J), jointRotation: filled(4 * J),
    posePosition: filled(3 * J), poseRotation: filled(4 * J),
    channelValues: Float64Array.from(atStart), channelTargets: Float64Array.from(atStart), memory: filled(spec.network.memory ?? 0),
    smoothedVelocity: [0, 0], smoothedDirection: [sin(heading), cos(heading)], strafe: 0, correction: [0, 0],
    footLock: [0, 0], footHold: [[0, 0], [0, 0]], footStep: [0, 0], footMissed: [0, 0], footLift: [0, 0], bodyLift: 0,
    footAdded: [0, 1].map(() => [[1, 0, 0, 0], [1, 0, 0, 0]]), legShown: [], contacts: [0, 0, 0, 0],
  };
  startInClip(spec, c, place, heading);
  return c;
};

// Sets path, gait, phase and pose of `c` to those of spec.start, turned by `heading` and moved to `place`.
const startInClip = (spec, c, place, heading) => {
  const T = 2 * spec.window, J = spec.joints, { sin, cos } = Math;
  const startArray = (name) => new Float32Array(bytes(spec.start[name])), [si, co] = [sin(heading), cos(heading)];
  const [path, ahead, joints, velocities] = ["position", "direction", "joint_position", "joint_velocity"].map(startArray);
  for (let t = 0; t < T; t++) {
    c.px[t] = path[2 * t] * co + path[2 * t + 1] * si + place[0];
    c.pz[t] = path[2 * t + 1] * co - path[2 * t] * si + place[1];
    c.dx[t] = ahead[2 * t] * co + ahead[2 * t + 1] * si;
    c.dz[t] = ahead[2 * t + 1] * co - ahead[2 * t] * si;
  }
  for (let j = 0; j < 3 * J; j += 3) for (const [from, to, a, b] of [[joints, c.jointPosition, ...place], [velocities, c.jointVelocity, 0, 0]]) {
    to[j] = from[j] * co + from[j + 2] * si + a;
    to[j + 1] = from[j + 1];
    to[j + 2] = from[j + 2] * co - from[j] * si + b;
  }
  c.gait.set(startArray("gait"));
  c.phase = spec.start.phase;
  c.posePosition.set(c.jointPosition);
  c.legShown = spec.legs.map(([, ...below]) => below.map((j) => at3(c.jointPosition, j)));
  const rotations = startArray("joint_rotation"), facing = [cos(heading / 2), 0, sin(heading / 2), 0];
  for (let j = 0; j < J; j++) c.jointRotation.set(multiply(facing, at4(rotations, j)), 4 * j);
  createDrawnTurns(spec)(c);
};

// Writes the state of a character into the network's input row X, and turns the output row Y into its next pose.

// X, Y: the first column of each block of the rows. J joints, G gaits. The path has an entry for each frame, and M is the entry of the present.
// The network gets S samples of the path, `step` frames apart. k: the constants of the Python runtime. c: the state.
export const createRows = (spec, c) => {
  const { joints: J, step, x: X, y: Y, gaits, constants: k } = spec, M = spec.window, S = 2 * M / step, G = gaits.length;
  const { atan2, sin, cos, acos, hypot, min, max, abs } = Math, setDrawnTurns = createDrawnTurns(spec);
  // The index in X of each channel column.
  const channelColumns = spec.channels.flatMap((channel) => channel.columns.map((_, l) => X[channel.name] + l));

  // Writes the input row x. Positions and directions are relative to the root: the path now, the joints in the last frame.
  const writeInputs = (x) => {
    let [px, pz, co, si] = [c.px[M], c.pz[M], c.dz[M], c.dx[M]];
    for (let s = 0; s < S; s++) {
      const i = s * step, a = c.px[i] - px, b = c.pz[i] - pz;
      x[X.position + s] = a * co - b * si;
      x[X.position + S + s] = a * si + b * co;
      x[X.direction + s] = c.dx[i] * co - c.dz[i] * si;
      x[X.direction + S + s] = c.dx[i] * si + c.dz[i] * co;
      for (let g = 0; g < G; g++) x[X.gait + g * S + s] = c.gait[i * G + g];
      for (let side = 0; side < 3; side++) x[X.terrain + side * S + s] = c.ground[3 * s + side] - c.rootHeight;
    }
    [px, pz, co, si] = [c.px[M - 1], c.pz[M - 1], c.dz[M - 1], c.dx[M - 1]];
    for (let j = 0; j < 3 * J; j += 3) {
      const a = c.jointPosition[j] - px, b = c.jointPosition[j + 2] - pz, p = X.joint_position + j, v = X.joint_velocity + j;
      x[p] = a * co - b * si;
      x[p + 1] = c.jointPosition[j + 1] - c.rootHeight;
      x[p + 2] = a * si + b * co;
      x[v] = c.jointVelocity[j] * co - c.jointVelocity[j + 2] * si;
      x[v + 1] = c.jointVelocity[j + 1];
      x[v + 2] = c.jointVelocity[j] * si + c.jointVelocity[j + 2] * co;
    }
    channelColumns.forEach((at, l) => { x[at] = c.channelValues[l]; });
  };

  // The new position of a joint is the mean of two: its predicted position, and its old position plus its predicted velocity. It moves by at most
  // spec.bounds.fastest. `climbed`, by how much the ground rose, does not count.
  const moveJoints = (y) => {
    const si = c.dx[M], co = c.dz[M];
    const climbed = c.rootHeight - c.root[1];
    c.bodyLift += min(max(climbed, -k.mostClimb), k.mostClimb) - climbed;
    c.root = [c.px[M], c.rootHeight, c.pz[M]];
    for (let j = 0; j < 3 * J; j += 3) {
      const p = Y.joint_position + j, v = Y.joint_velocity + j;
      const velocity = [y[v] * co + y[v + 2] * si, y[v + 1], y[v + 2] * co - y[v] * si];
      const point = [y[p] * co + y[p + 2] * si + c.root[0], y[p + 1] + c.root[1], y[p + 2] * co - y[p] * si + c.root[2]];
      const movement = point.map((v, i) => .5 * (c.jointPosition[j + i] + velocity[i] + v) - c.jointPosition[j + i]);
      const distance = hypot(movement[0], movement[1] - climbed, movement[2]), share = min(1, spec.bounds.fastest / max(distance, 1e-9));
      for (let i = 0; i < 3; i++) {
        c.jointVelocity[j + i] = velocity[i];
        c.jointPosition[j + i] += i === 1 ? climbed + share * (movement[1] - climbed) : share * movement[i];
      }
    }
  };

  // Writes into q the world rotation of a joint. In y at index i it is an axis times half the angle, relative to the root. co, si: cosine
  // and sine of half the root's yaw.
  const q = [1, 0, 0, 0];
  const readRotation = (y, i, co, si) => {
    const half = hypot(y[i], y[i + 1], y[i + 2]), scale = half > 1e-8 ? sin(half) / half : 1, w = cos(half);
    const [a, b, d] = [y[i] * scale, y[i + 1] * scale, y[i + 2] * scale];
    [q[0], q[1], q[2], q[3]] = [co * w - si * b, co * a + si * d, co * b + si * w, co * d - si * a];
  };

  // Turns the joints to their predicted rotations along the shorter way (slerp), by at most k.fastestTurn in a frame.
  const turnJoints = (y) => {
    const yaw = atan2(c.dx[M], c.dz[M]), halfCos = cos(yaw / 2), halfSin = sin(yaw / 2), slowest = cos(k.fastestTurn / 2);
    for (let n = 0; n < spec.turning.length; n++) {
      const o = 4 * spec.turning[n], old = c.jointRotation;
      readRotation(y, Y.joint_rotation + 3 * n, halfCos, halfSin);
      const cosine = old[o] * q[0] + old[o + 1] * q[1] + old[o + 2] * q[2] + old[o + 3] * q[3];
      let keepShare = 0, takeShare = 1;
      if (abs(cosine) < slowest) {
        const whole = acos(abs(cosine));
        keepShare = sin(whole - k.fastestTurn / 2) / sin(whole);
        takeShare = sin(k.fastestTurn / 2) / sin(whole) * (cosine >= 0 ? 1 : -1);
      }
      for (let i = 0; i < 4; i++) old[o + i] = keepShare * old[o + i] + takeShare * q[i];
    }
  };

  // Sets the pose and the contacts from the outputs y.
  const takeOutputs = (y) => {
    moveJoints(y);
    turnJoints(y);
    c.posePosition.set(c.jointPosition);
    setDrawnTurns(c);
    for (let i = 0; i < 4; i++) c.contacts[i] = y[Y.contacts + i];
  };

  return { writeInputs, takeOutputs };
};

// Converts the caller's target for the trajectory. A target is that of `ProceduralAnimation.next_pose` in Python: velocity ([x, z], cm a frame),
// facing ([x, z], or null to look where the character goes) and gait (its name, or null to choose by speed). The limits of the body are those
// of `hobble.runtime.bounds`: a highest speed, and a walk instead of a jog if the body cannot jog.

export const createTargets = (spec, c) => {
  const { gaits, constants: k } = spec, M = spec.window, G = gaits.length, { atan2, hypot, min, max, abs } = Math;

  // Returns [strafe, direction]: the share of strafing from 0 to 1, and the direction [x, z] in which to look. ahead: the facing of the target.
  const chooseFacing = (velocity, ahead) => {
    const going = hypot(...velocity) >= k.still;
    if (!ahead) return [0, going ? velocity : c.smoothedDirection];
    const aside = abs(wrap(atan2(...velocity) - atan2(...ahead)));
    return [going ? min(1, aside / k.strafeFrom) : 1, ahead];
  };
  // The target share of each gait. direction: in which to look.
  const gaitShares = (velocity, direction, gait) => {
    const out = new Array(G).fill(0), speed = hypot(...velocity), name = gait || (speed >= k.jogFrom ? "jog" : "walk");
    if (speed < k.still) {
      const [a, b] = [c.dx[M], c.dz[M]];
      const angle = atan2(direction[0] * b - direction[1] * a, direction[0] * a + direction[1] * b);
      const turning = abs(angle) > k.turnInPlace ? 1 : 0;
      out[gaits.indexOf("stand")] = 1 - turning;
      out[gaits.indexOf("walk")] = turning;
      if (name !== "crouch") return out;
    }
    out[gaits.indexOf(name)] = 1;
    return out;
  };

  // The channels that limit the speed.
  const limited = spec.channels.filter((one) => one.limits);
  // Of each of these channels: for each gait, the highest speed of a healthy body, cm a frame.
  const healthySpeeds = limited.map(({ limits }) => limits.speeds.map((labels) => max(...labels.map(([unhurt]) => unhurt))));
  // The highest speed in gait g, cm a frame, under the limits of all channels, as in `combine_limits` of `hobble.channels.speed_limits`.
  const highestSpeed = (g) => {
    let least = Infinity, slowed = limited[0].limits.usual[g];
    const usual = slowed;
    limited.forEach(({ first, limits }, channel) => {
      const { levels, speeds } = limits, healthy = healthySpeeds[channel][g];
      let highest = Infinity, lost = 0, values = 0;
      for (let l = 0; l < speeds[g].length; l++) {
        const v = c.channelValues[first + l];
        if (!(v > 0)) continue;
        let i = 0;
        while (i < levels.length - 2 && levels[i + 1] <= v) i++;
        const [low, high] = [speeds[g][l][i], speeds[g][l][i + 1]], speed = low + (v - levels[i]) / (levels[i + 1] - levels[i]) * (high - low);
        highest = min(highest, speed);
        lost += (1 - min(speed / healthy, 1)) ** k.sumNorm;
        values++;
      }
      if (values > 1) highest = min(highest, healthy * max(1 - lost ** (1 / k.sumNorm), k.slowestShare));
      least = min(least, highest);
      if (usual > 0) slowed *= min(1, highest / usual);
    });
    return least < usual ? slowed : least;
  };
  // The target velocity within the limits. gait: the target share of each gait. It is changed if the body cannot jog.
  const limitSpeed = (velocity, gait) => {
    if (!limited.some(({ first, columns: own }) => own.some((_, l) => c.channelValues[first + l] > 0))) return velocity;
    const highestSpeeds = gaits.map((_, g) => highestSpeed(g)), walk = gaits.indexOf("walk"), jog = gaits.indexOf("jog");
    let hurry = 1;
    if (highestSpeeds[jog] < k.lameBelow) {
      hurry += (k.hurryFactor - 1) * gait[jog];
      gait[walk] += gait[jog];
      gait[jog] = 0;
    }
    let total = 0, highest = 0, usual = 0;
    gaits.forEach((name, g) => {
      if (name === "stand" || !(gait[g] > 0)) return;
      total += gait[g];
      highest += gait[g] * highestSpeeds[g];
      usual += gait[g] * limited[0].limits.usual[g];
    });
    // A target below the usual speed is slowed by the same share, so that a limp shows at any speed.
    const held = total > 0 ? min(1, hurry * highest / total / max(hypot(...velocity), usual / total, 1e-9)) : 1;
    return velocity.map((v) => v * held);
  };

  return { chooseFacing, gaitShares, limitSpeed };
};

// The path of the root over two seconds, half past and half future, as in `hobble.runtime.trajectory` and `hobble.runtime.controller`. It has T
// entries, one for each frame; entry M is the present. The network gets S samples of it, F of them from the present on. G: number of gaits.
// k: the constants of the Python runtime. c: the state of the character.

export const createTrajectory = (spec, c) => {
  const { step, y: Y, gaits, constants: k } = spec, T = 2 * spec.window, M = spec.window, S = T / step, F = M / step, G = gaits.length;
  const { atan2, sin, cos, hypot, floor, min, max, abs, sqrt } = Math;

  // The velocity [x, z] to ask the network for, so that the character reaches the target velocity [x, z]. As in `_ask_velocity` in Python, the
  // share spec.steering of the velocity's error is added to the target, and a steady error is added up in `correction`. speed: of the target. goingX,
  // goingZ: the mean velocity over the later half of the past.
  const askVelocity = ([x, z], speed, [goingX, goingZ]) => {
    const a = x - goingX, b = z - goingZ, more = [spec.steering * a, spec.steering * b];
    if (speed < k.still) c.correction = [0, 0];
    else {
      more[0] += c.correction[0] * x + c.correction[1] * z;
      more[1] += c.correction[0] * z - c.correction[1] * x;
      if (a * a + b * b < (k.correctionWithin * speed) ** 2) {
        const rate = spec.steering * k.correctionRate / (speed * speed);
        c.correction = [c.correction[0] + rate * (a * x + b * z), c.correction[1] + rate * (a * z - b * x)];
        c.correction = c.correction.map((v) => min(max(v, -k.mostCorrection), k.mostCorrection));
      }
    }
    const limit = min(1, k.steeringLimit * speed / max(hypot(...more), 1e-6));
    return [x + more[0] * limit, z + more[1] * limit];
  };

  // Turns the future path toward the target. direction: in which to look. strafe: share of strafing. gait: target shares of the gaits.
  const steer = (velocity, direction, strafe, gait) => {
    const speed = hypot(...velocity), span = floor(M / 2);
    let corrected = velocity, targetYaw = atan2(...direction);
    if (spec.steering > 0) {
      if (speed >= k.still) {
        const off = wrap(targetYaw - atan2(c.dx[M], c.dz[M])), room = max(k.furthestTurn - abs(off), 0);
        targetYaw += min(max(.5 * spec.steering * off, -room), room);
      }
      corrected = askVelocity(velocity, speed, [(c.px[M] - c.px[M - span]) / span, (c.pz[M] - c.pz[M - span]) / span]);
    }
    for (let i = 0; i < 2; i++) c.smoothedVelocity[i] += k.targetMix * (corrected[i] - c.smoothedVelocity[i]);
    let now = atan2(...c.smoothedDirection);
    now += k.targetMix * wrap(targetYaw - now);
    c.smoothedDirection = [sin(now), cos(now)];
    c.strafe += k.targetMix * (strafe - c.strafe);
    for (let g = 0; g < G; g++) c.gait[M * G + g] += k.gaitMix * (gait[g] - c.gait[M * G + g]);
    const biasPosition = .5 + .5 * c.strafe, biasDirection = 2 - 1.5 * c.strafe, goal = atan2(...c.smoothedDirection);
    let oldX = c.px[M], oldZ = c.pz[M];
    for (let i = M + 1; i < T; i++) {
      const remaining = 1 - (i - M) / M, stepX = c.px[i] - oldX, stepZ = c.pz[i] - oldZ;
      let share = 1 - remaining ** biasPosition;
      oldX = c.px[i];
      oldZ = c.pz[i];
      c.px[i] = c.px[i - 1] + stepX + share * (c.smoothedVelocity[0] - stepX);
      c.pz[i] = c.pz[i - 1] + stepZ + share * (c.smoothedVelocity[1] - stepZ);
      share = 1 - remaining ** biasDirection;
      let yaw = atan2(c.dx[i], c.dz[i]);
      yaw += share * wrap(goal - yaw);
      c.dx[i] = sin(yaw);
      c.dz[i] = cos(yaw);
      for (let g = 0; g < G; g++) c.gait[i * G + g] = c.gait[M * G + g];
    }
  };

  // Samples the ground under the path and to both sides of it. ground(x, z): height, cm.
  const sample = (ground) => {
    c.rootHeight = 0;
    for (let s = 0; s < S; s++) {
      const i = s * step, a = k.side * c.dz[i], b = k.side * c.dx[i];
      c.ground[3 * s] = ground(c.px[i] + a, c.pz[i] - b);
      c.ground[3 * s + 1] = ground(c.px[i], c.pz[i]);
      c.ground[3 * s + 2] = ground(c.px[i] - a, c.pz[i] + b);
      c.rootHeight += c.ground[3 * s + 1] / S;
    }
    if (!c.placed) { // the ground at the start may have any height
      for (let j = 1; j < c.jointPosition.length; j += 3) c.jointPosition[j] += c.rootHeight;
      c.root[1] = c.rootHeight;
      c.placed = true;
    }
  };

  // The root's movement [a, b] without a share of its component against the target. While the target is to stand, the same share of the whole
  // movement is removed. The share is k.backwardLoss with steering; it is 0 without steering, or with motion matching (spec.recordedPoses).
  const withoutBackward = (a, b, target) => {
    const loss = spec.steering > 0 && !spec.recordedPoses ? k.backwardLoss : 0, squared = target[0] ** 2 + target[1] ** 2;
    if (squared < k.still ** 2) return [(1 - loss) * a, (1 - loss) * b];
    const against = loss * min(0, a * target[0] + b * target[1]) / squared;
    return [a - against * target[0], b - against * target[1]];
  };
  // The root's movement, changed a little toward the target. This is done with motion matching, because clips have only some directions and
  // speeds. The change is limited: across the target to k.pull times the length of the movement, along the target to k.pullAhead times that.
  const pulledToTarget = ([a, b], target) => {
    const most = spec.steering > 0 && spec.recordedPoses ? k.pull * hypot(a, b) : 0, size = hypot(...target);
    const ahead = size >= k.still ? target.map((v) => v / size) : [0, 0], lack = [target[0] - a, target[1] - b];
    const along = lack[0] * ahead[0] + lack[1] * ahead[1], across = lack.map((v, i) => v - along * ahead[i]);
    const share = min(1, most / max(hypot(...across), 1e-9)), more = min(max(along, -k.pullAhead * most), k.pullAhead * most);
    return [a + more * ahead[0] + share * across[0], b + more * ahead[1] + share * across[1]];
  };

  // Advances by a frame: the past path is shifted, and the root and the future path move as the outputs y say. target: velocity.
  const advance = (y, target) => {
    for (let i = 0; i < M; i++) {
      c.px[i] = c.px[i + 1];
      c.pz[i] = c.pz[i + 1];
      c.dx[i] = c.dx[i + 1];
      c.dz[i] = c.dz[i + 1];
      for (let g = 0; g < G; g++) c.gait[i * G + g] = c.gait[(i + 1) * G + g];
    }
    const moving = spec.recordedPoses ? 1 : max(0, 1 - c.gait[M * G]) ** .25, [vx, vz] = [y[Y.root_velocity], y[Y.root_velocity + 1]];
    let yaw = atan2(c.dx[M], c.dz[M]);
    const [a, b] = pulledToTarget(withoutBackward(moving * (vx * cos(yaw) + vz * sin(yaw)), moving * (vz * cos(yaw) - vx * sin(yaw)), target), target);
    c.px[M] += a;
    c.pz[M] += b;
    yaw -= moving * y[Y.turn];
    const si = c.dx[M] = sin(yaw), co = c.dz[M] = cos(yaw);
    for (let i = M + 1; i < T; i++) {
      const at = (i - M) / step, n = min(floor(at), F - 2), m = at - n;
      const blend = (from) => (1 - m) * y[from + n] + m * y[from + n + 1];
      const a = blend(Y.position), b = blend(Y.position + F), p = blend(Y.direction), q = blend(Y.direction + F);
      const norm = max(sqrt(p * p + q * q), 1e-6);
      c.px[i] = c.px[M] + a * co + b * si;
      c.pz[i] = c.pz[M] + b * co - a * si;
      c.dx[i] = (p * co + q * si) / norm;
      c.dz[i] = (q * co - p * si) / norm;
    }
    const phase = c.phase + (.9 * moving + .1) * y[Y.phase_change];
    c.phase = phase - floor(phase);
  };

  return { steer, sample, advance };
};

// The controller of `hobble.runtime` in JavaScript, for one character. It has the same steps in the same order, so the
// same test data check both languages. Units are centimetres and frames of 1/60 s. Yaw 0 faces +Z, and yaw grows toward +X.

// Characters with the same network share its predictor, because a predictor remembers nothing between two predictions.
const predictors = new WeakMap();
const predictor = (spec) => {
  if (!predictors.has(spec)) predictors.set(spec, networks[spec.network.kind](spec));
  return predictors.get(spec);
};

// spec: the character's data, from `hobble.report.character`. place: [x, z] in cm, and heading: yaw in radians, where it starts. Returns its
// state `c` with the functions `frame` and `follow`.
export const createCharacter = (spec, place = [0, 0], heading = 0) => {
  const c = createState(spec, place, heading), targets = createTargets(spec, c), path = createTrajectory(spec, c);
  const rows = createRows(spec, c), feet = createFeet(spec, c), predict = predictor(spec), { min, max } = Math;
  const x = new Float32Array(spec.x.size);
  // Inputs and outputs are clipped to the range that they had in training.
  const [xLow, xHigh, yLow, yHigh] = ["xLow", "xHigh", "yLow", "yHigh"].map((name) => new Float32Array(bytes(spec.bounds[name])));
  const clipRow = (row, low, high) => { for (let i = 0; i < row.length; i++) row[i] = min(max(row[i], low[i]), high[i]); };
  // The largest change of each channel column in a frame.
  const rates = spec.channels.flatMap((one) => one.columns.map(() => one.rate));
  const changeChannels = () => rates.forEach((rate, l) => {
    c.channelValues[l] += min(max(c.channelTargets[l] - c.channelValues[l], -rate), rate);
  });

  // Copies the state of another character, or a state from the page's data, and moves it by `shift` [x, z], cm.
  c.follow = (other, shift = [0, 0]) => {
    for (const [name, value] of Object.entries(other)) {
      if (ArrayBuffer.isView(c[name])) c[name].set(value);
      else if (typeof value !== "function") c[name] = structuredClone(value);
    }
    for (let t = 0; t < c.px.length; t++) { c.px[t] += shift[0]; c.pz[t] += shift[1]; }
    for (const points of [c.jointPosition, c.posePosition]) for (let j = 0; j < points.length; j += 3) { points[j] += shift[0]; points[j + 2] += shift[1]; }
    for (const hold of c.footHold) { hold[0] += shift[0]; hold[1] += shift[1]; }
    for (const point of c.legShown.flat()) { point[0] += shift[0]; point[2] += shift[1]; }
    c.root = [c.root[0] + shift[0], c.root[1], c.root[2] + shift[1]];
  };
  // Runs one frame. velocity, facing, gait: the target, see createTargets. ground(x, z): height of the ground in cm.
  c.frame = (velocity, facing, gait, ground) => {
    const [strafe, direction] = targets.chooseFacing(velocity, facing), share = targets.gaitShares(velocity, direction, gait);
    velocity = targets.limitSpeed(velocity, share);
    path.steer(velocity, direction, strafe, share);
    path.sample(ground);
    changeChannels();
    rows.writeInputs(x);
    clipRow(x, xLow, xHigh);
    const y = predict(x, c.phase, c.memory);
    clipRow(y, yLow, yHigh);
    rows.takeOutputs(y);
    feet.carryBody(ground);
    for (let f = 0; f < 2; f++) feet.placeFoot(f, ground);
    path.advance(y, velocity);
  };
  return c;
};
