// The top of the page: a character walks in place with a value above 0 in one column of a channel. Beside it walks the same character with
// all values 0 and the same target. Under each, a belt of lines goes back as fast as it walks.
import { createActor, createTicker } from "./actor.js";
import { paceOf } from "./character.js";
import { find, material, valueKey } from "./base.js";
import { firstShown } from "./play.js";
import { createView } from "./view.js";

const APART = 100; // cm between the two figures
const LINES = 50; // cm between two lines of a belt
const SPEED = 2.5; // target speed, cm per frame
const OPENING = 120; // frames that the figures walk before they are seen
const IN_STEP = .03; // share of a gait cycle by which figures in step may differ
const TARGET = { velocity: [0, SPEED], facing: null, gait: "walk" };
const metresPerSecond = (cmPerFrame) => `${(cmPerFrame * .6).toFixed(2)} m/s`;

// Measures the steps of an actor, so that two can walk in step. progress: share of the present gait cycle, from one landing of the left foot
// to the next. cycle: frames of the last whole cycle.
const createStepCount = (actor) => {
  const count = { progress: 0, cycle: 66 };
  let since = 0, down = true;
  count.add = () => {
    const { contacts } = actor.character, now = contacts[0] > .5 || contacts[1] > .5;
    since++;
    if (now && !down && since > 20) { count.cycle = Math.min(140, since); since = 0; }
    down = now;
    count.progress = Math.min(1, since / count.cycle);
  };
  return count;
};

