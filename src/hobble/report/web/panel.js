// The panel with readings of the played character: speed, phase, contacts, gait, recognised limp, and time per frame.
import { SECONDS, createWatch, paceOf } from "./character.js";

const FEET = ["left heel", "left toe", "right heel", "right toe"];
// gait -> token of its colour
const COLOURS = { stand: "g0", walk: "g1", jog: "g2", crouch: "g3", jump: "g4", bump: "g5" };
const RECOGNISE_EVERY = 600; // ms between two answers of the recogniser
const NS = "http://www.w3.org/2000/svg";

// Calls `run` when the browser is idle, so that no picture is late.
const whenIdle = (run) => (globalThis.requestIdleCallback ? requestIdleCallback(run, { timeout: 1000 }) : setTimeout(run));

const addElement = (parent, tag, className = "", text = "") => {
  const element = document.createElement(tag);
  element.className = className;
  element.textContent = text;
  parent.append(element);
  return element;
};

// host: the element to which the panel is added. actor: the character, see actor.js. title: heading of the panel, or "".
export const createPanel = (host, actor, title = "") => {
  const { spec } = actor, box = addElement(host, "div", "readings");
  if (title) addElement(box, "h3", "", title);
  const list = addElement(box, "dl"), addRow = (label) => {
    const part = addElement(list, "div");
    addElement(part, "dt", "", label);
    return addElement(part, "dd");
  };
  const speed = addRow("Speed"), phase = addRow("Phase"), down = addRow("On the ground"), gait = addRow("Gait"), limpRow = spec.recogniser ? addRow(`Limp recognised, last ${SECONDS} s`) : null, timeRow = addRow("Time per frame");
  const number = addElement(speed, "span", "value");
  const dial = document.createElementNS(NS, "svg"), hand = document.createElementNS(NS, "circle");
  dial.setAttribute("viewBox", "0 0 24 24");
  for (const circle of [document.createElementNS(NS, "circle"), hand]) {
    for (const [key, value] of Object.entries({ cx: 12, cy: 12, r: 9, pathLength: 1 })) circle.setAttribute(key, value);
    dial.append(circle);
  }
  phase.append(dial);
  const turn = addElement(phase, "span"), feet = addElement(down, "span", "feet");
  const dots = FEET.map((name) => { const dot = addElement(feet, "i"); dot.title = name; return dot; });
  const standing = addElement(down, "span", "words"), bar = addElement(gait, "span", "shares"), words = addElement(gait, "span", "words");
  const shares = spec.gaits.map((name) => {
    const piece = addElement(bar, "i");
    piece.style.background = `var(--${COLOURS[name] || "g0"})`;
    return piece;
  });
  const limpText = limpRow && addElement(limpRow, "span", "said"), limpShare = limpRow && addElement(limpRow, "span", "words");
  let recognisedAt = 0;
  if (limpRow) {
    actor.watch = createWatch(spec);
    limpRow.title = "A recogniser trained on recordings of people who limp compares this walk with the healthy walk of the same figure. It is not told what hurts.";
  }

  return {
    box,
    // Shows the present readings. drawing: milliseconds that a picture takes.
    update(drawing) {
      const c = actor.character, { contacts, gaits } = c, share = (g) => gaits[gaits.length / 2 + g]; // of a gait now
      number.textContent = `${(paceOf(c, 10) * .6).toFixed(2)} m/s`; // from cm a frame
      hand.setAttribute("stroke-dasharray", `${c.phase.toFixed(3)} 1`);
      turn.textContent = c.phase.toFixed(2);
      FEET.forEach((name, i) => dots[i].classList.toggle("on", contacts[i] > .5));
      standing.textContent = FEET.filter((_, i) => contacts[i] > .5).join(", ") || "no foot";
      spec.gaits.forEach((name, g) => { shares[g].style.flexGrow = Math.max(0, share(g)); });
      words.textContent = spec.gaits.filter((_, g) => share(g) > .3).join(", ");
      timeRow.textContent = `${actor.milliseconds.toFixed(1)} ms${drawing ? `, drawing ${drawing.toFixed(1)} ms` : ""}`;
      const now = performance.now();
      if (limpRow && now - recognisedAt > RECOGNISE_EVERY) {
        recognisedAt = now;
        whenIdle(() => {
          const { text, share } = actor.watch.say();
          limpText.textContent = share === undefined ? "" : text;
          limpShare.textContent = share === undefined ? text : `${Math.round(100 * share)} % sure`;
        });
      }
    },
  };
};
