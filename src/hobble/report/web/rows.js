// The rows X and Y of the network: the state of a character as inputs, and outputs as its next pose.
import { createDrawnTurns } from "./state.js";

export const createRows = (spec, c) => {
  const { joints: J, step, x: X, y: Y, gaits, constants: k } = spec, M = spec.window, S = 2 * M / step, G = gaits.length;
  const { atan2, sin, cos, acos, hypot, min, max, abs } = Math, setDrawnTurns = createDrawnTurns(spec);
  // The index in X of each channel column.
  const columns = spec.channels.flatMap((one) => one.columns.map((_, l) => X[one.name] + l));

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
    columns.forEach((at, l) => { x[at] = c.channelValues[l]; });
  };

  // A joint's new place is the mean of its predicted place and of its old place plus its predicted velocity.
  const moveJoints = (y) => {
    const si = c.dx[M], co = c.dz[M];
    const climbed = c.rootHeight - c.root[1];
    c.bodyLift += min(max(climbed, -k.mostClimb), k.mostClimb) - climbed;
    c.root = [c.px[M], c.rootHeight, c.pz[M]];
    for (let j = 0; j < 3 * J; j += 3) {
      const p = Y.joint_position + j, v = Y.joint_velocity + j;
      const velocity = [y[v] * co + y[v + 2] * si, y[v + 1], y[v + 2] * co - y[v] * si];
      const point = [y[p] * co + y[p + 2] * si + c.root[0], y[p + 1] + c.root[1], y[p + 2] * co - y[p] * si + c.root[2]];
      const move = point.map((v, i) => .5 * (c.jointPosition[j + i] + velocity[i] + v) - c.jointPosition[j + i]);
      const far = hypot(move[0], move[1] - climbed, move[2]), share = min(1, spec.bounds.fastest / max(far, 1e-9));
      for (let i = 0; i < 3; i++) {
        c.jointVelocity[j + i] = velocity[i];
        c.jointPosition[j + i] += i === 1 ? climbed + share * (move[1] - climbed) : share * move[i];
      }
    }
  };

  // Writes into q the rotation at index `i` of the outputs (axis times half the angle), turned about Y with the root.
  const q = [1, 0, 0, 0];
  const turned = (y, i, co, si) => {
    const half = hypot(y[i], y[i + 1], y[i + 2]), scale = half > 1e-8 ? sin(half) / half : 1, w = cos(half);
    const [a, b, d] = [y[i] * scale, y[i + 1] * scale, y[i + 2] * scale];
    [q[0], q[1], q[2], q[3]] = [co * w - si * b, co * a + si * d, co * b + si * w, co * d - si * a];
  };

  // Turn the joints along the shorter way, by at most fastestTurn in a frame.
  const turnJoints = (y) => {
    const yaw = atan2(c.dx[M], c.dz[M]), halfCos = cos(yaw / 2), halfSin = sin(yaw / 2), slowest = cos(k.fastestTurn / 2);
    for (let n = 0; n < spec.turning.length; n++) {
      const o = 4 * spec.turning[n], old = c.jointRotation;
      turned(y, Y.joint_rotation + 3 * n, halfCos, halfSin);
      const near = old[o] * q[0] + old[o + 1] * q[1] + old[o + 2] * q[2] + old[o + 3] * q[3];
      let keep = 0, take = 1;
      if (abs(near) < slowest) {
        const whole = acos(abs(near));
        keep = sin(whole - k.fastestTurn / 2) / sin(whole);
        take = sin(k.fastestTurn / 2) / sin(whole) * (near >= 0 ? 1 : -1);
      }
      for (let i = 0; i < 4; i++) old[o + i] = keep * old[o + i] + take * q[i];
    }
  };

  const takeOutputs = (y) => {
    moveJoints(y);
    turnJoints(y);
    c.posePosition.set(c.jointPosition);
    setDrawnTurns(c);
    for (let i = 0; i < 4; i++) c.contacts[i] = y[Y.contacts + i];
  };

  return { writeInputs, takeOutputs };
};
