// The figure walking: motion that lies in the page, played with footprints, readings and a scrubber.
import { find, material } from "./base.js";
import { bytes, mix } from "./numbers.js";
import { bodyParts, createView, css, severityColour } from "./view.js";

(() => {
  const scenes = material.scenes, stage = document.getElementById("stage");
  if (!stage || !scenes.scenarios || !scenes.scenarios.length) return;
  const slider = find("time"), clock = find("clock"), reading = find("reading"), choice = find("scenario");
  const J = scenes.joints, fps = scenes.fps, L = scenes.links.length, unpacked = new Map();

  const unpack = (index) => {
    if (!unpacked.has(index)) {
      const s = scenes.scenarios[index], octets = (text) => text && new Uint8Array(bytes(text));
      const scene = {
        ...s, root: new Float32Array(bytes(s.root)), pose: new Int16Array(bytes(s.pose)),
        contacts: octets(s.contacts), phase: octets(s.phase), severity: octets(s.severity),
      };
      scene.focus = followed(scene);
      scene.prints = footprints(scene);
      unpacked.set(index, scene);
    }
    return unpacked.get(index);
  };
  const joint = (s, frame, j) => {
    const r = 3 * frame, p = 3 * (frame * J + j);
    return [0, 1, 2].map((i) => s.root[r + i] + s.pose[p + i] * scenes.unit);
  };
  // Where the camera looks: the root over the second around a frame, so that it glides and scrubbing is repeatable.
  const followed = (s) => {
    const half = Math.round(fps / 2), out = new Float32Array(s.root.length);
    for (let f = 0; f < s.frames; f++) {
      const a = Math.max(0, f - half), b = Math.min(s.frames - 1, f + half);
      for (let i = 0; i < 3; i++) {
        let sum = 0;
        for (let k = a; k <= b; k++) sum += s.root[3 * k + i];
        out[3 * f + i] = sum / (b - a + 1);
      }
    }
    return out;
  };
  // {first, path}: the way on the ground of every heel and toe while it stands.
  const footprints = (s) => {
    const out = [];
    if (!s.contacts) return out;
    scenes.feet.forEach((j, bit) => {
      let path = null;
      for (let f = 0; f < s.frames; f++) {
        if (!(s.contacts[f] >> bit & 1)) { path = null; continue; }
        if (!path) out.push({ first: f, path: path = [] });
        const [x, , z] = joint(s, f, j);
        path.push([x, 0, z]);
      }
    });
    return out;
  };
  const severity = (s, frame, links) => {
    if (!s.severity) return 0;
    return Math.max(0, ...links.map((l) => s.severity[frame * L + l])) / 25;
  };

  // Drawing

  const floor = () => 0;
  const drawGround = (view, focus) => {
    const reach = 900, step = 100, { context, paint } = view;
    const fade = (x, z) => .5 * Math.max(0, 1 - Math.hypot(x - focus[0], z - focus[2]) / reach) ** 1.4;
    const x0 = Math.ceil((focus[0] - reach) / step) * step, z0 = Math.ceil((focus[2] - reach) / step) * step;
    context.lineWidth = 1;
    for (let x = x0; x <= focus[0] + reach; x += step) {
      for (let z = z0; z <= focus[2] + reach; z += step) {
        view.segment([x, 0, z], [x, 0, z + step], paint.line, fade(x, z + step / 2));
        view.segment([x, 0, z], [x + step, 0, z], paint.line, fade(x + step / 2, z));
      }
    }
  };
  const drawPath = (view, s, focus, frame) => {
    view.context.lineWidth = 1.5;
    for (let f = 3; f < s.frames; f += 3) {
      const [x, z, px, pz] = [s.root[3 * f], s.root[3 * f + 2], s.root[3 * f - 9], s.root[3 * f - 7]];
      const near = 1 - Math.hypot(x - focus[0], z - focus[2]) / 800;
      if (near > 0) view.segment([px, 0, pz], [x, 0, z], view.paint.accent, (f <= frame ? .55 : .2) * near);
    }
  };
  const drawPrints = (view, s, focus, frame) => {
    const { context } = view;
    context.lineCap = context.lineJoin = "round";
    for (const print of s.prints) {
      const near = 1 - Math.hypot(print.path[0][0] - focus[0], print.path[0][2] - focus[2]) / 800;
      if (print.first > frame || near <= 0) continue;
      const points = print.path.slice(0, Math.floor(frame) - print.first + 1).map(view.project);
      if (points.some((p) => p[2] < 20)) continue;
      context.strokeStyle = css(view.paint.ink, .34 * near);
      context.lineWidth = Math.max(1.5, view.zoom * 6 / points[0][2]);
      context.beginPath();
      context.moveTo(points[0][0], points[0][1]);
      points.forEach((p) => context.lineTo(p[0], p[1] + .01));
      context.stroke();
    }
    context.lineCap = "butt";
  };
  const drawScene = (view, s, at) => {
    const frame = Math.min(s.frames - 1, Math.floor(at)), next = Math.min(s.frames - 1, frame + 1), t = at - frame;
    const focus = [0, 1, 2].map((i) => s.focus[3 * frame + i] * (1 - t) + s.focus[3 * next + i] * t);
    view.aim([focus[0], focus[1] - 8, focus[2]]);
    drawGround(view, focus);
    if (trails) { drawPath(view, s, focus, at); drawPrints(view, s, focus, at); }
    const points = [];
    for (let j = 0; j < J; j++) points.push(mix(joint(s, frame, j), joint(s, next, j), t));
    const colour = (links) => severityColour(view.paint, severity(s, frame, links));
    const parts = bodyParts(scenes.capsules, points, floor, colour);
    view.shadow(parts, floor);
    view.body(parts);
    tell(s, frame);
  };

  // What is read off beside the figure

  const FEET = ["left heel", "left toe", "right heel", "right toe"];
  const tell = (s, frame) => {
    const a = Math.max(0, frame - 7), b = Math.min(s.frames - 1, frame + 7);
    const way = Math.hypot(s.root[3 * b] - s.root[3 * a], s.root[3 * b + 2] - s.root[3 * a + 2]);
    const moment = [`${(b > a ? way / 100 * fps / (b - a) : 0).toFixed(2)} m/s`];
    if (s.phase) moment.push(`phase ${(s.phase[frame] / 255).toFixed(2)}`);
    const lines = [moment.join(" · ")];
    if (s.contacts) lines.push(FEET.filter((_, i) => s.contacts[frame] >> i & 1).join(", ") || "in the air");
    const hurt = scenes.links.map((name, l) => [name, severity(s, frame, [l])]).filter(([, much]) => much > 0);
    hurt.slice(0, 4).forEach(([name, much]) => lines.push(`${name}: ${much.toFixed(1)} of 10`));
    const title = document.createElement("b");
    title.textContent = s.description || s.name;
    reading.replaceChildren(title, ...lines.flatMap((text) => [document.createElement("br"), text]));
    clock.textContent = `${(frame / fps).toFixed(1)} of ${((s.frames - 1) / fps).toFixed(1)} s`;
  };

  // Playing

  let scene, time = 0, playing = !matchMedia("(prefers-reduced-motion: reduce)").matches, rate = 1, trails = true, last = null;
  const view = createView(find("view"), { yaw: .75, pitch: .2, distance: 430 }, (now) => {
    const passed = playing && last !== null ? Math.min(.1, (now - last) / 1000) * fps * rate : 0;
    time = passed ? (time + passed) % Math.max(1, scene.frames - 1) : time;
    last = playing ? now : null;
    slider.value = time;
    drawScene(view, scene, time);
    if (playing) view.ask();
  });
  view.onHidden = () => { last = null; };
  const play = (on) => {
    playing = on;
    last = null;
    find("pause").textContent = on ? "Pause" : "Play";
    view.ask();
  };
  const choose = (index) => {
    scene = unpack(index);
    choice.selectedIndex = index;
    time = 0;
    slider.max = scene.frames - 1;
    find("legend").hidden = !(scene.severity && scene.severity.some((s) => s > 0));
    view.ask();
  };
  const seek = (to) => { play(false); time = Math.min(scene.frames - 1, Math.max(0, to)); view.ask(); };
  const toggle = (event, on) => event.currentTarget.setAttribute("aria-pressed", String(on));

  choice.addEventListener("change", () => choose(choice.selectedIndex));
  slider.addEventListener("input", () => seek(Number(slider.value)));
  find("pause").addEventListener("click", () => play(!playing));
  find("slow").addEventListener("click", (event) => { rate = rate === 1 ? .25 : 1; toggle(event, rate !== 1); });
  find("trails").addEventListener("click", (event) => { trails = !trails; toggle(event, trails); view.ask(); });
  find("view-reset").addEventListener("click", view.reset);
  Object.assign(view.keys, {
    " ": () => play(!playing), ",": () => seek(Math.ceil(time) - 1), ".": () => seek(Math.floor(time) + 1),
    n: () => choose((choice.selectedIndex + 1) % scenes.scenarios.length),
  });
  view.listen(stage);
  choose(0);
  play(playing);
})();
