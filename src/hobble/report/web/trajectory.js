// The path of the root over two seconds, half past and half future, as in `hobble.runtime.trajectory` and `hobble.runtime.controller`. It has T
// entries, one for each frame; entry M is the present. The network gets S samples of it, F of them from the present on. G: number of gaits.
// k: the constants of the Python runtime. c: the state of the character, see state.js.
import { wrap } from "./numbers.js";

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
