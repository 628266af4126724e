// Play: the networks run here. One figure in a report of one configuration, two in the same world where two are compared.
import { createActor } from "./actor.js";
import { bvh } from "./bvh.js";
import { find, material, save } from "./base.js";
import { GROUNDS } from "./grounds.js";
import { createInjuries } from "./injuries.js";
import { createPanel } from "./panel.js";
import { createSteering } from "./steering.js";
import { createView } from "./view.js";

const START = { yaw: 3.9, pitch: .24, distance: 470 };
const SIDE = 95; // cm between two figures

const createPlay = (stage, playables) => {
  const canvas = find("play-view"), ground = find("play-ground"), chosen = [find("play-first"), find("play-second")];
  const names = Object.keys(playables), player = { actors: [] };
  let panels = [], injuries, eye = null, last = null, owed = 0, told = 0, ready = false;
  const floor = (x, z) => GROUNDS[ground.value](x, z);

  const view = createView(canvas, START, (now) => {
    move(now);
    const middle = [0, 1, 2].map((i) => player.actors.reduce((sum, { character: c }) => sum + c.pose[i], 0) / player.actors.length);
    eye = eye ? eye.map((v, i) => v + .12 * (middle[i] - v)) : middle;
    view.aim([eye[0], eye[1] - 8, eye[2]]);
    view.land.around(eye, floor, ground.value);
    player.actors.forEach((actor) => actor.draw());
    if (now - told > 100) { told = now; panels.forEach((panel) => panel.tell(view.milliseconds)); }
    view.ask();
  });
  const steering = createSteering(stage, view.orbit);
  const move = (now) => {
    owed = Math.min(4, owed + (last === null ? 1 : (now - last) * .06));
    last = now;
    for (; owed >= 1; owed--) {
      const wish = steering.wish();
      player.actors.forEach((actor) => actor.frame(wish, injuries.severity));
    }
  };
  view.onHidden = () => { last = null; steering.release(); };

  const cast = () => {
    player.actors.forEach(({ figure }) => view.scene.remove(figure.mesh));
    panels.forEach(({ box }) => box.remove());
    const who = chosen[0] ? chosen.map((select) => select.value) : names, two = who.length > 1;
    player.actors = who.map((name, i) => createActor(view, playables[name], two
      ? { place: [(i ? -1 : 1) * SIDE / 2, 0], tint: i ? "second" : "predicted" } : {}));
    panels = player.actors.map((actor, i) => createPanel(find("play-panel"), actor, two ? who[i] : ""));
    panels.forEach(({ box }, i) => box.classList.toggle("second", two && i === 1));
    start();
  };
  const start = () => {
    player.actors.forEach((actor) => actor.start(floor));
    eye = null;
    view.ask();
  };

  // State that a link carries: who is played, the ground, what hurts, how it goes, where the camera is.

  const address = () => {
    const hurt = [...injuries.severity].filter(([, s]) => s > 0).map(([link, s]) => `${link}:${s}`).join(",");
    const { yaw, pitch, distance } = view.orbit, state = { ground: ground.value };
    if (hurt) state.hurt = hurt;
    for (const name of ["crouch", "strafe"]) if (steering.on[name]) state[name] = 1;
    if (chosen[0]) state.of = chosen.map((select) => select.value).join(",");
    state.camera = [yaw.toFixed(2), pitch.toFixed(2), Math.round(distance)].join(",");
    return `#play?${new URLSearchParams(state)}`;
  };
  const restore = () => {
    const [, text] = location.hash.match(/^#play\?(.*)$/) || [];
    const state = new URLSearchParams(text || "");
    if (state.get("ground") in GROUNDS) ground.value = state.get("ground");
    (state.get("of") || "").split(",").forEach((name, i) => { if (name in playables && chosen[i]) chosen[i].value = name; });
    for (const name of ["crouch", "strafe"]) if (state.get(name) === "1") steering.toggle(name, true);
    const [yaw, pitch, distance] = (state.get("camera") || "").split(",").map(Number);
    if ([yaw, pitch, distance].every(Number.isFinite)) {
      Object.assign(view.orbit, { yaw, pitch: Math.min(1.45, Math.max(.02, pitch)), distance: Math.min(1500, Math.max(140, distance)) });
    }
    injuries.set((state.get("hurt") || "").split(",").map((pair) => pair.split(":")).map(([link, s]) => [link, Number(s)]));
    return text !== undefined;
  };

  // Hurting by a click on the body

  let pressed = null;
  canvas.addEventListener("pointerdown", (event) => { pressed = [event.offsetX, event.offsetY]; stage.focus({ preventScroll: true }); });
  canvas.addEventListener("pointerup", (event) => {
    if (!pressed || Math.hypot(event.offsetX - pressed[0], event.offsetY - pressed[1]) > 5) return;
    for (const actor of player.actors) {
      const links = actor.under(event.offsetX, event.offsetY);
      if (!links || !links.length) continue;
      const felt = links.filter((link) => actor.spec.trained.includes(link)); // another would change nothing
      injuries.worse((felt.length ? felt : links).at(-1), event.shiftKey ? -2 : 2);
      return;
    }
  });

  // Buttons

  find("play-reset").addEventListener("click", () => { start(); view.orbit.reset(); });
  ground.addEventListener("change", start);
  chosen.forEach((select) => select && select.addEventListener("change", cast));
  find("play-share").addEventListener("click", (event) => {
    history.replaceState(null, "", address());
    if (navigator.clipboard) navigator.clipboard.writeText(location.href).catch(() => {});
    event.currentTarget.textContent = "The address bar has it";
  });
  const named = (i) => `${names.length > 1 ? chosen[i].value : material.name}-played`;
  player.motion = (i = 0) => bvh(player.actors[i].spec, player.actors[i].frames);
  find("play-bvh").addEventListener("click", () => player.actors.forEach((_, i) => (
    save(new Blob([player.motion(i)], { type: "text/plain" }), `${named(i)}.bvh`))));
  find("play-picture").addEventListener("click", () => canvas.toBlob((blob) => save(blob, `${named(0)}.png`)));
  film(find("play-film"), canvas, () => named(0));

  steering.listen((event) => injuries.key(event));
  injuries = createInjuries(Object.values(playables), () => { if (ready) view.ask(); });
  const asked = restore();
  ready = true;
  cast();
  if (asked) find("play").scrollIntoView();
  return Object.assign(player, { injuries, steering, view, start });
};

// A button that films the canvas until it is pressed again.
const film = (button, canvas, name) => {
  if (!canvas.captureStream || !globalThis.MediaRecorder) { button.hidden = true; return; }
  let recorder = null;
  button.addEventListener("click", () => {
    if (recorder) { recorder.stop(); recorder = null; button.textContent = "Film"; return; }
    const type = ["video/webm;codecs=vp8", "video/webm", "video/mp4"].find((t) => MediaRecorder.isTypeSupported(t));
    const chunks = [], made = new MediaRecorder(canvas.captureStream(60), { mimeType: type, videoBitsPerSecond: 8e6 });
    made.addEventListener("dataavailable", ({ data }) => chunks.push(data));
    made.addEventListener("stop", () => save(new Blob(chunks, { type }), `${name()}.${type.includes("mp4") ? "mp4" : "webm"}`));
    made.start();
    recorder = made;
    button.textContent = "Stop and save";
  });
};

const stage = find("play-stage");
export const player = stage && Object.keys(material.playable).length ? createPlay(stage, material.playable) : null;
