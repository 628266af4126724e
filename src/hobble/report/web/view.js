// A small 3D view on a canvas: a camera that orbits, and bodies of shaded capsules. Centimetres, Y up.
import { onTheme, rgb } from "./base.js";
import { cross, dot, minus, mix, unit } from "./numbers.js";

export const css = (c, alpha = 1) => `rgba(${c.map((v) => Math.round(Math.min(255, Math.max(0, v)))).join(",")},${alpha})`;

// Draws every view, also those that were never scrolled to: for printing.
export const views = [];

// draw(now, view) is called when something asked for it and the canvas can be seen.
export const createView = (canvas, home, draw) => {
  const context = canvas.getContext("2d"), shade = document.createElement("canvas"), shadow = shade.getContext("2d");
  const camera = { ...home };
  let scale = 1, eye, right, up, ahead, seen = false, waiting = false;
  const view = { context, camera, W: 0, H: 0, zoom: 1, paint: {}, onHidden: () => {} };

  const paint = (now) => {
    if (view.W < 4 || view.H < 4) return; // a window that is being made or folded away
    context.setTransform(scale, 0, 0, scale, 0, 0);
    context.clearRect(0, 0, view.W, view.H);
    draw(now, view);
  };
  view.ask = () => {
    if (waiting || !seen) return;
    waiting = true;
    requestAnimationFrame((now) => { waiting = false; paint(now); });
  };
  view.aim = (target) => {
    const { yaw, pitch, distance } = camera, c = Math.cos(pitch);
    const away = [c * Math.sin(yaw), Math.sin(pitch), c * Math.cos(yaw)];
    eye = away.map((v, i) => target[i] + distance * v);
    ahead = away.map((v) => -v);
    right = unit(cross(ahead, [0, 1, 0]));
    up = cross(right, ahead);
    view.zoom = 1.75 * Math.min(view.H, view.W * 1.15);
  };
  // Screen x, y and distance along the view.
  view.project = (p) => {
    const d = minus(p, eye), z = Math.max(1, dot(d, ahead));
    return [view.W / 2 + view.zoom * dot(d, right) / z, view.H / 2 - view.zoom * dot(d, up) / z, z];
  };
  view.segment = (a, b, colour, alpha) => {
    const p = view.project(a), q = view.project(b);
    if (p[2] < 20 || q[2] < 20 || alpha < .02) return;
    context.strokeStyle = css(colour, alpha);
    context.beginPath();
    context.moveTo(p[0], p[1]);
    context.lineTo(q[0], q[1]);
    context.stroke();
  };

  // The outline of two circles and their common tangents.
  const outline = (c, a, b, ra, rb) => {
    const dx = b[0] - a[0], dy = b[1] - a[1], d = Math.hypot(dx, dy);
    c.beginPath();
    if (d <= Math.abs(ra - rb) + .01) {
      const [p, r] = ra > rb ? [a, ra] : [b, rb];
      c.arc(p[0], p[1], r, 0, 2 * Math.PI);
      return;
    }
    const along = Math.atan2(dy, dx), half = Math.acos((ra - rb) / d);
    c.arc(a[0], a[1], ra, along + half, along - half + 2 * Math.PI);
    c.arc(b[0], b[1], rb, along - half, along + half);
    c.closePath();
  };
  const LIGHT = [-.45, -.89]; // on the screen: from above, a little from the left
  const capsule = ({ p, q, rp, rq, colour }) => {
    const dark = view.paint.dark, dx = q[0] - p[0], dy = q[1] - p[1], d = Math.hypot(dx, dy), r = Math.max(rp, rq);
    const mid = [(p[0] + q[0]) / 2, (p[1] + q[1]) / 2];
    const lit = mix(colour, [255, 255, 255], dark ? .25 : .55), dim = mix(colour, [20, 30, 45], dark ? .62 : .42);
    let fill;
    if (d <= .8 * r) {
      const from = [mid[0] + LIGHT[0] * r * .5, mid[1] + LIGHT[1] * r * .5];
      fill = context.createRadialGradient(from[0], from[1], r * .1, mid[0], mid[1], r + d / 2);
    } else {
      let n = [-dy / d, dx / d];
      if (n[0] * LIGHT[0] + n[1] * LIGHT[1] < 0) n = [-n[0], -n[1]];
      fill = context.createLinearGradient(mid[0] + n[0] * r, mid[1] + n[1] * r, mid[0] - n[0] * r, mid[1] - n[1] * r);
    }
    fill.addColorStop(0, css(lit));
    fill.addColorStop(.42, css(colour));
    fill.addColorStop(1, css(dim));
    outline(context, p, q, rp, rq);
    context.fillStyle = fill;
    context.fill();
    context.lineWidth = .8;
    context.strokeStyle = css(dim, .55);
    context.stroke();
  };
  // Parts {a, b, ra, rb, colour} in the world, drawn from the furthest to the nearest.
  view.body = (parts) => {
    const flat = parts.map(({ a, b, ra, rb, colour }) => {
      const p = view.project(a), q = view.project(b);
      return { p, q, rp: view.zoom * ra / p[2], rq: view.zoom * rb / q[2], colour };
    }).sort((s, t) => (t.p[2] + t.q[2]) - (s.p[2] + s.q[2]));
    flat.forEach(capsule);
  };
  view.shadow = (parts, height) => {
    shadow.setTransform(1, 0, 0, 1, 0, 0);
    shadow.clearRect(0, 0, shade.width, shade.height);
    shadow.setTransform(scale / 2, 0, 0, scale / 2, 0, 0);
    const drop = (p) => {
      const h = p[1] - height(p[0], p[2]), x = p[0] + .35 * h, z = p[2] - .2 * h;
      return view.project([x, height(x, z), z]);
    };
    for (const { a, b, ra, rb } of parts) {
      const p = drop(a), q = drop(b);
      outline(shadow, p, q, .8 * view.zoom * ra / p[2], .8 * view.zoom * rb / q[2]);
      shadow.fill();
    }
    context.save();
    context.globalAlpha = view.paint.dark ? .5 : .17;
    context.filter = "blur(3px)";
    context.drawImage(shade, 0, 0, view.W, view.H);
    context.restore();
  };

  // Looking around

  view.turn = (yaw, pitch) => {
    camera.yaw += yaw;
    camera.pitch = Math.min(1.45, Math.max(-.05, camera.pitch + pitch));
    view.ask();
  };
  view.nearer = (factor) => {
    camera.distance = Math.min(1500, Math.max(140, camera.distance * factor));
    view.ask();
  };
  view.reset = () => { Object.assign(camera, home); view.ask(); };
  view.keys = {
    ArrowLeft: () => view.turn(-.1, 0), ArrowRight: () => view.turn(.1, 0), ArrowUp: () => view.turn(0, .07),
    ArrowDown: () => view.turn(0, -.07), "+": () => view.nearer(.9), "=": () => view.nearer(.9), "-": () => view.nearer(1.1),
  };
  view.listen = (element) => element.addEventListener("keydown", (event) => {
    const act = view.keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!act || event.target !== element || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    act();
  });
  const touches = new Map();
  const spread = () => { const [p, q] = [...touches.values()]; return Math.max(1, Math.hypot(p[0] - q[0], p[1] - q[1])); };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    touches.set(event.pointerId, [event.clientX, event.clientY]);
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = touches.get(event.pointerId);
    if (!before) return;
    const was = touches.size === 2 ? spread() : 0;
    touches.set(event.pointerId, [event.clientX, event.clientY]);
    if (touches.size === 2) view.nearer(was / spread());
    else view.turn(-(event.clientX - before[0]) / 160, (event.clientY - before[1]) / 220);
  });
  for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, (event) => touches.delete(event.pointerId));
  canvas.addEventListener("wheel", (event) => {
    if (!event.ctrlKey) return; // plain scrolling belongs to the page
    event.preventDefault();
    view.nearer(Math.exp(event.deltaY / 300));
  }, { passive: false });

  const recolour = () => {
    const dark = rgb("paper")[0] < 128;
    view.paint = {
      dark, body: dark ? [166, 174, 182] : [190, 196, 201], low: rgb("hurt-low"), high: rgb("hurt-high"),
      line: rgb("faint"), ink: rgb("ink"), accent: rgb("accent"), ground: rgb("ground"),
    };
    view.ask();
  };
  onTheme.push(recolour);
  recolour();
  views.push(() => paint(performance.now()));
  new ResizeObserver(() => {
    view.W = canvas.clientWidth;
    view.H = canvas.clientHeight;
    scale = Math.min(2, devicePixelRatio || 1);
    [canvas.width, canvas.height] = [Math.round(view.W * scale), Math.round(view.H * scale)];
    [shade.width, shade.height] = [canvas.width >> 1, canvas.height >> 1];
    if (seen) paint(performance.now()); // at once: a canvas loses its picture with its size
  }).observe(canvas);
  new IntersectionObserver(([entry]) => { seen = entry.isIntersecting; view.onHidden(); view.ask(); }).observe(canvas);
  return view;
};

// Body: grey where healthy, over amber to red where hurt.
export const severityColour = (paint, severity) => {
  const t = severity / 10;
  if (!severity) return paint.body;
  return t < .5 ? mix(paint.body, paint.low, .35 + 1.3 * t) : mix(paint.low, paint.high, 2 * t - 1);
};

// The parts of a body whose joints are at `points`; severity(links) tells how much a part is hurt.
export const bodyParts = (capsules, points, floor, colour) => capsules.map((c) => {
  let a = points[c.a], b = points[c.b];
  if (c.beyond) {
    const way = unit(minus(points[c.b], points[c.from]));
    b = b.map((v, i) => v + way[i] * c.beyond);
    if (c.flat) b[1] = Math.max(b[1], floor(b[0], b[2]) + c.rb);
    if (c.centre) a = b;
  }
  return { a, b, ra: c.ra, rb: c.rb, colour: colour(c.links) };
});
