// Plays the scripted walks (scenarios), with footprints, readings and a time slider. In a sweep, a column of a channel rises during the walk.
// A scene, or `s`, is a scenario whose data are unpacked.
import { find, material } from "./base.js";
import { createFigure } from "./figure.js";
import { createMotion } from "./motion.js";
import { bytes } from "./numbers.js";
import { channelColour } from "./paint.js";
import { createView } from "./view.js";

export const startWalks = () => {
  const scenes = material.scenes, stage = document.getElementById("stage");
  if (!stage || !scenes.scenarios || !scenes.scenarios.length) return;
  const slider = find("time"), clock = find("clock"), reading = find("reading"), choice = find("scenario");
  const boneCount = scenes.joints, fps = scenes.fps, unpacked = new Map();

  const unpack = (index) => {
    if (!unpacked.has(index)) {
      const stored = scenes.scenarios[index], unpackBytes = (text) => text && new Uint8Array(bytes(text));
      const scene = {
        ...stored, motion: createMotion(stored, boneCount, scenes.unit),
        contacts: unpackBytes(stored.contacts), phase: unpackBytes(stored.phase), values: unpackBytes(stored.swept?.values),
      };
      scene.focus = cameraTargets(scene);
      scene.prints = findFootprints(scene);
      unpacked.set(index, scene);
    }
    return unpacked.get(index);
  };
  const placeOf = (s, frame, b) => s.motion.at(frame, b);
  // The point that the camera looks at in each frame, three numbers each: the mean position of the root over a second around the frame. So the
  // camera moves smoothly, and a frame always looks the same.
  const cameraTargets = (s) => {
    const half = Math.round(fps / 2), { roots } = s.motion, out = new Float32Array(roots.length);
    for (let f = 0; f < s.frames; f++) {
      const a = Math.max(0, f - half), b = Math.min(s.frames - 1, f + half);
      for (let i = 0; i < 3; i++) {
        let sum = 0;
        for (let k = a; k <= b; k++) sum += roots[3 * k + i];
        out[3 * f + i] = sum / (b - a + 1);
      }
    }
    return out;
  };
  // {frame, heel, toe} of each standing foot in every second frame. A sliding foot leaves overlapping prints.
  const findFootprints = (s) => {
    const out = [];
    if (!s.contacts || !scenes.feet.length) return out;
    for (const [heel, toe, bit] of [[scenes.feet[0], scenes.feet[1], 1], [scenes.feet[2], scenes.feet[3], 3]]) {
      for (let f = 0; f < s.frames; f += 2) {
        if (s.contacts[f] >> bit & 1) out.push({ frame: f, heel: onGround(placeOf(s, f, heel)), toe: onGround(placeOf(s, f, toe)) });
      }
    }
    return out;
  };
  const onGround = ([x, , z]) => [x, 0, z];
  // The value of the swept column as a share of its highest value. The page has it as an integer from 0 to 250.
  const sweptShare = (s, frame) => (s.values ? s.values[frame] / 250 : 0);

  // Drawing

  const view = createView(find("view"), { yaw: .75, pitch: .2, distance: 430 }, (now) => {
    const passed = playing && last !== null ? Math.min(.1, (now - last) / 1000) * fps * rate : 0;
    time = passed ? (time + passed) % Math.max(1, scene.frames - 1) : time;
    last = playing ? now : null;
    slider.value = time;
    drawScene(scene, time);
    if (playing) view.requestDraw();
  });
  const figure = createFigure(view, scenes.body, scenes.regions);
  // How near a point on the ground is to the focus: 1 at the focus, 0 from 8 m on. Marks further away are fainter.
  const nearness = ([x, , z], focus) => Math.max(0, 1 - Math.hypot(x - focus[0], z - focus[2]) / 800);
  const drawPath = (s, focus, frame) => {
    for (let f = 3; f < s.frames; f += 3) {
      const [a, b] = [f - 3, f].map((k) => [s.motion.roots[3 * k], 0, s.motion.roots[3 * k + 2]]);
      view.marks.addStrip(a, b, 1.6, view.paint.accent, (f <= frame ? .6 : .25) * nearness(b, focus));
    }
  };
  const drawPrints = (s, focus, frame) => {
    for (const { frame: f, heel, toe } of s.prints) {
      if (f <= frame) view.marks.addPrint(heel, toe, view.paint.ink, .1 * nearness(toe, focus));
    }
  };
  const drawScene = (s, at) => {
    const frame = Math.min(s.frames - 1, Math.floor(at)), next = Math.min(s.frames - 1, frame + 1), t = at - frame;
    const focus = [0, 1, 2].map((i) => s.focus[3 * frame + i] * (1 - t) + s.focus[3 * next + i] * t);
    view.aim([focus[0], focus[1] - 8, focus[2]]);
    view.land.drawAround(focus);
    if (trails) { drawPath(s, focus, at); drawPrints(s, focus, at); }
    s.motion.show(figure, at);
    figure.pose((columns) => channelColour(view.paint, s.swept?.placed && columns.includes(s.swept.column) ? sweptShare(s, frame) : 0));
    view.land.darkenUnder(figure.balls(view.balls));
    showReadings(s, frame);
  };

  // Readings next to the figure

  const FEET = ["left heel", "left toe", "right heel", "right toe"];
  const showReadings = (s, frame) => {
    const a = Math.max(0, frame - 7), b = Math.min(s.frames - 1, frame + 7), { roots } = s.motion;
    const way = Math.hypot(roots[3 * b] - roots[3 * a], roots[3 * b + 2] - roots[3 * a + 2]);
    const moment = [`${(b > a ? way / 100 * fps / (b - a) : 0).toFixed(2)} m/s`];
    if (s.phase) moment.push(`phase ${(s.phase[frame] / 255).toFixed(2)}`);
    const lines = [moment.join(" · ")];
    if (s.contacts) lines.push(FEET.filter((_, i) => s.contacts[frame] >> i & 1).join(", ") || "no foot on the ground");
    if (sweptShare(s, frame) > 0) lines.push(`${s.swept.spoken}: ${(sweptShare(s, frame) * s.swept.highest).toFixed(s.swept.highest < 5 ? 2 : 1)} of ${s.swept.highest}`);
    const title = document.createElement("b");
    title.textContent = s.description || s.name;
    reading.replaceChildren(title, ...lines.flatMap((text) => [document.createElement("br"), text]));
    clock.textContent = `${(frame / fps).toFixed(1)} of ${((s.frames - 1) / fps).toFixed(1)} s`;
  };

  // Playing

  let scene, time = 0, playing = !matchMedia("(prefers-reduced-motion: reduce)").matches, rate = 1, trails = true, last = null;
  view.onHidden = () => { last = null; };
  const play = (on) => {
    playing = on;
    last = null;
    find("pause").textContent = on ? "Pause" : "Play";
    view.requestDraw();
  };
  const choose = (index) => {
    scene = unpack(index);
    choice.selectedIndex = index;
    time = 0;
    slider.max = scene.frames - 1;
    find("legend").hidden = !(scene.values && scene.swept.placed);
    view.requestDraw();
  };
  const seek = (to) => { play(false); time = Math.min(scene.frames - 1, Math.max(0, to)); view.requestDraw(); };
  const toggle = (event, on) => event.currentTarget.setAttribute("aria-pressed", String(on));

  choice.addEventListener("change", () => choose(choice.selectedIndex));
  slider.addEventListener("input", () => seek(Number(slider.value)));
  find("pause").addEventListener("click", () => play(!playing));
  find("slow").addEventListener("click", (event) => { rate = rate === 1 ? .25 : 1; toggle(event, rate !== 1); });
  find("trails").addEventListener("click", (event) => { trails = !trails; toggle(event, trails); view.requestDraw(); });
  find("view-reset").addEventListener("click", view.orbit.reset);
  Object.assign(view.orbit.keys, {
    " ": () => play(!playing), ",": () => seek(Math.ceil(time) - 1), ".": () => seek(Math.floor(time) + 1),
    n: () => choose((choice.selectedIndex + 1) % scenes.scenarios.length),
  });
  view.orbit.listen(stage);
  choose(0);
  play(playing);
};
