// Writes the state of a character into the network's input row X, and turns the output row Y into its next pose.
import { createDrawnTurns } from "./state.js";

// X, Y: the first column of each block of the rows. J joints, G gaits. The path has an entry for each frame, and M is the entry of the present.
// The network gets S samples of the path, `step` frames apart. k: the constants of the Python runtime. c: the state, see state.js.
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
