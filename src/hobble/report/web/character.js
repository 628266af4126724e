// The controller of `hobble.runtime` in JavaScript, for one character. It has the same steps in the same order, so the
// same test data check both. Centimetres, 60 Hz; yaw 0 faces +Z and grows toward +X.
import { networks } from "networks"; // by kind; the bundle gathers them from the folders of hobble.models
import { createFeet } from "./feet.js";
import { bytes } from "./numbers.js";
import { at4, multiply } from "./turns.js";

// Characters of one network share it. It remembers nothing between two predictions.
const predictors = new WeakMap();
const predictor = (spec) => {
  if (!predictors.has(spec)) predictors.set(spec, networks[spec.network.kind](spec));
  return predictors.get(spec);
};

export const createCharacter = (spec, place = [0, 0], heading = 0) => {
  const { joints: J, step, x: X, y: Y, gaits, constants: k } = spec, T = 2 * spec.window, M = spec.window;
  const S = T / step, F = M / step, G = gaits.length, predict = predictor(spec);
  const { atan2, sin, cos, hypot, floor, min, max, abs, sqrt, PI } = Math;
  const wrap = (angle) => angle - 2 * PI * floor((angle + PI) / (2 * PI));
  // The columns of all channels in order: the place of each in X, and how far its value may change in a frame.
  const columns = spec.channels.flatMap((one) => one.columns.map((_, l) => ({ at: X[one.name] + l, rate: one.rate }))), L = columns.length;
  const x = new Float32Array(X.size);
  const filled = (n, value) => new Float64Array(n).fill(value);

  const c = {
    px: filled(T, place[0]), pz: filled(T, place[1]), dx: filled(T, sin(heading)), dz: filled(T, cos(heading)),
    gait: filled(T * G, 0), ground: filled(S * 3, 0), height: 0, phase: 0, joints: filled(3 * J, 0),
    velocities: filled(3 * J, 0), pose: filled(3 * J, 0), rotations: filled(4 * J, 0), turns: filled(4 * J, 0), channelValues: filled(L, 0), channelTargets: filled(L, 0),
    velocity: [0, 0], direction: [sin(heading), cos(heading)], strafe: 0, correction: [0, 0], lock: [0, 0],
    hold: [[0, 0], [0, 0]], step: [0, 0], missed: [0, 0], lift: [0, 0], raised: 0, placed: false, added: [0, 1].map(() => [[1, 0, 0, 0], [1, 0, 0, 0]]), shown: [], contacts: [0, 0, 0, 0], root: [place[0], 0, place[1]],
    memory: filled(spec.network.memory ?? 0, 0),
  };
  const feet = createFeet(spec, c);
  // Writes into q the rotation at index `i` of the outputs (axis times half the angle), turned about Y with the root.
  const q = [1, 0, 0, 0];
  const turned = (y, i, co, si) => {
    const half = hypot(y[i], y[i + 1], y[i + 2]), scale = half > 1e-8 ? sin(half) / half : 1, w = cos(half);
    const [a, b, d] = [y[i] * scale, y[i + 1] * scale, y[i + 2] * scale];
    [q[0], q[1], q[2], q[3]] = [co * w - si * b, co * a + si * d, co * b + si * w, co * d - si * a];
  };
  // The rotations to draw. Joints that move no bone keep the rotation of their parent.
  const rests = spec.parents.flatMap((p, j) => (p < 0 || spec.turning.includes(j) ? [] : [[j, p]]));
  const settle = () => {
    c.turns.set(c.rotations);
    for (const [j, p] of rests) for (let i = 0; i < 4; i++) c.turns[4 * j + i] = c.turns[4 * p + i];
  };
  // The character starts in a frame of the clips, turned to its heading.
  const at = (name) => new Float32Array(bytes(spec.start[name])), [si, co] = [sin(heading), cos(heading)];
  const [path, ahead, joints, velocities] = ["position", "direction", "joint_position", "joint_velocity"].map(at);
  for (let t = 0; t < T; t++) {
    c.px[t] = path[2 * t] * co + path[2 * t + 1] * si + place[0];
    c.pz[t] = path[2 * t + 1] * co - path[2 * t] * si + place[1];
    c.dx[t] = ahead[2 * t] * co + ahead[2 * t + 1] * si;
    c.dz[t] = ahead[2 * t + 1] * co - ahead[2 * t] * si;
  }
  for (let j = 0; j < 3 * J; j += 3) for (const [from, to, a, b] of [[joints, c.joints, ...place], [velocities, c.velocities, 0, 0]]) {
    to[j] = from[j] * co + from[j + 2] * si + a;
    to[j + 1] = from[j + 1];
    to[j + 2] = from[j + 2] * co - from[j] * si + b;
  }
  c.gait.set(at("gait"));
  c.phase = spec.start.phase;
  c.pose.set(c.joints);
  c.shown = spec.legs.map(([, ...below]) => below.map((j) => Array.from(c.joints.subarray(3 * j, 3 * j + 3))));
  const rotations = at("joint_rotation"), facing0 = [cos(heading / 2), 0, sin(heading / 2), 0];
  for (let j = 0; j < J; j++) c.rotations.set(multiply(facing0, at4(rotations, j)), 4 * j);
  settle();

  // Inputs and outputs are clipped to the range seen in training.
  const [xLow, xHigh, yLow, yHigh] = ["xLow", "xHigh", "yLow", "yHigh"].map((name) => new Float32Array(bytes(spec.bounds[name])));
  const within = (row, low, high) => { for (let i = 0; i < row.length; i++) row[i] = min(max(row[i], low[i]), high[i]); };

  // Wishes, as `ProceduralAnimation.next_pose` takes them: velocity [x, z], facing [x, z] or null, gait or null.

  const facing = (velocity, ahead) => {
    const going = hypot(...velocity) >= k.still;
    if (!ahead) return [0, going ? velocity : c.direction];
    const aside = abs(wrap(atan2(...velocity) - atan2(...ahead)));
    return [going ? min(1, aside / k.strafeFrom) : 1, ahead];
  };
  const shares = (velocity, direction, gait) => {
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

  // The limits of a hurt body, as in `hobble.runtime.limits`: a highest speed, and a walk instead of a jog if the body
  // cannot jog.

  const limited = spec.channels.filter((one) => one.limits);
  const allowed = (g) => {
    let least = Infinity, both = limited[0].limits.usual[g];
    const usual = both;
    for (const { first, limits } of limited) {
      const { levels, speeds } = limits;
      let most = Infinity;
      for (let l = 0; l < speeds[g].length; l++) {
        const v = c.channelValues[first + l];
        if (!(v > 0)) continue;
        let i = 0;
        while (i < levels.length - 2 && levels[i + 1] <= v) i++;
        const [low, high] = [speeds[g][l][i], speeds[g][l][i + 1]];
        most = min(most, low + (v - levels[i]) / (levels[i + 1] - levels[i]) * (high - low));
      }
      least = min(least, most);
      if (usual > 0) both *= min(1, most / usual);
    }
    return least < usual ? both : least;
  };
  const hold = (velocity, gait) => {
    if (!limited.some(({ first, columns: own }) => own.some((_, l) => c.channelValues[first + l] > 0))) return velocity;
    const each = gaits.map((_, g) => allowed(g)), walk = gaits.indexOf("walk"), jog = gaits.indexOf("jog");
    let hurry = 1;
    if (each[jog] < k.lameBelow) {
      hurry += (k.hurried - 1) * gait[jog];
      gait[walk] += gait[jog];
      gait[jog] = 0;
    }
    let whole = 0, most = 0;
    gaits.forEach((name, g) => {
      if (name === "stand" || !(gait[g] > 0)) return;
      whole += gait[g];
      most += gait[g] * each[g];
    });
    const held = whole > 0 ? min(1, hurry * most / whole / max(hypot(...velocity), 1e-9)) : 1;
    return velocity.map((v) => v * held);
  };

  // The steps of a frame

  const ask = ([x, z], speed, [goingX, goingZ]) => {
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
  const prepare = (velocity, direction, strafe, gait, ground) => {
    // Steering, as in `_ask_velocity` and `_ask_turn` of hobble.runtime.trajectory: the error of the velocity over half of
    // the past is added to the wish, and a steady error is added up in `correction`.
    const speed = hypot(...velocity), span = floor(M / 2);
    let asked = velocity, wished = atan2(...direction);
    if (spec.steering > 0) {
      if (speed >= k.still) {
        const off = wrap(wished - atan2(c.dx[M], c.dz[M])), room = max(k.furthestTurn - abs(off), 0);
        wished += min(max(.5 * spec.steering * off, -room), room);
      }
      asked = ask(velocity, speed, [(c.px[M] - c.px[M - span]) / span, (c.pz[M] - c.pz[M - span]) / span]);
    }
    for (let i = 0; i < 2; i++) c.velocity[i] += k.targetMix * (asked[i] - c.velocity[i]);
    let now = atan2(...c.direction);
    now += k.targetMix * wrap(wished - now);
    c.direction = [sin(now), cos(now)];
    c.strafe += k.targetMix * (strafe - c.strafe);
    for (let g = 0; g < G; g++) c.gait[M * G + g] += k.gaitMix * (gait[g] - c.gait[M * G + g]);
    const biasPosition = .5 + .5 * c.strafe, biasDirection = 2 - 1.5 * c.strafe, goal = atan2(...c.direction);
    let oldX = c.px[M], oldZ = c.pz[M];
    for (let i = M + 1; i < T; i++) {
      const left = 1 - (i - M) / M, stepX = c.px[i] - oldX, stepZ = c.pz[i] - oldZ;
      let share = 1 - left ** biasPosition;
      oldX = c.px[i];
      oldZ = c.pz[i];
      c.px[i] = c.px[i - 1] + stepX + share * (c.velocity[0] - stepX);
      c.pz[i] = c.pz[i - 1] + stepZ + share * (c.velocity[1] - stepZ);
      share = 1 - left ** biasDirection;
      let yaw = atan2(c.dx[i], c.dz[i]);
      yaw += share * wrap(goal - yaw);
      c.dx[i] = sin(yaw);
      c.dz[i] = cos(yaw);
      for (let g = 0; g < G; g++) c.gait[i * G + g] = c.gait[M * G + g];
    }
    c.height = 0;
    for (let s = 0; s < S; s++) {
      const i = s * step, a = k.side * c.dz[i], b = k.side * c.dx[i];
      c.ground[3 * s] = ground(c.px[i] + a, c.pz[i] - b);
      c.ground[3 * s + 1] = ground(c.px[i], c.pz[i]);
      c.ground[3 * s + 2] = ground(c.px[i] - a, c.pz[i] + b);
      c.height += c.ground[3 * s + 1] / S;
    }
    if (!c.placed) { // the ground at the start may have any height
      for (let j = 1; j < 3 * J; j += 3) c.joints[j] += c.height;
      c.root[1] = c.height;
      c.placed = true;
    }
    columns.forEach(({ rate }, l) => { c.channelValues[l] += min(max(c.channelTargets[l] - c.channelValues[l], -rate), rate); });
  };
  const input = () => {
    let [px, pz, co, si] = [c.px[M], c.pz[M], c.dz[M], c.dx[M]];
    for (let s = 0; s < S; s++) {
      const i = s * step, a = c.px[i] - px, b = c.pz[i] - pz;
      x[X.position + s] = a * co - b * si;
      x[X.position + S + s] = a * si + b * co;
      x[X.direction + s] = c.dx[i] * co - c.dz[i] * si;
      x[X.direction + S + s] = c.dx[i] * si + c.dz[i] * co;
      for (let g = 0; g < G; g++) x[X.gait + g * S + s] = c.gait[i * G + g];
      for (let side = 0; side < 3; side++) x[X.terrain + side * S + s] = c.ground[3 * s + side] - c.height;
    }
    [px, pz, co, si] = [c.px[M - 1], c.pz[M - 1], c.dz[M - 1], c.dx[M - 1]];
    for (let j = 0; j < 3 * J; j += 3) {
      const a = c.joints[j] - px, b = c.joints[j + 2] - pz, p = X.joint_position + j, v = X.joint_velocity + j;
      x[p] = a * co - b * si;
      x[p + 1] = c.joints[j + 1] - c.height;
      x[p + 2] = a * si + b * co;
      x[v] = c.velocities[j] * co - c.velocities[j + 2] * si;
      x[v + 1] = c.velocities[j + 1];
      x[v + 2] = c.velocities[j] * si + c.velocities[j + 2] * co;
    }
    columns.forEach(({ at }, l) => { x[at] = c.channelValues[l]; });
  };
  const output = (y, ground) => {
    const si = c.dx[M], co = c.dz[M];
    const climbed = c.height - c.root[1];
    c.raised += min(max(climbed, -k.mostClimb), k.mostClimb) - climbed;
    c.root = [c.px[M], c.height, c.pz[M]];
    for (let j = 0; j < 3 * J; j += 3) {
      const p = Y.joint_position + j, v = Y.joint_velocity + j;
      const velocity = [y[v] * co + y[v + 2] * si, y[v + 1], y[v + 2] * co - y[v] * si];
      const point = [y[p] * co + y[p + 2] * si + c.root[0], y[p + 1] + c.root[1], y[p + 2] * co - y[p] * si + c.root[2]];
      const move = point.map((v, i) => .5 * (c.joints[j + i] + velocity[i] + v) - c.joints[j + i]);
      const far = hypot(move[0], move[1] - climbed, move[2]), share = min(1, spec.bounds.fastest / max(far, 1e-9));
      for (let i = 0; i < 3; i++) {
        c.velocities[j + i] = velocity[i];
        c.joints[j + i] += i === 1 ? climbed + share * (move[1] - climbed) : share * move[i];
      }
    }
    // Limit the turn of a joint to fastestTurn a frame, along the shorter way.
    const yaw = atan2(si, co), halfCos = cos(yaw / 2), halfSin = sin(yaw / 2), slowest = cos(k.fastestTurn / 2);
    for (let n = 0; n < spec.turning.length; n++) {
      const o = 4 * spec.turning[n], old = c.rotations;
      turned(y, Y.joint_rotation + 3 * n, halfCos, halfSin);
      const near = old[o] * q[0] + old[o + 1] * q[1] + old[o + 2] * q[2] + old[o + 3] * q[3];
      let keep = 0, take = 1;
      if (abs(near) < slowest) {
        const whole = Math.acos(abs(near));
        keep = sin(whole - k.fastestTurn / 2) / sin(whole);
        take = sin(k.fastestTurn / 2) / sin(whole) * (near >= 0 ? 1 : -1);
      }
      for (let i = 0; i < 4; i++) old[o + i] = keep * old[o + i] + take * q[i];
    }
    c.pose.set(c.joints);
    settle();
    for (let i = 0; i < 4; i++) c.contacts[i] = y[Y.contacts + i];
    feet.carryBody(ground);
    for (let f = 0; f < 2; f++) feet.placeFoot(f, ground);
  };
  const update = (y, wish) => {
    for (let i = 0; i < M; i++) {
      c.px[i] = c.px[i + 1];
      c.pz[i] = c.pz[i + 1];
      c.dx[i] = c.dx[i + 1];
      c.dz[i] = c.dz[i + 1];
      for (let g = 0; g < G; g++) c.gait[i * G + g] = c.gait[(i + 1) * G + g];
    }
    const moving = spec.rooted ? 1 : max(0, 1 - c.gait[M * G]) ** .25, [vx, vz] = [y[Y.root_velocity], y[Y.root_velocity + 1]];
    let yaw = atan2(c.dx[M], c.dz[M]);
    // Remove half of the movement against the wish, or of all movement while the character turns on the spot.
    let a = moving * (vx * cos(yaw) + vz * sin(yaw)), b = moving * (vz * cos(yaw) - vx * sin(yaw));
    const loss = spec.steering > 0 && !spec.rooted ? k.unwishedLoss : 0, squared = wish[0] ** 2 + wish[1] ** 2;
    if (squared < k.still ** 2) [a, b] = [(1 - loss) * a, (1 - loss) * b];
    else {
      const against = loss * min(0, a * wish[0] + b * wish[1]) / squared;
      [a, b] = [a - against * wish[0], b - against * wish[1]];
    }
    // With motion matching, change the movement a little toward the wish, because clips have only some directions and speeds.
    // Across the wish by a share of the movement, and along it by half of that.
    const most = spec.steering > 0 && spec.rooted ? k.pull * hypot(a, b) : 0, size = hypot(...wish);
    const ahead = size >= k.still ? wish.map((v) => v / size) : [0, 0], lack = [wish[0] - a, wish[1] - b];
    const along = lack[0] * ahead[0] + lack[1] * ahead[1], across = lack.map((v, i) => v - along * ahead[i]);
    const share = min(1, most / max(hypot(...across), 1e-9)), limited = min(max(along, -k.pullAhead * most), k.pullAhead * most);
    c.px[M] += a + limited * ahead[0] + share * across[0];
    c.pz[M] += b + limited * ahead[1] + share * across[1];
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

  // Copies the state of another character (or one from the data of the page), moved by [x, z] cm.
  c.follow = (other, by = [0, 0]) => {
    for (const [name, value] of Object.entries(other)) {
      if (ArrayBuffer.isView(c[name])) c[name].set(value);
      else if (typeof value !== "function") c[name] = structuredClone(value);
    }
    for (let t = 0; t < T; t++) { c.px[t] += by[0]; c.pz[t] += by[1]; }
    for (const points of [c.joints, c.pose]) for (let j = 0; j < 3 * J; j += 3) { points[j] += by[0]; points[j + 2] += by[1]; }
    for (const hold of c.hold) { hold[0] += by[0]; hold[1] += by[1]; }
    for (const point of c.shown.flat()) { point[0] += by[0]; point[2] += by[1]; }
    c.root = [c.root[0] + by[0], c.root[1], c.root[2] + by[1]];
  };
  c.frame = (velocity, ahead, gait, ground) => {
    const [strafe, direction] = facing(velocity, ahead), share = shares(velocity, direction, gait);
    velocity = hold(velocity, share);
    prepare(velocity, direction, strafe, share, ground);
    input();
    within(x, xLow, xHigh);
    const y = predict(x, c.phase, c.memory);
    within(y, yLow, yHigh);
    output(y, ground);
    update(y, velocity);
  };
  return c;
};
