// Play: the network runs here. Keys, a gamepad or a finger say where to go; parts of the body can be hurt.
import { find, material } from "./base.js";
import { createCharacter } from "./character.js";
import { bodyParts, createView, severityColour } from "./view.js";

export let player = null;

(() => {
  const spec = material.playable, stage = document.getElementById("play-stage");
  if (!stage || !spec || !spec.layers) return;
  const readings = find("play-reading"), ground = find("play-ground"), L = spec.links.length;
  const GROUNDS = {
    flat: () => 0,
    rolling: (x, z) => 14 * Math.sin(x / 170) * Math.cos(z / 140) + 8 * Math.sin((x + z) / 260),
    slope: (x, z) => .14 * z,
    steps: (x, z) => 12 * Math.round(z / 110),
  };
  const floor = (x, z) => GROUNDS[ground.value](x, z);
  let character, trail = [], milliseconds = 0, fall = 0;

  // State that a link carries: what hurts, and the ground.

  const severities = new Array(L).fill(0);
  const share = () => {
    const hurt = severities.map((s, l) => [l, s]).filter(([, s]) => s > 0).map(([l, s]) => `${l}:${s}`).join(",");
    return `#play=${[ground.value, hurt].filter(Boolean).join(";")}`;
  };
  const restore = () => {
    const [, text] = location.hash.match(/^#play=([\w:.,;-]*)$/) || [];
    if (!text) return;
    const [name, hurt = ""] = text.split(";");
    if (name in GROUNDS) ground.value = name;
    for (const pair of hurt.split(",")) {
      const [l, s] = pair.split(":").map(Number);
      if (l >= 0 && l < L && s >= 0 && s <= 10) severities[l] = s;
    }
  };
  const start = () => {
    character = createCharacter(spec);
    trail = [];
    hurt();
  };
  const hurt = () => {
    if (character) severities.forEach((s, l) => { character.wished[l] = s / spec.severityScale; });
    sliders.forEach(({ input, output, link }) => { input.value = output.value = severities[link]; });
    if (view) view.ask();
  };
  const worse = (link, by) => {
    severities[link] = Math.min(10, Math.max(0, severities[link] + by));
    if (!sliders.some((slider) => slider.link === link)) addSlider(link, spec.links[link]);
    hurt();
  };

  // What is asked for

  const held = new Set(), stick = { x: 0, y: 0 };
  const CODES = { KeyW: [0, 1], KeyS: [0, -1], KeyA: [-1, 0], KeyD: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1], ArrowLeft: [-1, 0], ArrowRight: [1, 0] };
  let crouching = false, strafing = false;
  const wish = () => {
    let [right, ahead] = [stick.x, -stick.y], fast = held.has("ShiftLeft") || held.has("ShiftRight"), look = strafing;
    for (const code of held) if (CODES[code]) { right += CODES[code][0]; ahead += CODES[code][1]; }
    const pad = [...(navigator.getGamepads ? navigator.getGamepads() : [])].find((p) => p && p.connected);
    if (pad) {
      const dead = (v) => (Math.abs(v) < .15 ? 0 : v);
      right += dead(pad.axes[0]);
      ahead -= dead(pad.axes[1]);
      fast = fast || pad.buttons[0]?.pressed;
      look = look || pad.buttons[4]?.pressed;
      view.camera.yaw -= .04 * dead(pad.axes[2] || 0);
    }
    const size = Math.hypot(right, ahead);
    if (size > 1) { right /= size; ahead /= size; }
    const speed = crouching ? 2 : fast ? 7 : 2.5, { yaw } = view.camera;
    const forward = [-Math.sin(yaw), -Math.cos(yaw)], side = [-forward[1], forward[0]];
    const velocity = [0, 1].map((i) => speed * (ahead * forward[i] + right * side[i]));
    return { velocity, ahead: look ? forward : null, gait: crouching ? "crouch" : fast ? "jog" : size ? "walk" : null };
  };

  // Drawing

  const drawGround = (view, centre) => {
    const reach = 1000, step = 100, { context, paint } = view, piece = ground.value === "flat" ? step : step / 4;
    const fade = (x, z) => .5 * Math.max(0, 1 - Math.hypot(x - centre[0], z - centre[2]) / reach) ** 1.4;
    const point = (x, z) => [x, floor(x, z), z];
    const from = [0, 2].map((i) => Math.ceil((centre[i] - reach) / step) * step);
    context.lineWidth = 1;
    for (let n = 0; n <= 2 * reach; n += step) {
      for (let m = 0; m <= 2 * reach; m += piece) {
        let [x, z] = [from[0] + n, from[1] + m];
        view.segment(point(x, z), point(x, z + piece), paint.line, fade(x, z + piece / 2));
        [x, z] = [from[0] + m, from[1] + n];
        view.segment(point(x, z), point(x + piece, z), paint.line, fade(x + piece / 2, z));
      }
    }
  };
  const drawTrails = (view) => {
    const c = character, { context, paint } = view;
    context.lineWidth = 5;
    context.lineCap = "round";
    for (const { from, to, age } of trail) view.segment(from, to, paint.ink, .35 * (1 - age / 360));
    context.lineCap = "butt";
    context.lineWidth = 2;
    for (let i = 5; i < c.px.length; i += 5) {
      const [a, b] = [i - 5, i].map((t) => [c.px[t], floor(c.px[t], c.pz[t]), c.pz[t]]);
      view.segment(a, b, paint.accent, i > c.px.length / 2 ? .8 : .3);
    }
  };
  const sole = (j) => {
    const [x, z] = [character.pose[3 * j], character.pose[3 * j + 2]];
    return [x, floor(x, z), z];
  };
  const posed = () => {
    const points = [];
    for (let j = 0; j < spec.joints; j++) points.push(Array.from(character.pose.subarray(3 * j, 3 * j + 3)));
    return points;
  };
  const parts = (paint) => bodyParts(spec.capsules, posed(), floor, (links) => {
    const most = Math.max(0, ...links.map((l) => character.severity[l])) * spec.severityScale;
    return severityColour(paint, most);
  });
  const stood = [false, false];
  let eye = null, last = null, owed = 0, told = 0;
  const move = (now) => {
    owed = Math.min(4, owed + (last === null ? 1 : (now - last) * .06));
    last = now;
    for (; owed >= 1; owed--) {
      const before = performance.now(), { velocity, ahead, gait } = wish();
      character.frame(velocity, ahead, gait, floor);
      milliseconds += .05 * (performance.now() - before - milliseconds);
      trail.forEach((print) => { print.age++; });
      trail = trail.filter((print) => print.age < 360);
      spec.legs.forEach(([, , heel, toe], f) => {
        const down = character.lock[f] === 1;
        if (down && !stood[f]) trail.push({ from: sole(heel), to: sole(toe), age: 0 });
        stood[f] = down;
      });
      if (!character.pose.every(Number.isFinite)) { fall++; start(); } // a network that has learnt nothing runs away
    }
  };
  const view = createView(find("play-view"), { yaw: 3.9, pitch: .24, distance: 470 }, (now) => {
    move(now);
    const at = character.pose;
    eye = eye ? eye.map((v, i) => v + .12 * (at[i] - v)) : Array.from(at.subarray(0, 3));
    view.aim([eye[0], eye[1] - 8, eye[2]]);
    drawGround(view, eye);
    drawTrails(view);
    const body = parts(view.paint);
    view.shadow(body, floor);
    view.body(body);
    if (now - told > 100) { told = now; tell(); }
    view.ask();
  });
  view.onHidden = () => { last = null; held.clear(); };

  const FEET = ["left heel", "left toe", "right heel", "right toe"];
  const tell = () => {
    const c = character, M = spec.window, G = spec.gaits.length;
    const shares = spec.gaits.map((name, g) => [name, c.gait[M * G + g]]).filter(([, s]) => s > .05);
    const speed = Math.hypot(c.px[M] - c.px[M - 10], c.pz[M] - c.pz[M - 10]) * 6 / 100;
    const lines = [
      `${speed.toFixed(2)} m/s · phase ${c.phase.toFixed(2)}`,
      shares.map(([name, s]) => `${name} ${Math.round(100 * s)} %`).join(", "),
      FEET.filter((_, i) => c.contacts[i] > .5).join(", ") || "in the air",
      `${milliseconds.toFixed(1)} ms a frame`,
    ];
    if (fall) lines.push(`fell over ${fall} times and stood up again`);
    readings.replaceChildren(...lines.flatMap((text, i) => (i ? [document.createElement("br"), text] : [text])));
  };

  // Injuries: sliders, presets, keys, and a click on the body

  const sliders = [];
  const addSlider = (link, label) => {
    const row = document.createElement("label"), name = document.createElement("span");
    const input = document.createElement("input"), output = document.createElement("output");
    const number = sliders.length + 1;
    name.textContent = label;
    if (number < 10) {
      const key = document.createElement("kbd");
      key.textContent = number;
      name.append(" ", key);
    }
    Object.assign(input, { type: "range", min: 0, max: 10, step: 1, value: severities[link] });
    input.addEventListener("input", () => { severities[link] = Number(input.value); hurt(); });
    row.append(name, input, output);
    find("play-sliders").append(row);
    sliders.push({ input, output, link });
  };
  Object.entries(spec.parts).forEach(([label, link]) => addSlider(link, label));
  const button = (text, act) => {
    const made = document.createElement("button");
    made.type = "button";
    made.textContent = text;
    made.addEventListener("click", act);
    find("play-presets").append(made);
  };
  spec.presets.forEach(({ name, severities: values }) => button(name, () => {
    severities.fill(0);
    values.forEach(([link, value]) => { severities[link] = value; });
    hurt();
  }));
  if (L) button("Healthy", () => { severities.fill(0); hurt(); });
  const hit = (x, y) => {
    let best = null;
    for (const [i, part] of parts(view.paint).entries()) {
      const p = view.project(part.a), q = view.project(part.b), way = [q[0] - p[0], q[1] - p[1]];
      const t = Math.min(1, Math.max(0, ((x - p[0]) * way[0] + (y - p[1]) * way[1]) / (way[0] ** 2 + way[1] ** 2 || 1)));
      const off = Math.hypot(x - p[0] - t * way[0], y - p[1] - t * way[1]), deep = p[2] + t * (q[2] - p[2]);
      if (off <= view.zoom * Math.max(part.ra, part.rb) / deep && (!best || deep < best.deep)) best = { i, deep };
    }
    return best && spec.capsules[best.i].links.at(-1);
  };
  let pressed = null;
  find("play-view").addEventListener("pointerdown", (event) => { pressed = [event.offsetX, event.offsetY]; stage.focus(); });
  find("play-view").addEventListener("pointerup", (event) => {
    if (!pressed || Math.hypot(event.offsetX - pressed[0], event.offsetY - pressed[1]) > 5) return;
    const link = hit(event.offsetX, event.offsetY);
    if (link !== undefined && link !== null) worse(link, event.shiftKey ? -2 : 2);
  });

  // Keys: by place and not by letter, so that they lie alike on every keyboard.

  stage.addEventListener("keydown", (event) => {
    if (event.target !== stage || event.ctrlKey || event.metaKey || event.altKey) return;
    const digit = event.code.match(/^Digit([1-9])$/), slider = digit && sliders[digit[1] - 1];
    if (slider) worse(slider.link, event.shiftKey ? -2 : 2);
    else if (event.code === "KeyC" && !event.repeat) toggle("play-crouch");
    else if (event.code === "KeyF" && !event.repeat) toggle("play-strafe");
    else if (event.code === "KeyQ") view.turn(.08, 0);
    else if (event.code === "KeyE") view.turn(-.08, 0);
    else if (event.code === "Equal") view.nearer(.9);
    else if (event.code === "Minus") view.nearer(1.1);
    else if (CODES[event.code] || event.code.startsWith("Shift")) held.add(event.code);
    else return;
    event.preventDefault();
  });
  stage.addEventListener("keyup", (event) => held.delete(event.code));
  stage.addEventListener("blur", () => held.clear());
  const toggle = (id) => {
    const on = find(id).getAttribute("aria-pressed") !== "true";
    find(id).setAttribute("aria-pressed", String(on));
    if (id === "play-crouch") crouching = on; else strafing = on;
  };
  for (const id of ["play-crouch", "play-strafe"]) find(id).addEventListener("click", () => toggle(id));
  find("play-reset").addEventListener("click", () => { eye = null; start(); view.reset(); });
  ground.addEventListener("change", () => { eye = null; start(); });
  find("play-share").addEventListener("click", (event) => {
    history.replaceState(null, "", share());
    if (navigator.clipboard) navigator.clipboard.writeText(location.href).catch(() => {});
    event.currentTarget.textContent = "The address bar has it";
  });

  // A stick for the thumb

  const pad = find("play-pad");
  const steer = (event) => {
    const box = pad.getBoundingClientRect(), r = box.width / 2;
    const [x, y] = [(event.clientX - box.x - r) / r, (event.clientY - box.y - r) / r], n = Math.max(1, Math.hypot(x, y));
    Object.assign(stick, { x: x / n, y: y / n });
    pad.firstElementChild.style.translate = `${stick.x * r * .6}px ${stick.y * r * .6}px`;
  };
  const release = () => { Object.assign(stick, { x: 0, y: 0 }); pad.firstElementChild.style.translate = ""; };
  pad.addEventListener("pointerdown", (event) => { pad.setPointerCapture(event.pointerId); steer(event); });
  pad.addEventListener("pointermove", (event) => { if (pad.hasPointerCapture(event.pointerId)) steer(event); });
  for (const name of ["pointerup", "pointercancel"]) pad.addEventListener(name, release);

  player = { get character() { return character; }, severities, start, view };
  restore();
  start();
  if (location.hash.startsWith("#play=")) find("play").scrollIntoView();
})();
