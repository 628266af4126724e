// The body that the figure wears: a surface over rings around the sections of its tubes. What Python's `loft` does too.
import { cross, dot, unit } from "./numbers.js";

export const RING = 16;
const UP = [0, 1, 0];
const COS = Array.from({ length: RING }, (_, k) => Math.cos(2 * Math.PI * k / RING));
const SIN = Array.from({ length: RING }, (_, k) => Math.sin(2 * Math.PI * k / RING));
const plus = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
const times = (a, s) => [a[0] * s, a[1] * s, a[2] * s];

// How many corners a body has, and which triangles join them, counter-clockwise seen from outside.
export const surface = (body) => {
  const faces = [];
  let start = 0;
  for (const { sections } of body.tubes) {
    const count = sections.length, last = start + (count - 1) * RING, tips = start + count * RING;
    for (let k = 0; k < RING; k++) {
      const after = (k + 1) % RING;
      for (let s = 0; s + 1 < count; s++) {
        const a = start + s * RING, b = a + RING;
        faces.push(a + k, b + k, a + after, a + after, b + k, b + after);
      }
      faces.push(start + k, start + after, tips, last + after, last + k, tips + 1);
    }
    start = tips + 2;
  }
  return { corners: start, faces };
};

// The part of every corner, for its colour.
export const partOfCorner = (body) => body.tubes.flatMap(({ sections }) => {
  const parts = sections.map((section) => section.at(-1));
  return [...parts.flatMap((part) => new Array(RING).fill(part)), parts[0], parts.at(-1)];
});

// Sections [{centre, u, v}] of a tube in a pose: `at(j)` gives the place of a kept joint.
const placed = (tube, at, axes) => {
  const centres = tube.sections.map(([a, b, t, cm]) => {
    const from = at(a), way = plus(at(b), from, -1);
    return plus(plus(from, way, t), unit(way), cm);
  });
  return tube.sections.map(([, , , , front, width, depth, turn], s) => {
    const along = unit(plus(centres[Math.min(s + 1, centres.length - 1)], centres[Math.max(s - 1, 0)], -1));
    let across;
    if (tube.kind === "lateral") across = plus(times(axes.hips, 1 - turn), axes.shoulders, turn);
    else if (tube.kind === "front") across = axes.front;
    else across = Math.abs(along[1]) > .7 ? [1, 0, 0] : UP;
    const u = unit(plus(across, along, -dot(across, along))), v = cross(u, along);
    return { centre: plus(centres[s], v, front), u: times(u, width), v: times(v, depth) };
  });
};
// A foot stands upright on its sole, which reaches from under the ankle to under the toe.
const placedFoot = (tube, at, sole) => {
  const ankle = at(tube.ends[0]), way = plus(at(tube.ends[1]), ankle, -1), length = Math.max(Math.hypot(...way), 1e-9);
  const ahead = times(way, 1 / length), left = unit(cross(UP, ahead)), above = cross(ahead, left);
  const sine = Math.min(.9, Math.max(-.9, (sole[0] - sole[1]) / length)), cosine = Math.sqrt(1 - sine * sine);
  const along = plus(times(ahead, cosine), above, sine), up = plus(times(above, cosine), ahead, -sine);
  return tube.sections.map(([t, cm, width, height]) => ({
    centre: plus(plus(ankle, along, t * length * cosine + cm), up, height / 2 - sole[0]),
    u: times(left, width), v: times(up, -height / 2),
  }));
};
const tip = (end, inner) => plus(end.centre, unit(plus(end.centre, inner.centre, -1)), .25 * Math.hypot(...end.v));

// All tubes of a body in a pose, as lists of sections {centre, u, v}.
export const posed = (body, at) => {
  const axes = {};
  for (const [name, [a, b]] of Object.entries(body.axes)) axes[name] = unit(plus(at(a), at(b), -1));
  if (axes.up) axes.front = cross(axes.shoulders, axes.up);
  return body.tubes.map((tube) => (tube.kind === "foot" ? placedFoot(tube, at, body.sole) : placed(tube, at, axes)));
};

// Writes the corners of posed tubes into an array of 3 numbers each.
export const corners = (tubes, out) => {
  let i = 0;
  for (const sections of tubes) {
    for (const { centre, u, v } of sections) {
      for (let k = 0; k < RING; k++) {
        for (let axis = 0; axis < 3; axis++) out[i++] = centre[axis] + COS[k] * u[axis] + SIN[k] * v[axis];
      }
    }
    for (const point of [tip(sections[0], sections[1]), tip(sections.at(-1), sections.at(-2))]) {
      for (let axis = 0; axis < 3; axis++) out[i++] = point[axis];
    }
  }
  return out;
};
