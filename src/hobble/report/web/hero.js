// A dial with whole values from 0 to `most`. It is drawn as an arc. People turn it by dragging, clicking or pressing keys.
import { createActor } from "./actor.js";
import { find, material, valueKey } from "./base.js";
import { firstShown } from "./play.js";
import { createView } from "./view.js";

const NS = "http://www.w3.org/2000/svg";
const FROM = -130, SWEEP = 260; // where the arc starts and how far it goes, degrees clockwise from the top
const R = 46; // radius of the arc in units of the viewBox; its centre is at (60, 60)

// The point [x, y] on the arc at the share `turn` of its length.
const arcPoint = (turn) => {
  const angle = (FROM + SWEEP * turn - 90) * Math.PI / 180;
  return [60 + R * Math.cos(angle), 60 + R * Math.sin(angle)];
};
// The SVG path of the arc between two shares of its length.
const arcPath = (from, to) => {
  const [a, b] = [arcPoint(from), arcPoint(to)];
  return `M${a[0].toFixed(2)} ${a[1].toFixed(2)}A${R} ${R} 0 ${SWEEP * (to - from) > 180 ? 1 : 0} 1 ${b[0].toFixed(2)} ${b[1].toFixed(2)}`;
};

// host: an element with the role "slider", into which the dial is drawn. value: at the start. changed(value): called when a person has turned the
// dial, but not by `set`.
export const createDial = (host, { most = 10, value = 0, changed }) => {
  const svg = document.createElementNS(NS, "svg"), parts = {};
  svg.setAttribute("viewBox", "0 0 120 108");
  svg.setAttribute("aria-hidden", "true");
  for (const [name, tag] of [["track", "path"], ["fill", "path"], ["knob", "circle"], ["number", "text"], ["unit", "text"]]) {
    parts[name] = document.createElementNS(NS, tag);
    parts[name].setAttribute("class", name);
    svg.append(parts[name]);
  }
  parts.track.setAttribute("d", arcPath(0, 1));
  parts.knob.setAttribute("r", 7);
  for (const [name, y, text] of [["number", 70, ""], ["unit", 90, `of ${most}`]]) {
    parts[name].setAttribute("x", 60);
    parts[name].setAttribute("y", y);
    parts[name].textContent = text;
  }
  host.replaceChildren(svg);
  host.setAttribute("aria-valuemin", 0);
  host.setAttribute("aria-valuemax", most);

  const dial = {
    value,
    set(to) {
      dial.value = Math.min(most, Math.max(0, Math.round(to)));
      const turn = dial.value / most, [x, y] = arcPoint(turn);
      parts.fill.setAttribute("d", turn ? arcPath(0, turn) : "");
      parts.knob.setAttribute("cx", x);
      parts.knob.setAttribute("cy", y);
      parts.number.textContent = dial.value;
      host.setAttribute("aria-valuenow", dial.value);
      host.style.setProperty("--turn", turn);
    },
  };
  const turnTo = (to) => {
    const before = dial.value;
    dial.set(to);
    if (dial.value !== before) changed(dial.value);
  };
  const turnToPointer = (event) => {
    const box = svg.getBoundingClientRect(), scale = 120 / box.width;
    const [x, y] = [(event.clientX - box.x) * scale - 60, (event.clientY - box.y) * scale - 60];
    const degrees = Math.atan2(x, -y) * 180 / Math.PI;
    turnTo(most * Math.min(1, Math.max(0, (degrees - FROM) / SWEEP)));
  };
  host.addEventListener("pointerdown", (event) => { host.setPointerCapture(event.pointerId); turnToPointer(event); });
  host.addEventListener("pointermove", (event) => { if (host.hasPointerCapture(event.pointerId)) turnToPointer(event); });
  const keySteps = {
    ArrowUp: 1, ArrowRight: 1, ArrowDown: -1, ArrowLeft: -1, PageUp: 3, PageDown: -3, Home: -most, End: most,
  };
  host.addEventListener("keydown", (event) => {
    if (!(event.key in keySteps) || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    turnTo(dial.value + keySteps[event.key]);
  });
  dial.set(value);
  return dial;
};

// The top of the page. A character walks with a value above 0 in one column of a channel. Next to it walks a transparent character
// with all values 0 and the same target.

const GHOST_OFFSET = -84; // cm from the solid character to the transparent one; negative: to the right
const MOST_AHEAD = 120; // cm: if the transparent character is further ahead or behind, it is moved back
const FADE = 24; // frames in which the transparent character fades out before this move, and fades in after it
const SPEED = 2.5; // target speed, cm per frame

const createHero = (spec, opening) => {
  const section = find("hero"), canvas = find("hero-view"), line = find("hero-line"), button = find("hero-walk");
  const channel = firstShown(spec), labels = channel ? Object.keys(channel.sliders) : [];
  const values = new Map(), neutralValues = new Map(), flat = () => 0, hero = { frames: 0 };
  let resolveShown;
  hero.shown = new Promise((done) => { resolveShown = done; }); // resolved when the figure has moved, or, if it rests, has been drawn
  // part: label of the slider that the dial sets. last: time of the last picture, ms, or null. due: how many frames have to run. shown: when the
  // speeds were last shown, ms. fade: opacity of the transparent character. leaving: whether it fades out. camera: the point [x, z] to look
  // at and the yaw of the path, or null.
  let part = labels.includes(opening.part) ? opening.part : labels[0];
  let last = null, due = 0, shown = 0, fade = 1, leaving = false, camera = null, walks = !matchMedia("(prefers-reduced-motion: reduce)").matches;

  // The target direction of both characters, as yaw in radians. It turns slowly from side to side.
  const heading = () => .5 * Math.sin(hero.frames / 700);
  const target = () => ({ velocity: [SPEED * Math.sin(heading()), SPEED * Math.cos(heading())], facing: null, gait: "walk" });
  const view = createView(canvas, { yaw: .62, pitch: .1, distance: 460, nearest: 240, furthest: 800 }, (now) => {
    if (walks) advance(now);
    draw(now);
    if (!walks || hero.frames) resolveShown();
    if (walks) view.requestDraw();
  });
  view.onHidden = () => { last = null; };
  const main = createActor(view, spec), ghost = channel ? createActor(view, spec, { place: [GHOST_OFFSET, 0], tint: "ghost", ghost: true }) : null;
  // The vector [x, z] from the solid character to the place of the transparent one.
  const aside = () => [GHOST_OFFSET * Math.cos(heading()), -GHOST_OFFSET * Math.sin(heading())];

  const step = () => {
    hero.frames++;
    main.frame(target(), values);
    if (!ghost) return;
    ghost.frame(target(), neutralValues);
    const [sin, cos] = [Math.sin(heading()), Math.cos(heading())], [from, to] = [main.character.root, ghost.character.root];
    const [dx, dz] = [to[0] - from[0], to[2] - from[2]], along = dx * sin + dz * cos, across = dx * cos - dz * sin;
    if (!leaving && (Math.abs(along) > MOST_AHEAD || Math.abs(across - GHOST_OFFSET) > 70)) leaving = true;
    fade = Math.min(1, Math.max(0, fade + (leaving ? -1 : 1) / FADE));
    if (leaving && fade === 0) {
      const [x, z] = aside();
      ghost.character.follow(ghost.character, [from[0] + x - to[0], from[2] + z - to[2]]);
      ghost.rig.take(ghost.character.posePosition, ghost.character.poseRotation);
      leaving = false;
    }
  };
  const advance = (now) => {
    due = Math.min(3, due + (last === null ? 1 : (now - last) * .06));
    const passed = last === null ? 0 : now - last;
    last = now;
    for (; due >= 1; due--) step();
    glide(1 - Math.exp(-passed / 350));
  };
  // Moves the camera by a share of the way to its goal. It follows the root on the path, not the hips, because the hips move up and down.
  const glide = (share) => {
    const { root } = main.character, [x, z] = ghost ? aside().map((v) => v / 2) : [0, 0], goal = [root[0] + x, root[2] + z, heading()];
    camera = camera ? camera.map((v, i) => v + share * (goal[i] - v)) : goal;
  };
  const draw = (now) => {
    const wide = view.W > 900;
    view.framing = wide ? { size: 2.05, aside: .17, up: -.015 } : { size: 1.72, aside: 0, up: -.03 };
    const [x, z, turn] = camera, { yaw } = view.orbit;
    view.orbit.yaw = yaw + turn;
    view.aim([x, 84, z]);
    view.orbit.yaw = yaw;
    view.land.drawAround([x, 0, z]);
    main.draw(false);
    if (ghost) { ghost.draw(null); ghost.figure.show(fade > .01, fade); }
    view.land.darkenUnder(main.figure.balls(view.balls));
    if (now - shown > 250) { shown = now; showPace(); }
  };
  // The mean speed over the last 50 frames, m/s.
  const pace = ({ character: c }) => {
    const M = spec.window;
    return Math.hypot(c.px[M] - c.px[M - 50], c.pz[M] - c.pz[M - 50]) * 60 / 50 / 100;
  };
  const showPace = () => {
    find("hero-pace").textContent = `${pace(main).toFixed(2)} m/s`;
    if (ghost) find("hero-ghost").textContent = `${pace(ghost).toFixed(2)} m/s`;
  };

  if (channel) {
    const [before, after] = channel.says.split("{}");
    const words = { part: document.createElement("b"), much: document.createElement("b") };
    const say = () => {
      words.part.textContent = part;
      words.much.textContent = `${dial.value} of 10`;
      if (!channel.on) find("hero-on").textContent = part;
      const beginning = "One neural network moves both figures at the same target speed, "; // the whole text is one sentence
      if (dial.value) line.replaceChildren(`${beginning}and the input for the solid one says ${before}`, words.part, `${after}, `, words.much, ".");
      else line.replaceChildren(`${beginning}and at 0 they walk alike.`);
      chips.forEach((chip) => chip.setAttribute("aria-pressed", String(chip.textContent === part)));
    };
    const applyDial = () => {
      values.clear();
      values.set(valueKey(channel, channel.columns[channel.sliders[part]]), dial.value / 10 * channel.highest);
      say();
      view.requestDraw();
    };
    const chips = labels.map((label) => {
      const chip = document.createElement("button");
      chip.type = "button";
      chip.textContent = label;
      chip.addEventListener("click", () => {
        part = label;
        if (!dial.value) dial.set(opening.value);
        applyDial();
      });
      find("hero-parts").append(chip);
      return chip;
    });
    const dial = createDial(find("hero-dial"), { value: opening.value, changed: applyDial });
    Object.assign(hero, { dial, chips });
    applyDial();
  }
  const showButton = () => {
    button.textContent = walks ? "Pause" : "Walk";
    button.setAttribute("aria-pressed", String(!walks));
  };
  button.addEventListener("click", () => { walks = !walks; last = null; showButton(); view.requestDraw(); });
  showButton();

  // The page contains the states of both characters while they walk, because predicting their first steps here would take long.
  const [walking, neutral] = opening.walked ?? [];
  view.compile();
  main.start(flat);
  ghost?.start(flat);
  if (walking) main.character.follow(walking);
  if (ghost && neutral) ghost.character.follow(neutral, [walking.root[0] - neutral.root[0] + GHOST_OFFSET, walking.root[2] - neutral.root[2]]);
  for (const actor of [main, ghost]) actor?.rig.take(actor.character.posePosition, actor.character.poseRotation);
  glide(1);
  showPace();
  section.classList.add("ready");
  return Object.assign(hero, { main, ghost, view, step });
};

export let hero = null;
export const startHero = () => {
  const [spec] = find("hero-view") ? Object.values(material.playable) : [];
  if (spec) hero = createHero(spec, material.hero);
};
