// Reads the state of Play from a link. Anybody can write a link, so every part is checked.
import { bvhText, createActor, createTicker } from "./actor.js";
import { bodyChannel, find, material, save, valueKey } from "./base.js";
import { startGallery } from "./gallery.js";
import { glbFile } from "./glb.js";
import { GROUNDS } from "./ground.js";
import { createPanel } from "./panel.js";
import { createChase, createView } from "./view.js";

// The values after "#play?" in an address. null if the address has no "#play?".
export const readAddress = (hash) => {
  const [, text = null] = hash.match(/^#play\?(.*)$/s) || [];
  return text === null ? null : new URLSearchParams(text);
};
// Reads a camera from the text "yaw,pitch,distance": {yaw, pitch} in radians and {distance} in cm, moved into the limits of the camera.
// null if the text is not three numbers.
export const readCamera = (text, { nearest = 140, furthest = 1500 } = {}) => {
  const parts = (text || "").split(",");
  if (parts.length !== 3 || !parts.every((part) => /^-?\d+(\.\d+)?$/.test(part.trim()))) return null;
  const [yaw, pitch, distance] = parts.map(Number);
  return {
    yaw: yaw % (2 * Math.PI), pitch: Math.min(1.45, Math.max(.02, pitch)), distance: Math.min(furthest, Math.max(nearest, distance)),
  };
};
// Reads [column, value] pairs from the text "column:value,column:value". Values that are not numbers from 0 to `highest` are left out.
export const readPairs = (text, highest) => (text || "").split(",").flatMap((pair) => {
  const cut = pair.lastIndexOf(":"), value = pair.slice(cut + 1);
  return cut > 0 && /^\d+(\.\d+)?$/.test(value) && Number(value) <= highest ? [[pair.slice(0, cut), Number(value)]] : [];
});

// The channel values in Play. Each column of each channel has a value. Users set values with sliders, presets and keys.

// The channel that the top of the page shows. It is one with parts of the body and a slider, or else the first one with a slider.
export const firstShown = (spec) => {
  const some = spec.channels.filter((channel) => Object.keys(channel.sliders).length);
  return some.find((channel) => channel.regions.length) || some[0];
};

// specs: data of the played characters, which may have different channels. changed(): called after every change.
export const createSliders = (specs, changed) => {
  const channels = [];
  // Of channels with the same name, the one with most trained columns is taken.
  for (const channel of specs.flatMap((spec) => spec.channels)) {
    const at = channels.findIndex(({ name }) => name === channel.name);
    if (at < 0) channels.push(channel);
    else if (channel.trained.length > channels[at].trained.length) channels[at] = channel;
  }
  // The trained columns of a channel in all characters. Other columns were always 0 in training and have no effect, so they are left out.
  const trainedColumns = (name) => specs.flatMap((spec) => spec.channels.filter((channel) => channel.name === name).flatMap((channel) => channel.trained));
  const values = new Map(channels.flatMap((channel) => trainedColumns(channel.name).map((column) => [valueKey(channel, column), channel.start])));
  const rows = [], panel = { values, channels }, columns = (channel) => [...new Set(trainedColumns(channel.name))];
  // The words for a column.
  panel.word = ({ name }, column) => specs.flatMap((spec) => spec.channels.filter((channel) => channel.name === name))
    .map((channel) => channel.spoken[channel.columns.indexOf(column)]).find(Boolean) || column;
  panel.say = (text) => { const note = find("play-note"); if (note) note.textContent = text; };

  const addSlider = (channel, column, label) => {
    const row = document.createElement("label"), name = document.createElement("span");
    const input = document.createElement("input"), output = document.createElement("output"), number = rows.length + 1;
    name.textContent = label;
    if (number < 10) {
      const key = document.createElement("kbd");
      key.textContent = number;
      name.append(" ", key);
    }
    Object.assign(input, { type: "range", min: 0, max: channel.highest, step: channel.sliderStep, value: 0 });
    input.dataset.channel = channel.name;
    input.addEventListener("input", () => { values.set(valueKey(channel, column), Number(input.value)); showValues(); });
    row.append(name, input, output);
    find("play-sliders").append(row);
    rows.push({ input, output, channel, column });
  };
  const hasSlider = (channel, column) => rows.some((row) => row.channel.name === channel.name && row.column === column);
  const setValue = (channel, column, value) => {
    if (!hasSlider(channel, column)) addSlider(channel, column, panel.word(channel, column));
    values.set(valueKey(channel, column), Math.min(channel.highest, Math.max(0, value)));
  };
  const showValues = () => {
    panel.say("");
    rows.forEach(({ input, output, channel, column }) => {
      const value = values.get(valueKey(channel, column));
      input.value = value;
      output.value = channel.highest < 5 ? value.toFixed(2) : value;
    });
    changed();
  };
  // Sets columns to values, and other columns to the start values of their channels. triples: [channel, column, value]. only: if it is a channel, other channels stay as they are.
  panel.set = (triples, only = null) => {
    channels.filter((channel) => !only || channel === only).forEach((channel) => columns(channel).forEach((column) => values.set(valueKey(channel, column), channel.start)));
    triples.forEach(([channel, column, value]) => { if (values.has(valueKey(channel, column)) && value !== channel.start) setValue(channel, column, value); });
    showValues();
  };
  // Changes a value by a fifth of the highest value, after a click or a key. by: 1 or -1.
  panel.change = (channel, column, by) => {
    if (!values.has(valueKey(channel, column))) return;
    setValue(channel, column, Math.round(1e6 * (values.get(valueKey(channel, column)) + by * channel.highest / 5)) / 1e6);
    showValues();
  };
  // Changes the value of a slider after one of the keys 1 to 9. Returns whether the key has a slider.
  panel.key = (event) => {
    const digit = event.code.match(/^Digit([1-9])$/), slider = digit && rows[digit[1] - 1];
    if (slider) panel.change(slider.channel, slider.column, event.shiftKey ? -1 : 1);
    return Boolean(slider);
  };
  // The values for a link, with an entry for each channel that has other values than at the start: its key -> "column:value,column:value".
  panel.state = () => Object.fromEntries(channels.flatMap((channel) => {
    const some = columns(channel).map((column) => [column, values.get(valueKey(channel, column))]).filter(([, value]) => value !== channel.start);
    return some.length ? [[channel.key, some.map(([column, value]) => `${column}:${value}`).join(",")]] : [];
  }));

  const addButton = (text, onClick) => {
    const made = document.createElement("button");
    made.type = "button";
    made.textContent = text;
    made.addEventListener("click", onClick);
    find("play-presets").append(made);
  };
  for (const channel of channels) {
    Object.entries(channel.sliders).forEach(([label, index]) => addSlider(channel, channel.columns[index], label));
    channel.presets.forEach(({ name, values: some }) => addButton(name, () => (
      panel.set(some.map(([index, value]) => [channel, channel.columns[index], value]), channel))));
    if (columns(channel).length) addButton(channel.rest, () => panel.set([], channel));
  }
  showValues();
  return panel;
};

// Computes the target of the character from keys, a gamepad, or a thumb on the disc in the corner of the view.

// Keys are named by their place on the keyboard, not by letter, so that WASD is in the same place on every layout.
// key -> its direction [right, ahead], as the camera sees it
const DIRECTIONS = {
  KeyW: [0, 1], KeyS: [0, -1], KeyA: [-1, 0], KeyD: [1, 0],
  ArrowUp: [0, 1], ArrowDown: [0, -1], ArrowLeft: [-1, 0], ArrowRight: [1, 0],
};
const SPEED = { crouch: 2, walk: 2.5, jog: 7 }; // cm a frame

export const createSteering = (stage, orbit) => {
  // pressed: codes of the keys that are down. stick: where the thumb is on the disc, -1 to 1. on: which buttons are on.
  const pressed = new Set(), stick = { x: 0, y: 0 }, on = { crouch: false, jog: false, strafe: false };
  // byItself: until somebody steers, the character walks straight on, unless the visitor asked for less motion.
  const steering = { on, byItself: !matchMedia("(prefers-reduced-motion: reduce)").matches };

  steering.toggle = (name, value = !on[name]) => {
    on[name] = value;
    if (value && name === "crouch" && on.jog) steering.toggle("jog", false);
    if (value && name === "jog" && on.crouch) steering.toggle("crouch", false);
    find(`play-${name}`).setAttribute("aria-pressed", String(value));
  };
  for (const name of Object.keys(on)) find(`play-${name}`).addEventListener("click", () => steering.toggle(name));

  // The target now: velocity [x, z], facing [x, z] or null, gait or null, in the world. Keys and sticks are relative to the camera.
  steering.target = () => {
    let [right, ahead] = [stick.x, -stick.y], fast = on.jog || pressed.has("ShiftLeft") || pressed.has("ShiftRight"), keepsFacing = on.strafe;
    for (const code of pressed) if (DIRECTIONS[code]) { right += DIRECTIONS[code][0]; ahead += DIRECTIONS[code][1]; }
    const pad = [...(navigator.getGamepads ? navigator.getGamepads() : [])].find((p) => p && p.connected);
    if (pad) {
      const dead = (v) => (Math.abs(v) < .15 ? 0 : v);
      right += dead(pad.axes[0]);
      ahead -= dead(pad.axes[1]);
      fast = fast || pad.buttons[0]?.pressed;
      keepsFacing = keepsFacing || pad.buttons[4]?.pressed;
      orbit.yaw -= .04 * dead(pad.axes[2] || 0);
    }
    const size = Math.hypot(right, ahead);
    if (size) steering.byItself = false;
    if (steering.byItself) return { velocity: [0, SPEED[on.crouch ? "crouch" : fast ? "jog" : "walk"]], facing: null, gait: on.crouch ? "crouch" : fast ? "jog" : "walk" };
    if (size > 1) { right /= size; ahead /= size; }
    const gait = on.crouch ? "crouch" : fast ? "jog" : "walk", { yaw } = orbit;
    const forward = [-Math.sin(yaw), -Math.cos(yaw)], side = [-forward[1], forward[0]];
    const velocity = [0, 1].map((i) => SPEED[gait] * (ahead * forward[i] + right * side[i]));
    return { velocity, facing: keepsFacing ? forward : null, gait: gait === "walk" && !size ? null : gait };
  };
  steering.release = () => pressed.clear();

  // Listens to the keys. onKey(event): called for a key that steering does not use; it returns whether the key had an effect.
  steering.listen = (onKey) => {
    stage.addEventListener("keydown", (event) => {
      if (event.target !== stage || event.ctrlKey || event.metaKey || event.altKey) return;
      if (event.code === "KeyC") { if (!event.repeat) steering.toggle("crouch"); }
      else if (event.code === "KeyF") { if (!event.repeat) steering.toggle("strafe"); }
      else if (event.code === "KeyQ") orbit.turn(.08, 0);
      else if (event.code === "KeyE") orbit.turn(-.08, 0);
      else if (event.code === "Equal") orbit.nearer(.9);
      else if (event.code === "Minus") orbit.nearer(1.1);
      else if (DIRECTIONS[event.code] || event.code.startsWith("Shift")) pressed.add(event.code);
      else if (!onKey(event)) return;
      event.preventDefault();
    });
    stage.addEventListener("keyup", (event) => pressed.delete(event.code));
    stage.addEventListener("blur", () => pressed.clear());
  };

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
  return steering;
};

// Makes a button record a canvas as a film, until it is pressed again. Then the film is saved. name(): the file's name without its ending.

export const addRecorder = (button, canvas, name) => {
  if (!canvas.captureStream || !globalThis.MediaRecorder) { button.hidden = true; return; }
  let recorder = null;
  button.addEventListener("click", () => {
    if (recorder) { recorder.stop(); recorder = null; button.textContent = "Record film"; return; }
    const type = ["video/webm;codecs=vp8", "video/webm", "video/mp4"].find((format) => MediaRecorder.isTypeSupported(format));
    const chunks = [], newRecorder = new MediaRecorder(canvas.captureStream(60), { mimeType: type, videoBitsPerSecond: 8e6 });
    newRecorder.addEventListener("dataavailable", ({ data }) => chunks.push(data));
    newRecorder.addEventListener("stop", () => save(new Blob(chunks, { type }), `${name()}.${type.includes("mp4") ? "mp4" : "webm"}`));
    newRecorder.start();
    recorder = newRecorder;
    button.textContent = "Stop and save";
  });
};

// Play, the section in which the networks run. A report has one character; a comparison has two on the same ground.

const START = { yaw: .62, pitch: .16, distance: 430 }; // from the front, a little from the side
const SIDE = 95; // cm between two figures

const createPlay = (stage, playables) => {
  const canvas = find("play-view"), ground = find("play-ground"), selects = [find("play-first"), find("play-second")];
  const names = Object.keys(playables), player = { actors: [], target: null };
  const ticker = createTicker();
  // shown: when the readings were last updated, ms. ready: false until the page is set up.
  let panels = [], sliders, shown = 0, ready = false;
  const currentGround = () => GROUNDS.get(ground.value), groundHeight = (x, z) => currentGround().height(x, z);

  const view = createView(canvas, START, (now) => {
    for (let n = ticker.frames(now); n > 0; n--) {
      player.target = steering.target();
      player.actors.forEach((actor) => actor.frame(player.target, sliders.values));
    }
    const middle = [0, 1, 2].map((i) => player.actors.reduce((sum, { rig }) => sum + rig.places[i], 0) / player.actors.length);
    const { target } = player, [vx, vz] = target ? target.velocity : [0, 0], walks = target && !steering.byItself && !target.facing && Math.hypot(vx, vz) > .5;
    const lookAt = chase.follow(now, middle, walks ? [vx, vz] : null);
    view.aim([lookAt[0], lookAt[1] - 8, lookAt[2]]);
    view.land.drawAround(lookAt, currentGround(), ground.value);
    player.actors.forEach((actor) => actor.draw());
    view.land.darkenUnder(player.actors.flatMap(({ figure }) => figure.balls(view.balls / player.actors.length)));
    if (now - shown > 100 && find("play-details").open) { shown = now; panels.forEach((panel) => panel.update(view.milliseconds)); }
    view.requestDraw();
  });
  view.framing = { size: 2.1, aside: 0, up: -.02 };
  const steering = createSteering(stage, view.orbit), chase = createChase(view.orbit, canvas);
  view.onHidden = () => { ticker.rest(); chase.rest(); steering.release(); };

  const createActors = () => {
    player.actors.forEach((actor) => actor.remove());
    panels.forEach(({ box }) => box.remove());
    const who = selects[0] ? selects.map((select) => select.value) : names, two = who.length > 1;
    player.actors = who.map((name, i) => createActor(view, playables[name], two
      ? { place: [(i ? -1 : 1) * SIDE / 2, 0], tint: i ? "second" : "predicted" } : {}));
    panels = player.actors.map((actor, i) => createPanel(find("play-panel"), actor, two ? who[i] : ""));
    panels.forEach(({ box }, i) => box.classList.toggle("second", two && i === 1));
    vary();
    start();
  };
  const variation = find("play-variation"), vary = () => player.actors.forEach(({ character }) => character.vary(Number(variation.value), 7));
  const start = () => {
    player.actors.forEach((actor) => actor.start(groundHeight));
    chase.reset();
    view.requestDraw();
  };

  // The state of Play in a link: characters, ground, channel values, buttons that are on, camera.

  const address = () => {
    const { yaw, pitch, distance } = view.orbit, state = { ground: ground.value };
    Object.assign(state, sliders.state());
    for (const name of ["crouch", "jog", "strafe"]) if (steering.on[name]) state[name] = 1;
    if (selects[0]) state.of = selects.map((select) => select.value).join(",");
    state.camera = [yaw.toFixed(2), pitch.toFixed(2), Math.round(distance)].join(",");
    return `#play?${new URLSearchParams(state)}`;
  };
  const restore = () => {
    const state = readAddress(location.hash);
    if (!state) return false;
    if (GROUNDS.has(state.get("ground"))) ground.value = state.get("ground");
    (state.get("of") || "").split(",").forEach((name, i) => {
      if (Object.hasOwn(playables, name) && selects[i]) selects[i].value = name;
    });
    for (const name of ["crouch", "jog", "strafe"]) steering.toggle(name, state.get(name) === "1");
    const linkedCamera = readCamera(state.get("camera"));
    if (linkedCamera) { Object.assign(view.orbit, linkedCamera); chase.touch(); }
    sliders.set(sliders.channels.flatMap((channel) => readPairs(state.get(channel.key), channel.highest).map(([column, value]) => [channel, column, value])));
    return true;
  };

  // A click on a part of the body hurts this part. With Shift, or while the button Heal is on, it heals the part.

  let pressed = null, heals = false;
  find("play-heal")?.addEventListener("click", (event) => {
    heals = !heals;
    event.currentTarget.setAttribute("aria-pressed", String(heals));
  });
  canvas.addEventListener("pointerdown", (event) => { pressed = [event.offsetX, event.offsetY]; stage.focus({ preventScroll: true }); });
  canvas.addEventListener("pointerup", (event) => {
    if (!pressed || Math.hypot(event.offsetX - pressed[0], event.offsetY - pressed[1]) > 5) return;
    const hits = player.actors.map((actor) => ({ actor, found: actor.under(event.offsetX, event.offsetY) })).filter(({ found }) => found);
    if (!hits.length) return;
    const { actor, found } = hits.reduce((best, hit) => (hit.found.deep < best.found.deep ? hit : best));
    const channel = bodyChannel(actor.spec);
    if (!channel) return;
    const trained = found.columns.filter((column) => channel.trained.includes(column)); // columns without training have no effect
    if (trained.length) sliders.change(channel, trained.at(-1), event.shiftKey || heals ? -1 : 1);
    else sliders.say(`${found.columns.length ? sliders.word(channel, found.columns.at(-1)) : "this part"}: ${channel.never}`);
  });

  // Buttons

  find("play-reset").addEventListener("click", () => { start(); view.orbit.reset(); });
  ground.addEventListener("change", start);
  variation.addEventListener("input", vary);
  selects.forEach((select) => select && select.addEventListener("change", createActors));
  find("play-share").addEventListener("click", () => {
    history.replaceState(null, "", address());
    if (navigator.clipboard) navigator.clipboard.writeText(location.href).catch(() => {});
    sliders.say("Link copied. It has the ground, the sliders and the camera. It is also in the address bar.");
  });
  const fileName = (i) => `${names.length > 1 ? selects[i].value : material.name}-played`;
  player.motion = (i = 0) => bvhText(player.actors[i].spec, player.actors[i].frames);
  find("play-bvh").addEventListener("click", () => player.actors.forEach((_, i) => (
    save(new Blob([player.motion(i)], { type: "text/plain" }), `${fileName(i)}.bvh`))));
  find("play-glb").addEventListener("click", () => player.actors.forEach(({ spec, frames }, i) => (
    save(new Blob([glbFile(material.bodies[spec.body], frames)], { type: "model/gltf-binary" }), `${fileName(i)}.glb`))));
  find("play-picture").addEventListener("click", () => canvas.toBlob((blob) => save(blob, `${fileName(0)}.png`)));
  addRecorder(find("play-film"), canvas, () => fileName(0));

  steering.listen((event) => sliders.key(event));
  sliders = createSliders(Object.values(playables), () => { if (ready) view.requestDraw(); });
  const linked = restore();
  ready = true;
  createActors();
  if (linked) find("play").scrollIntoView();
  if (names.length === 1) startGallery(Object.values(playables)[0], (channel, values) => {
    sliders.set(values.map(([column, value]) => [channel, column, value]), channel);
    find("play-stage").scrollIntoView({ block: "center" });
  });
  addEventListener("hashchange", () => { // somebody pasted a link into the open page
    if (!restore()) return;
    createActors();
    find("play").scrollIntoView();
  });
  return Object.assign(player, { chase, sliders, steering, view, start });
};

export let player = null;
export const startPlay = () => {
  const stage = find("play-stage");
  if (stage && Object.keys(material.playable).length) player = createPlay(stage, material.playable);
};
