// The gait lab: it measures contacts, step lengths and knee angles of the played character over the last seconds, and draws them.
import { palette } from "./base.js";
import { SECONDS, createWatch, paceOf } from "./character.js";
import { at3, dot, minus } from "./math.js";

export const SHOWN = 240; // frames that are kept and drawn: four seconds
const SIDES = ["left", "right"];

// The angle of a knee in degrees, from the positions of hip, knee and heel. It is 0 for a straight leg.
export const kneeAngle = (hip, knee, heel) => {
  const a = minus(knee, hip), b = minus(heel, knee), size = Math.hypot(...a) * Math.hypot(...b);
  return size ? Math.acos(Math.min(1, Math.max(-1, dot(a, b) / size))) * 180 / Math.PI : 0;
};

// legs: the joints [hip, knee, heel, toe] of the left leg and of the right leg. Fields have an entry for each leg. stance: whether the foot was on the
// ground, in each frame. knees: angle of the knee in each frame. steps: length of the last step, cm, or null.
export const createLab = (legs) => {
  const lab = { stance: [[], []], knees: [[], []], steps: [null, null], stood: [false, false] };
  let landed = [null, null]; // where each foot landed last
  const append = (list, value) => { list.push(value); if (list.length > SHOWN) list.shift(); };
  // Adds a frame. places: positions of all joints. down: whether the left and the right foot are on the ground.
  lab.add = (places, down) => {
    legs.forEach(([hip, knee, heel], f) => {
      append(lab.stance[f], down[f]);
      append(lab.knees[f], kneeAngle(at3(places, hip), at3(places, knee), at3(places, heel)));
      if (down[f] && !lab.stood[f]) {
        const other = landed[1 - f], here = at3(places, heel);
        // A step reaches from the place of the other foot to the place where this one lands.
        if (other) lab.steps[f] = Math.hypot(here[0] - other[0], here[2] - other[2]);
        landed[f] = here;
      }
      lab.stood[f] = down[f];
    });
  };
  lab.clear = () => { Object.assign(lab, createLab(legs), { add: lab.add, clear: lab.clear }); landed = [null, null]; };
  return lab;
};

// Draws onto a canvas, for each leg: a bar while the foot is on the ground, and above it the angle of the knee.
export const drawLab = (canvas, lab, { ink, line, accent, second }) => {
  const scale = Math.min(2, devicePixelRatio || 1), [w, h] = [canvas.clientWidth, canvas.clientHeight];
  if (!w) return;
  if (canvas.width !== Math.round(w * scale)) [canvas.width, canvas.height] = [Math.round(w * scale), Math.round(h * scale)];
  const context = canvas.getContext("2d"), rgb = (c) => `rgb(${c.join(",")})`, half = h / 2;
  context.setTransform(scale, 0, 0, scale, 0, 0);
  context.clearRect(0, 0, w, h);
  SIDES.forEach((_, f) => {
    const top = f * half, foot = top + half - 9, n = lab.stance[f].length, x = (i) => w * (SHOWN - n + i) / SHOWN;
    context.fillStyle = rgb(line);
    context.globalAlpha = .25;
    context.fillRect(0, foot, w, 5);
    context.globalAlpha = 1;
    context.fillStyle = rgb(f ? second : accent);
    lab.stance[f].forEach((down, i) => { if (down) context.fillRect(x(i), foot, w / SHOWN + .6, 5); });
    context.strokeStyle = rgb(ink);
    context.globalAlpha = .75;
    context.lineWidth = 1.3;
    context.beginPath();
    lab.knees[f].forEach((degrees, i) => context.lineTo(x(i), foot - 4 - (half - 18) * Math.min(1, degrees / 90)));
    context.stroke();
    context.globalAlpha = 1;
  });
};

// The panel with readings of the played character: speed, phase, contacts, gait, steps, recognised limp, and time per frame.

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
  const speed = addRow("Speed"), phase = addRow("Phase"), down = addRow("On the ground"), gait = addRow("Gait"), lab = addRow("Contacts and knee angles, last 4 s"), steps = addRow("Length of the last step"), limpRow = spec.recogniser ? addRow(`Limp recognised, last ${SECONDS} s`) : null, timeRow = addRow("Time per frame");
  const chart = addElement(lab, "canvas", "lab"), bends = addElement(lab, "span", "words"), lengths = addElement(steps, "span", "words");
  chart.setAttribute("role", "img");
  chart.setAttribute("aria-label", "When each foot was on the ground, left above right, and the angle of its knee");
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
      const { knees, steps: made } = actor.lab, cm = (v) => (v === null ? "–" : `${v.toFixed(0)} cm`);
      drawLab(chart, actor.lab, palette());
      bends.textContent = `knees ${knees.map((k) => `${(k.at(-1) ?? 0).toFixed(0)}°`).join(" and ")}, left and right`;
      lengths.textContent = `left ${cm(made[0])}, right ${cm(made[1])}`;
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
