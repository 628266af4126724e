// Draws inputs of the network in Play: ground heights and joint velocities.
const NEEDLE_FRAMES = 8; // a needle is as long as the movement of the joint in this many frames
const LEAST_SPEED = .15; // cm a frame: slower joints have no needle

// The heights of the ground that are inputs of the network. They are sampled along the past and future path, and to both sides of it. place:
// [x, y, z] of a sample. above: its height above the mean height of the path, cm. c: the state of the character, see state.js.
export const groundSamples = (c, spec) => {
  const { step, constants: { side } } = spec, out = [];
  for (let s = 0; s < c.ground.length / 3; s++) {
    const i = s * step, a = side * c.dz[i], b = side * c.dx[i];
    [[a, -b], [0, 0], [-a, b]].forEach(([x, z], k) => {
      out.push({ place: [c.px[i] + x, c.ground[3 * s + k], c.pz[i] + z], above: c.ground[3 * s + k] - c.rootHeight });
    });
  }
  return out;
};

// Needles {from, to}, from where a joint is to where it would be in NEEDLE_FRAMES frames.
export const jointVelocities = (c) => {
  const out = [];
  for (let j = 0; j < c.jointVelocity.length; j += 3) {
    const v = [c.jointVelocity[j], c.jointVelocity[j + 1], c.jointVelocity[j + 2]], from = [c.posePosition[j], c.posePosition[j + 1], c.posePosition[j + 2]];
    if (Math.hypot(...v) >= LEAST_SPEED) out.push({ from, to: from.map((p, i) => p + NEEDLE_FRAMES * v[i]) });
  }
  return out;
};

// Draws the ground heights as squares, red above the mean height of the path and blue below it, and the joint velocities as needles.
export const drawInputs = ({ marks, marksInFront, paint }, c, spec) => {
  for (const { place: [x, y, z], above } of groundSamples(c, spec)) {
    const rgb = Math.abs(above) < 1 ? paint.ink : above > 0 ? paint.high : paint.predicted, r = 3;
    marks.addQuad([[x - r, y + .6, z - r], [x + r, y + .6, z - r], [x + r, y + .6, z + r], [x - r, y + .6, z + r]], rgb, .8);
  }
  for (const { from, to } of jointVelocities(c)) marksInFront.addNeedle(from, to, 1.6, paint.predicted, .9);
};
