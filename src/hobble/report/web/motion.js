// Motion that is stored in the page: the places and rotations of a figure's bones, frame by frame.
import { bytes } from "./numbers.js";
import { mixTurn } from "./turns.js";

const TURN = 32767; // a component of a rotation that is 1 is stored as this integer

// root, pose, turn: from `hobble.report.scenes.packed_motion`. B: number of bones. unit: cm of a step of `pose`.
export const createMotion = ({ root, pose, turn }, B, unit) => {
  const roots = new Float32Array(bytes(root)), steps = new Int16Array(bytes(pose));
  const turns = Float32Array.from(new Int16Array(bytes(turn)), (v) => v / TURN), frames = roots.length / 3;
  const place = (frame, b, i) => roots[3 * frame + i] + unit * steps[3 * (frame * B + b) + i];
  return {
    frames, roots,
    at: (frame, b) => [0, 1, 2].map((i) => place(frame, b, i)),
    // Puts a figure into its pose at a time in frames, shifted by [x, z] cm.
    show(figure, time, by = [0, 0]) {
      const f = Math.min(frames - 1, Math.floor(time)), g = Math.min(frames - 1, f + 1), t = time - f, aside = [by[0], 0, by[1]];
      for (let b = 0; b < B; b++) {
        for (let i = 0; i < 3; i++) figure.places[3 * b + i] = (1 - t) * place(f, b, i) + t * place(g, b, i) + aside[i];
        mixTurn(turns, 4 * (f * B + b), turns, 4 * (g * B + b), t, figure.turns, 4 * b);
      }
    },
  };
};
