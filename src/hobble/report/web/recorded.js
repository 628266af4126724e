// Motion that is stored in the page: captured beside predicted clips.
import { find, material } from "./base.js";
import { createFigure } from "./figure.js";
import { bytes, mixTurn } from "./math.js";
import { createView } from "./view.js";

const TURN = 32767; // a component of a rotation that is 1 is stored as this integer
const UNIT = .01; // cm; positions are stored in steps of this length

// root, pose, turn: from `hobble.report.character.packed_motion`. In the result, frames: their number. roots: positions of the root,
// three numbers a frame, cm.
const createMotion = ({ root, pose, turn }, boneCount) => {
  const roots = new Float32Array(bytes(root)), steps = new Int16Array(bytes(pose)), turns = Float32Array.from(new Int16Array(bytes(turn)), (v) => v / TURN);
  const frames = roots.length / 3, place = (frame, b, i) => roots[3 * frame + i] + UNIT * steps[3 * (frame * boneCount + b) + i];
  return {
    frames, roots,
    // Sets the bones of a figure to the pose at a time in frames, moved by [x, z], cm.
    show(figure, time, [x, z] = [0, 0]) {
      const f = Math.min(frames - 1, Math.floor(time)), g = Math.min(frames - 1, f + 1), t = time - f, moved = [x, 0, z];
      for (let b = 0; b < boneCount; b++) {
        for (let i = 0; i < 3; i++) figure.places[3 * b + i] = (1 - t) * place(f, b, i) + t * place(g, b, i) + moved[i];
        mixTurn(turns, 4 * (f * boneCount + b), turns, 4 * (g * boneCount + b), t, figure.turns, 4 * b);
      }
    },
  };
};

// The view of captured (transparent) and predicted (blue) motion, with the distance between them over time.

// Opens a clip by name at the frame with the largest distance. Returns false if the page does not have the clip.
export let openClip = () => false;

export const startCaptured = () => {
  const data = material.compare, canvas = find("compare-view");
  if (!canvas || !data?.clips) return;
  const { fps } = data, choice = find("compare-choice"), slider = find("compare-time"), curve = find("compare-curve"), mark = find("compare-mark");
  // clip: what is shown. motions: its captured and its predicted motion. time: in frames. last: when the last picture was drawn (ms), or null
  // while nothing plays. sideOffset: cm between the two figures; 0 draws them over each other.
  let clip, motions, time = 0, playing = false, last = null, sideOffset = 0;

  const view = createView(canvas, { yaw: .75, pitch: .16, distance: 400 }, (now) => {
    const end = Math.max(1, clip.frames - 1), { paint, orbit: { yaw } } = view;
    if (playing && last !== null) time = (time + Math.min(.1, (now - last) / 1000) * fps) % end;
    last = playing ? now : null;
    slider.value = time;
    find("compare-clock").textContent = `${(time / fps).toFixed(1)} of ${((clip.frames - 1) / fps).toFixed(1)} s`;
    const { roots } = motions[0], at = 3 * Math.floor(time), [x, z] = [roots[at], roots[at + 2]];
    view.aim([x, 82, z]); // 82 cm: half the height of a body
    view.land.drawAround([x, 0, z]);
    motions[0].show(captured, time);
    motions[1].show(predicted, time, [sideOffset * Math.cos(yaw), -sideOffset * Math.sin(yaw)]); // to the right as the camera sees it
    captured.pose(() => (sideOffset ? paint.body : paint.ghost));
    predicted.pose(() => paint.predicted);
    view.land.darkenUnder([...predicted.balls(), ...(sideOffset ? captured.balls() : [])]);
    const split = clip.split === "held_out" ? "held out: not used for training" : "a training clip";
    find("compare-reading").replaceChildren(split, document.createElement("br"), `distance ${clip.error[Math.round(time)].toFixed(1)} cm per joint`);
    for (const end of ["x1", "x2"]) mark.setAttribute(end, time);
    if (playing) view.requestDraw();
  });
  const captured = createFigure(view, data.body, [], { ghost: true }), predicted = createFigure(view, data.body);

  const play = (on) => {
    [playing, last] = [on, null];
    find("compare-pause").textContent = on ? "Pause" : "Play";
    view.requestDraw();
  };
  // Pauses and shows a frame.
  const seek = (to) => { time = Math.min(clip.frames - 1, Math.max(0, to)); play(false); };
  const choose = () => {
    clip = data.clips[choice.selectedIndex];
    motions = [clip.captured, clip.predicted].map((motion) => createMotion(motion, data.joints));
    time = 0;
    slider.max = clip.frames - 1;
    const most = Math.max(1, ...clip.error);
    curve.closest("svg").setAttribute("viewBox", `0 0 ${clip.frames - 1} 40`);
    curve.setAttribute("d", `M${clip.error.map((e, f) => `${f} ${(39 - 37 * e / most).toFixed(1)}`).join("L")}`);
    find("compare-most").textContent = `${most.toFixed(1)} cm`;
    view.requestDraw();
  };
  openClip = (name) => {
    const index = data.clips.findIndex((each) => each.name === name);
    if (index < 0) return false;
    choice.selectedIndex = index;
    choose();
    seek(clip.error.indexOf(Math.max(...clip.error)));
    find("compare").scrollIntoView({ block: "center" });
    return true;
  };
  // A click on a row of a table that stands for a clip opens the clip. Its name is in the first cell.
  document.addEventListener("click", ({ target }) => {
    const row = target.closest("tbody tr");
    if (row) openClip(row.cells[0].textContent);
  });
  choice.addEventListener("change", choose);
  slider.addEventListener("input", () => seek(Number(slider.value)));
  find("compare-pause").addEventListener("click", () => play(!playing));
  find("compare-apart").addEventListener("click", (event) => {
    sideOffset = sideOffset ? 0 : 95;
    event.currentTarget.setAttribute("aria-pressed", String(sideOffset > 0));
    view.requestDraw();
  });
  Object.assign(view.orbit.keys, { " ": () => play(!playing), ",": () => seek(Math.ceil(time) - 1), ".": () => seek(Math.floor(time) + 1) });
  view.orbit.listen(find("compare-stage"));
  view.onHidden = () => { last = null; };
  choose();
};
