// The gait lab: it measures contacts, step lengths and knee angles of the played character over the last seconds, and draws them.
import { dot, minus } from "./numbers.js";
import { at3 } from "./turns.js";

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
