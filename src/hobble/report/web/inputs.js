// Draws inputs of the network in Play: ground heights and joint velocities.
const AHEAD = 8; // frames of movement that a needle shows
const LEAST = .15; // cm a frame; slower joints have no needle

// The ground samples of the network's input: along the past and future path and to both sides of it. above: cm above the
// mean height of the path.
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

// Needles from where the joints are to where they would be in AHEAD frames.
export const jointVelocities = (c) => {
  const out = [];
  for (let j = 0; j < c.jointVelocity.length; j += 3) {
    const v = [c.jointVelocity[j], c.jointVelocity[j + 1], c.jointVelocity[j + 2]], from = [c.posePosition[j], c.posePosition[j + 1], c.posePosition[j + 2]];
    if (Math.hypot(...v) >= LEAST) out.push({ from, to: from.map((p, i) => p + AHEAD * v[i]) });
  }
  return out;
};

export const drawInputs = ({ marks, over, paint }, c, spec) => {
  for (const { place: [x, y, z], above } of groundSamples(c, spec)) {
    const rgb = Math.abs(above) < 1 ? paint.ink : above > 0 ? paint.high : paint.predicted, r = 3;
    marks.piece([[x - r, y + .6, z - r], [x + r, y + .6, z - r], [x + r, y + .6, z + r], [x - r, y + .6, z + r]], rgb, .8);
  }
  for (const { from, to } of jointVelocities(c)) over.needle(from, to, 1.6, paint.predicted, .9);
};
