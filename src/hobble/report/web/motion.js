// Motion that is stored in the page: the places and rotations of a figure's bones, frame by frame.
import { bytes } from "./numbers.js";
import { mixTurn } from "./turns.js";

const TURN = 32767; // a component of a rotation that is 1 is stored as this integer

// root, pose, turn: from `hobble.report.scenes.packed_motion`. unit: `pose` has integers, and one stands for this many cm. In the result,
// frames: their number. roots: positions of the root, three numbers a frame, cm. at(frame, b): position of bone b.
export const createMotion = ({ root, pose, turn }, boneCount, unit) => {
  const roots = new Float32Array(bytes(root)), poseSteps = new Int16Array(bytes(pose));
  const turns = Float32Array.from(new Int16Array(bytes(turn)), (v) => v / TURN), frames = roots.length / 3;
  const place = (frame, b, i) => roots[3 * frame + i] + unit * poseSteps[3 * (frame * boneCount + b) + i];
  return {
    frames, roots,
    at: (frame, b) => [0, 1, 2].map((i) => place(frame, b, i)),
    // Sets the bones of a figure to the pose at a time in frames, moved by `shift` [x, z], cm.
    show(figure, time, shift = [0, 0]) {
      const f = Math.min(frames - 1, Math.floor(time)), g = Math.min(frames - 1, f + 1), t = time - f, moved = [shift[0], 0, shift[1]];
      for (let b = 0; b < boneCount; b++) {
        for (let i = 0; i < 3; i++) figure.places[3 * b + i] = (1 - t) * place(f, b, i) + t * place(g, b, i) + moved[i];
        mixTurn(turns, 4 * (f * boneCount + b), turns, 4 * (g * boneCount + b), t, figure.turns, 4 * b);
      }
    },
  };
};