const createHero = (spec, opening) => {
  const section = find("hero"), canvas = find("hero-view"), line = find("hero-line"), button = find("hero-walk");
  const channel = firstShown(spec), labels = channel ? Object.keys(channel.sliders) : [];
  const values = new Map(), neutralValues = new Map(), hero = { frames: 0 };
  let resolveShown;
  hero.shown = new Promise((done) => { resolveShown = done; }); // resolved when the figure has moved, or, if it rests, has been drawn
  const ticker = createTicker();
  // part: label of the slider that the visitor sets here. dueBeside: how many frames of the second figure have to run. shown: when the speeds were last
  // shown, ms. placed: size of the canvas for which the camera was set.
  let part = labels.includes(opening.part) ? opening.part : labels[0];
  let dueBeside = 0, shown = 0, placed = "", walks = !matchMedia("(prefers-reduced-motion: reduce)").matches;

  const view = createView(canvas, { yaw: .62, pitch: .1, distance: 520, nearest: 280, furthest: 900 }, (now) => {
    for (let n = walks ? ticker.frames(now) : 0; n > 0; n--) hero.step();
    draw(now);
    if (!walks || hero.frames) resolveShown();
    if (walks) view.requestDraw();
  });
  view.onHidden = ticker.rest;
  const main = createActor(view, spec), beside = channel ? createActor(view, spec, { tint: "healthy" }) : null;
  const figures = beside ? [[main, APART / 2], [beside, -APART / 2]] : [[main, 0]]; // each with its place, x in cm
  const steps = figures.map(([actor]) => createStepCount(actor));

  hero.step = () => {
    hero.frames++;
    main.frame(TARGET, values);
    steps[0].add();
    if (!beside) return;
    // The second figure is played a little faster or slower, so that both land at the same time.
    const behind = steps[0].progress - steps[1].progress, late = behind - Math.round(behind);
    dueBeside += Math.min(1.5, Math.max(.6, steps[1].cycle / steps[0].cycle + .5 * late));
    for (; dueBeside >= 1; dueBeside--) { beside.frame(TARGET, neutralValues); steps[1].add(); }
  };
  // Sets the camera so that the figures fill the part of the picture that no text covers.
  const place = () => {
    if (placed === `${view.W} ${view.H}`) return;
    placed = `${view.W} ${view.H}`;
    const text = section.querySelector(".hero-text").getBoundingClientRect(), box = canvas.getBoundingClientRect();
    const covered = text.top < box.bottom - 8 ? Math.max(0, text.right - box.left) : 0, free = view.W - covered, { distance } = view.orbit;
    const zoom = distance * Math.min(free / (beside ? 250 : 170), view.H / 205); // pixels: 250 cm side by side and 205 cm in height are shown
    view.framing = { size: zoom / Math.min(view.H, 1.15 * view.W), aside: covered / 2 / view.W, up: .015 };
  };
  const drawBelt = ([{ character }, x]) => {
    const gone = character.root[2] % LINES;
    for (let z = -400 - gone; z < 400; z += LINES) view.marks.addStrip([x - 34, 0, z], [x + 34, 0, z], 2.2, view.paint.ink, .3 * (1 - Math.abs(z) / 400));
  };
  const draw = (now) => {
    place();
    view.aim([0, 86, 0]);
    view.land.drawAround([0, 0, 0]);
    for (const figure of figures) {
      const [actor, x] = figure, [rootX, , rootZ] = actor.character.root;
      drawBelt(figure);
      actor.draw(null, [x - rootX, -rootZ]);
    }
    view.land.darkenUnder(figures.flatMap(([{ figure }]) => figure.balls(view.balls / figures.length)));
    if (now - shown > 250) { shown = now; showPace(); }
  };
  // Writes under each figure who it is and how fast it walks.
  const showPace = () => {
    if (beside) figures.forEach(([actor, x], i) => {
      const name = find(`hero-name-${i}`), [left, top] = view.project([x, -9, 12]);
      name.lastElementChild.textContent = metresPerSecond(paceOf(actor.character, 50));
      Object.assign(name.style, { left: `${left}px`, top: `${top}px` });
    });
  };

  if (channel) {
    const [before, after] = channel.says.split("{}");
    const bold = (text) => Object.assign(document.createElement("b"), { textContent: text });
    const much = find("hero-much");
    const say = () => {
      const asked = `One network moves both. Both are asked to walk at ${metresPerSecond(SPEED)}`;
      find("hero-name-0").firstElementChild.textContent = channel.on || part;
      const value = Number(much.value);
      find("hero-value").textContent = `${value} of 10`;
      if (value) line.replaceChildren(`${asked}; one is told ${before}`, bold(part), `${after}, `, bold(`${value} of 10`), ", and goes as fast as that allows.");
      else line.replaceChildren(`${asked}. At 0 they walk alike.`);
      chips.forEach((chip) => chip.setAttribute("aria-pressed", String(chip.textContent === part)));
    };
    const apply = () => {
      values.clear();
      values.set(valueKey(channel, channel.columns[channel.sliders[part]]), much.value / 10 * channel.highest);
      say();
      view.requestDraw();
    };
    const chips = labels.map((label) => {
      const chip = document.createElement("button");
      chip.type = "button";
      chip.textContent = label;
      chip.addEventListener("click", () => {
        part = label;
        if (!Number(much.value)) much.value = opening.value;
        apply();
      });
      find("hero-parts").append(chip);
      return chip;
    });
    much.value = opening.value;
    much.addEventListener("input", apply);
    hero.chips = chips;
    apply();
  }
  const showButton = () => {
    button.textContent = walks ? "Pause" : "Walk";
    button.setAttribute("aria-pressed", String(!walks));
  };
  button.addEventListener("click", () => { walks = !walks; ticker.rest(); showButton(); view.requestDraw(); });
  showButton();

  // Both walk before they are seen, so that they are up to speed and limp. The second one goes on until it is in step with the first.
  view.compile();
  figures.forEach(([actor], i) => {
    actor.start(() => 0);
    for (let f = 0; f < OPENING; f++) actor.frame(TARGET, i ? neutralValues : values);
  });
  const ahead = () => { const lead = beside.character.phase - main.character.phase; return lead - Math.floor(lead); };
  for (let f = 0; beside && f < OPENING && ahead() > IN_STEP; f++) beside.frame(TARGET, neutralValues);
  section.classList.add("ready");
  return Object.assign(hero, { main, beside, view });
};

export let hero = null;
export const startHero = () => {
  const [spec] = find("hero-view") ? Object.values(material.playable) : [];
  if (spec) hero = createHero(spec, material.hero);
};
