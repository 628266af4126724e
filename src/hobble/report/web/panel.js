// The readings next to the played character: phase, contacts, gait, speed, milliseconds.
import { drawLab } from "./lab.js";
import { palette } from "./paint.js";
import { createWatch, SECONDS } from "./recogniser.js";

const FEET = ["left heel", "left toe", "right heel", "right toe"];
const COLOURS = { stand: "g0", walk: "g1", jog: "g2", crouch: "g3", jump: "g4", bump: "g5" };
const RECOGNISE_EVERY = 600; // ms between two answers of the recogniser
const NS = "http://www.w3.org/2000/svg";

// Runs when the browser is idle, so that no picture is late.
const idle = (act) => (globalThis.requestIdleCallback ? requestIdleCallback(act, { timeout: 1000 }) : setTimeout(act));

const make = (parent, tag, className = "", text = "") => {
  const element = document.createElement(tag);
  element.className = className;
  element.textContent = text;
  parent.append(element);
  return element;
};

export const createPanel = (host, actor, title = "") => {
  const { spec } = actor, box = make(host, "div", "readings");
  if (title) make(box, "h3", "", title);
  const list = make(box, "dl"), row = (label) => {
    const part = make(list, "div");
    make(part, "dt", "", label);
    return make(part, "dd");
  };
  const speed = row("Speed"), phase = row("Phase"), down = row("On the ground"), gait = row("Gait"), lab = row("Contacts and knee angles, last 4 s"), steps = row("Length of the last step"), looks = spec.recogniser ? row(`Limp recognised, last ${SECONDS} s`) : null, cost = row("Time per frame");
  const chart = make(lab, "canvas", "lab"), bends = make(lab, "span", "words"), lengths = make(steps, "span", "words");
  chart.setAttribute("role", "img");
  chart.setAttribute("aria-label", "When each foot was on the ground, left above right, and the angle of its knee");
  const number = make(speed, "span", "value");
  const dial = document.createElementNS(NS, "svg"), hand = document.createElementNS(NS, "circle");
  dial.setAttribute("viewBox", "0 0 24 24");
  for (const circle of [document.createElementNS(NS, "circle"), hand]) {
    for (const [key, value] of Object.entries({ cx: 12, cy: 12, r: 9, pathLength: 1 })) circle.setAttribute(key, value);
    dial.append(circle);
  }
  phase.append(dial);
  const turn = make(phase, "span"), feet = make(down, "span", "feet");
  const dots = FEET.map((name) => { const dot = make(feet, "i"); dot.title = name; return dot; });
  const standing = make(down, "span", "words"), bar = make(gait, "span", "shares"), words = make(gait, "span", "words");
  const shares = spec.gaits.map((name) => {
    const piece = make(bar, "i");
    piece.style.background = `var(--${COLOURS[name] || "g0"})`;
    return piece;
  });
  const note = make(box, "p", "note"), said = looks && make(looks, "span", "said"), sure = looks && make(looks, "span", "words");
  let judged = 0;
  if (looks) {
    actor.watch = createWatch(spec);
    looks.title = "A recogniser trained on recordings of people who limp compares this walk with the healthy walk of the same figure. It is not told what hurts.";
  }

  return {
    box,
    update(drawing) {
      const c = actor.character, M = spec.window, G = spec.gaits.length;
      number.textContent = `${(Math.hypot(c.px[M] - c.px[M - 10], c.pz[M] - c.pz[M - 10]) * 6 / 100).toFixed(2)} m/s`;
      hand.setAttribute("stroke-dasharray", `${c.phase.toFixed(3)} 1`);
      turn.textContent = c.phase.toFixed(2);
      FEET.forEach((name, i) => dots[i].classList.toggle("on", c.contacts[i] > .5));
      standing.textContent = FEET.filter((_, i) => c.contacts[i] > .5).join(", ") || "no foot";
      spec.gaits.forEach((name, g) => { shares[g].style.flexGrow = Math.max(0, c.gait[M * G + g]); });
      words.textContent = spec.gaits.filter((_, g) => c.gait[M * G + g] > .3).join(", ");
      const { knees, steps: made } = actor.lab, cm = (v) => (v === null ? "–" : `${v.toFixed(0)} cm`);
      drawLab(chart, actor.lab, palette());
      bends.textContent = `knees ${knees.map((k) => `${(k.at(-1) ?? 0).toFixed(0)}°`).join(" and ")}, left and right`;
      lengths.textContent = `left ${cm(made[0])}, right ${cm(made[1])}`;
      cost.textContent = `${actor.milliseconds.toFixed(1)} ms${drawing ? `, drawing ${drawing.toFixed(1)} ms` : ""}`;
      const now = performance.now();
      if (looks && now - judged > RECOGNISE_EVERY) {
        judged = now;
        idle(() => {
          const { text, share } = actor.watch.say();
          said.textContent = share === undefined ? "" : text;
          sure.textContent = share === undefined ? text : `${Math.round(100 * share)} % sure`;
        });
      }
      note.textContent = actor.falls ? `fell ${actor.falls === 1 ? "once" : `${actor.falls} times`} and was put back on its feet` : "";
    },
  };
};
