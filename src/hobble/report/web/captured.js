// The view of captured (transparent) and predicted (blue) motion, with the distance between them over time.
import { find, material } from "./base.js";
import { createFigure } from "./figure.js";
import { createMotion } from "./motion.js";
import { createView } from "./view.js";

// Opens a clip by name at the frame with the largest distance. Returns false if the page does not have the clip.
export let openClip = () => false;

export const startCaptured = () => {
  const data = material.compare, canvas = document.getElementById("compare-view");
  if (!canvas || !data || !data.clips) return;
  const boneCount = data.joints, slider = find("compare-time"), choice = find("compare-choice"), unpacked = new Map();

  const unpack = (index) => {
    if (!unpacked.has(index)) {
      const stored = data.clips[index], unpackMotion = (motion) => createMotion(motion, boneCount, data.unit);
      unpacked.set(index, { ...stored, captured: unpackMotion(stored.captured), predicted: unpackMotion(stored.predicted) });
    }
    return unpacked.get(index);
  };

  // clip: the unpacked clip that is shown. time: in frames. sideOffset: cm between the two figures; 0 draws them over each other. last: when the
  // last picture was drawn (ms), or null while nothing plays.
  let clip, time = 0, playing = false, sideOffset = 0, last = null;
  const view = createView(canvas, { yaw: .75, pitch: .16, distance: 400 }, (now) => {
    if (playing && last !== null) time = (time + Math.min(.1, (now - last) / 1000) * data.fps) % Math.max(1, clip.frames - 1);
    last = playing ? now : null;
    slider.value = time;
    const { paint } = view, yaw = view.orbit.yaw, { roots } = clip.captured, at = 3 * Math.min(clip.frames - 1, Math.floor(time));
    const [x, z] = [roots[at], roots[at + 2]];
    view.aim([x, 82, z]); // 82 cm: half the height of a body
    view.land.drawAround([x, 0, z]);
    const aside = [sideOffset * Math.cos(yaw), -sideOffset * Math.sin(yaw)]; // to the right as the camera sees it
    clip.captured.show(captured, time);
    clip.predicted.show(predicted, time, aside);
    captured.pose(() => (sideOffset ? paint.body : paint.ghost));
    predicted.pose(() => paint.predicted);
    view.land.darkenUnder([...predicted.balls(), ...(sideOffset ? captured.balls() : [])]);
    const f = Math.min(clip.frames - 1, Math.round(time));
    const split = clip.split === "held_out" ? "held out: not used for training" : "a training clip";
    find("compare-reading").replaceChildren(split, document.createElement("br"), `distance ${clip.error[f].toFixed(1)} cm per joint`);
    find("compare-clock").textContent = `${(time / data.fps).toFixed(1)} of ${((clip.frames - 1) / data.fps).toFixed(1)} s`;
    find("compare-mark").setAttribute("x1", time);
    find("compare-mark").setAttribute("x2", time);
    if (playing) view.requestDraw();
  });
  const captured = createFigure(view, data.body, [], { ghost: true }), predicted = createFigure(view, data.body);
  view.onHidden = () => { last = null; };

  const play = (on) => {
    playing = on;
    last = null;
    find("compare-pause").textContent = on ? "Pause" : "Play";
    view.requestDraw();
  };
  const choose = () => {
    clip = unpack(choice.selectedIndex);
    time = 0;
    slider.max = clip.frames - 1;
    const most = Math.max(1, ...clip.error), curve = find("compare-curve");
    curve.closest("svg").setAttribute("viewBox", `0 0 ${clip.frames - 1} 40`);
    curve.setAttribute("d", `M${clip.error.map((e, f) => `${f} ${(39 - 37 * e / most).toFixed(1)}`).join("L")}`);
    find("compare-most").textContent = `${most.toFixed(1)} cm`;
    view.requestDraw();
  };
  openClip = (name) => {
    const index = data.clips.findIndex((c) => c.name === name);
    if (index < 0) return false;
    choice.selectedIndex = index;
    choose();
    seek(clip.error.indexOf(Math.max(...clip.error)));
    find("compare").scrollIntoView({ block: "center" });
    return true;
  };
  // Pauses and shows a frame.
  const seek = (to) => { play(false); time = Math.min(clip.frames - 1, Math.max(0, to)); view.requestDraw(); };
  slider.addEventListener("input", () => seek(Number(slider.value)));
  choice.addEventListener("change", choose);
  find("compare-pause").addEventListener("click", () => play(!playing));
  find("compare-apart").addEventListener("click", (event) => {
    sideOffset = sideOffset ? 0 : 95;
    event.currentTarget.setAttribute("aria-pressed", String(sideOffset > 0));
    view.requestDraw();
  });
  Object.assign(view.orbit.keys, {
    " ": () => play(!playing), ",": () => seek(Math.ceil(time) - 1), ".": () => seek(Math.floor(time) + 1),
  });
  view.orbit.listen(find("compare-stage"));
  choose();
};
