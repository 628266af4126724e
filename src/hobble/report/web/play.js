// Play, the section in which the networks run. A report has one character; a comparison has two on the same ground.
import { createActor } from "./actor.js";
import { readAddress, readCamera, readPairs } from "./address.js";
import { bvhText } from "./bvh.js";
import { find, material, save } from "./base.js";
import { createChase } from "./chase.js";
import { addRecorder } from "./film.js";
import { GROUNDS } from "./grounds.js";
import { createPanel } from "./panel.js";
import { createSteering } from "./steering.js";
import { bodyChannel, createSliders } from "./sliders.js";
import { createView } from "./view.js";

const START = { yaw: 3.9, pitch: .2, distance: 430 };
const SIDE = 95; // cm between two figures

const createPlay = (stage, playables) => {
  const canvas = find("play-view"), ground = find("play-ground"), selects = [find("play-first"), find("play-second")];
  const names = Object.keys(playables), player = { actors: [] };
  // due: how many frames have to run; it grows with time. last: time of the last picture, ms, or null. shown: when the readings were last
  // updated, ms. ready: false until the page is set up.
  let panels = [], sliders, last = null, due = 0, shown = 0, ready = false, target = null;
  const currentGround = () => GROUNDS.get(ground.value), groundHeight = (x, z) => currentGround().height(x, z);

  const view = createView(canvas, START, (now) => {
    move(now);
    const middle = [0, 1, 2].map((i) => player.actors.reduce((sum, { rig }) => sum + rig.places[i], 0) / player.actors.length);
    const [vx, vz] = target ? target.velocity : [0, 0], walks = target && !target.facing && Math.hypot(vx, vz) > .5;
    const lookAt = chase.follow(now, middle, walks ? [vx, vz] : null);
    view.aim([lookAt[0], lookAt[1] - 8, lookAt[2]]);
    view.land.drawAround(lookAt, currentGround(), ground.value);
    player.actors.forEach((actor) => actor.draw());
    view.land.darkenUnder(player.actors.flatMap(({ figure }) => figure.balls(view.balls / player.actors.length)));
    if (now - shown > 100) { shown = now; panels.forEach((panel) => panel.update(view.milliseconds)); }
    view.requestDraw();
  });
  const steering = createSteering(stage, view.orbit), chase = createChase(view.orbit, canvas);
  // Runs the frames that are due at time `now`.
  const move = (now) => {
    due = Math.min(4, due + (last === null ? 1 : (now - last) * .06));
    last = now;
    for (; due >= 1; due--) {
      target = steering.target();
      player.actors.forEach((actor) => actor.frame(target, sliders.values));
    }
  };
  view.onHidden = () => { last = null; chase.rest(); steering.release(); };

  const createActors = () => {
    player.actors.forEach(({ figure }) => figure.remove());
    panels.forEach(({ box }) => box.remove());
    const who = selects[0] ? selects.map((select) => select.value) : names, two = who.length > 1;
    player.actors = who.map((name, i) => createActor(view, playables[name], two
      ? { place: [(i ? -1 : 1) * SIDE / 2, 0], tint: i ? "second" : "predicted" } : {}));
    panels = player.actors.map((actor, i) => createPanel(find("play-panel"), actor, two ? who[i] : ""));
    panels.forEach(({ box }, i) => box.classList.toggle("second", two && i === 1));
    start();
  };
  const start = () => {
    player.actors.forEach((actor) => { actor.start(groundHeight); actor.rig.take(actor.character.posePosition, actor.character.poseRotation); });
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

  find("play-inputs").addEventListener("click", (event) => {
    view.inputs = !view.inputs;
    event.currentTarget.setAttribute("aria-pressed", String(view.inputs));
    sliders.say(view.inputs ? "These are inputs of the network. Squares: ground heights, red above the path, blue below it. Needles: joint velocities." : "");
  });
  find("play-reset").addEventListener("click", () => { start(); view.orbit.reset(); });
  ground.addEventListener("change", start);
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
  find("play-picture").addEventListener("click", () => canvas.toBlob((blob) => save(blob, `${fileName(0)}.png`)));
  addRecorder(find("play-film"), canvas, () => fileName(0));

  steering.listen((event) => sliders.key(event));
  sliders = createSliders(Object.values(playables), () => { if (ready) view.requestDraw(); });
  const linked = restore();
  ready = true;
  createActors();
  if (linked) find("play").scrollIntoView();
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
