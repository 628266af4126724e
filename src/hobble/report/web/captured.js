// Captured (grey) and predicted (blue, seen through), with the distance between them along the time.
import { find, material } from "./base.js";
import { createFigure } from "./figure.js";
import { bytes, mix } from "./numbers.js";
import { createView } from "./view.js";

(() => {
  const shown = material.compare, canvas = document.getElementById("compare-view");
  if (!canvas || !shown || !shown.clips) return;
  const J = shown.joints, slider = find("compare-time"), choice = find("compare-choice"), unpacked = new Map();

  const unpack = (index) => {
    if (!unpacked.has(index)) {
      const c = shown.clips[index];
      unpacked.set(index, {
        ...c, root: new Float32Array(bytes(c.root)), pose: new Int16Array(bytes(c.pose)),
        guess: new Int16Array(bytes(c.predicted)),
      });
    }
    return unpacked.get(index);
  };
  const at = (c, table, frame) => Array.from({ length: J }, (_, j) => (
    [0, 1, 2].map((i) => c.root[3 * frame + i] + table[3 * (frame * J + j) + i] * shown.unit)));
  const between = (c, table, time) => {
    const f = Math.min(c.frames - 1, Math.floor(time)), g = Math.min(c.frames - 1, f + 1);
    const [a, b] = [at(c, table, f), at(c, table, g)];
    return a.map((p, j) => mix(p, b[j], time - f));
  };

  let clip, time = 0, playing = false, apart = 0, last = null;
  const view = createView(canvas, { yaw: .75, pitch: .16, distance: 400 }, (now) => {
    if (playing && last !== null) time = (time + Math.min(.1, (now - last) / 1000) * shown.fps) % Math.max(1, clip.frames - 1);
    last = playing ? now : null;
    slider.value = time;
    const { paint } = view, body = between(clip, clip.pose, time), guess = between(clip, clip.guess, time);
    const [x, , z] = body[0], yaw = view.orbit.yaw;
    view.aim([x, 82, z]);
    view.land.around([x, 0, z], () => 0);
    const aside = [apart * Math.cos(yaw), -apart * Math.sin(yaw)]; // to the right as seen
    captured.pose((j) => body[j], () => paint.body);
    predicted.pose((j) => [guess[j][0] + aside[0], guess[j][1], guess[j][2] + aside[1]], () => paint.predicted);
    predicted.mesh.castShadow = apart > 0;
    const f = Math.min(clip.frames - 1, Math.round(time));
    const split = clip.split === "held_out" ? "held out: never seen in training" : "a training clip";
    find("compare-reading").replaceChildren(split, document.createElement("br"), `${clip.error[f].toFixed(1)} cm a joint apart`);
    find("compare-clock").textContent = `${(time / shown.fps).toFixed(1)} of ${((clip.frames - 1) / shown.fps).toFixed(1)} s`;
    find("compare-mark").setAttribute("x1", time);
    find("compare-mark").setAttribute("x2", time);
    if (playing) view.ask();
  });
  const captured = createFigure(view, shown.body), predicted = createFigure(view, shown.body, { opacity: .62, casts: false });
  view.onHidden = () => { last = null; };

  const play = (on) => {
    playing = on;
    last = null;
    find("compare-pause").textContent = on ? "Pause" : "Play";
    view.ask();
  };
  const choose = () => {
    clip = unpack(choice.selectedIndex);
    time = 0;
    slider.max = clip.frames - 1;
    const most = Math.max(1, ...clip.error), curve = find("compare-curve");
    curve.closest("svg").setAttribute("viewBox", `0 0 ${clip.frames - 1} 40`);
    curve.setAttribute("d", `M${clip.error.map((e, f) => `${f} ${(39 - 37 * e / most).toFixed(1)}`).join("L")}`);
    find("compare-most").textContent = `${most.toFixed(1)} cm`;
    view.ask();
  };
  const seek = (to) => { play(false); time = Math.min(clip.frames - 1, Math.max(0, to)); view.ask(); };
  slider.addEventListener("input", () => seek(Number(slider.value)));
  choice.addEventListener("change", choose);
  find("compare-pause").addEventListener("click", () => play(!playing));
  find("compare-apart").addEventListener("click", (event) => {
    apart = apart ? 0 : 95;
    event.currentTarget.setAttribute("aria-pressed", String(apart > 0));
    view.ask();
  });
  Object.assign(view.orbit.keys, {
    " ": () => play(!playing), ",": () => seek(Math.ceil(time) - 1), ".": () => seek(Math.floor(time) + 1),
  });
  view.orbit.listen(find("compare-stage"));
  choose();
})();
