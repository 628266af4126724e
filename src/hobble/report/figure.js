// The figure walking: a body of shaded capsules on a canvas, seen through a camera that follows and orbits.
"use strict";
(() => {
  const scenes = Hobble.material.scenes, stage = document.getElementById("stage");
  if (!stage || !scenes.scenarios || !scenes.scenarios.length) return;
  const canvas = document.getElementById("view"), context = canvas.getContext("2d");
  const shade = document.createElement("canvas"), shadow = shade.getContext("2d");
  const find = (id) => document.getElementById(id);
  const slider = find("time"), clock = find("clock"), reading = find("reading"), choice = find("scenario");

  // Data

  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
  const J = scenes.joints, fps = scenes.fps, unpacked = new Map();
  const unpack = (index) => {
    if (unpacked.has(index)) return unpacked.get(index);
    const s = scenes.scenarios[index];
    const scene = {
      ...s, root: new Float32Array(bytes(s.root)), pose: new Int16Array(bytes(s.pose)),
      contacts: s.contacts && new Uint8Array(bytes(s.contacts)), phase: s.phase && new Uint8Array(bytes(s.phase)),
      severity: s.severity && new Uint8Array(bytes(s.severity)),
      ground: s.ground && { ...s.ground, heights: new Int16Array(bytes(s.ground.heights)) },
    };
    scene.focus = followed(scene);
    scene.prints = footprints(scene);
    unpacked.set(index, scene);
    return scene;
  };
  const joint = (scene, frame, j) => {
    const r = 3 * frame, p = 3 * (frame * J + j);
    return [0, 1, 2].map((i) => scene.root[r + i] + scene.pose[p + i] * scenes.unit);
  };
  // Where the camera looks: the root over the second around a frame, so that it glides and scrubbing is repeatable.
  const followed = (scene) => {
    const half = Math.round(fps / 2), out = new Float32Array(scene.root.length);
    for (let f = 0; f < scene.frames; f++) {
      const a = Math.max(0, f - half), b = Math.min(scene.frames - 1, f + half);
      for (let i = 0; i < 3; i++) {
        let sum = 0;
        for (let k = a; k <= b; k++) sum += scene.root[3 * k + i];
        out[3 * f + i] = sum / (b - a + 1);
      }
    }
    return out;
  };
  // [first frame, path on the ground] of every time a heel or toe stands.
  const footprints = (scene) => {
    const out = [];
    if (!scene.contacts) return out;
    scenes.feet.forEach((j, bit) => {
      let path = null;
      for (let f = 0; f < scene.frames; f++) {
        if (scene.contacts[f] >> bit & 1) {
          if (!path) out.push({ first: f, side: bit >> 1, path: path = [] });
          const [x, , z] = joint(scene, f, j);
          path.push([x, height(scene, x, z), z]);
        } else path = null;
      }
    });
    return out;
  };
  const height = (scene, x, z) => {
    const g = scene.ground;
    if (!g) return 0;
    const u = Math.min(g.nx - 1.001, Math.max(0, (x - g.x) / g.cell)), v = Math.min(g.nz - 1.001, Math.max(0, (z - g.z) / g.cell));
    const i = Math.floor(u), k = Math.floor(v), a = u - i, b = v - k, h = g.heights, n = g.nx;
    return scenes.unit * 10 * ((h[k * n + i] * (1 - a) + h[k * n + i + 1] * a) * (1 - b) + (h[(k + 1) * n + i] * (1 - a) + h[(k + 1) * n + i + 1] * a) * b);
  };

  // Camera

  const home = { yaw: 2.45, pitch: .2, distance: 430 };
  const camera = { ...home };
  let W = 0, H = 0, scale = 1, eye, right, up, ahead, zoom;
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
  const unit = (a) => { const n = Math.hypot(...a) || 1; return a.map((v) => v / n); };
  const aim = (target) => {
    const { yaw, pitch, distance } = camera, c = Math.cos(pitch);
    const away = [c * Math.sin(yaw), Math.sin(pitch), c * Math.cos(yaw)];
    eye = away.map((v, i) => target[i] + distance * v);
    ahead = away.map((v) => -v);
    right = unit(cross(ahead, [0, 1, 0]));
    up = cross(right, ahead);
    zoom = 1.75 * Math.min(H, W * 1.15);
  };
  const project = (p) => {
    const d = minus(p, eye), z = Math.max(1, dot(d, ahead));
    return [W / 2 + zoom * dot(d, right) / z, H / 2 - zoom * dot(d, up) / z, z];
  };

  // Drawing

  const mix = (a, b, t) => a.map((v, i) => v + (b[i] - v) * t);
  const css = (c, alpha = 1) => `rgba(${c.map((v) => Math.round(Math.min(255, Math.max(0, v)))).join(",")},${alpha})`;
  let paint = {};
  const mixPaint = () => {
    const dark = Hobble.rgb("paper")[0] < 128;
    paint = {
      dark, body: dark ? [166, 174, 182] : [190, 196, 201], low: Hobble.rgb("hurt-low"), high: Hobble.rgb("hurt-high"),
      line: Hobble.rgb("faint"), ink: Hobble.rgb("ink"), accent: Hobble.rgb("accent"), ground: Hobble.rgb("sunken"),
    };
  };
  const severityColour = (severity) => {
    if (!severity) return paint.body;
    const t = severity / 10;
    return t < .5 ? mix(paint.body, paint.low, .35 + 1.3 * t) : mix(paint.low, paint.high, 2 * t - 1);
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
  const capsule = (part) => {
    const { a, b, ra, rb, colour } = part;
    const dx = b[0] - a[0], dy = b[1] - a[1], d = Math.hypot(dx, dy), r = Math.max(ra, rb);
    const mid = [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];
    const lit = mix(colour, [255, 255, 255], paint.dark ? .25 : .55), dim = mix(colour, [20, 30, 45], paint.dark ? .62 : .42);
    let fill;
    if (d < .8 * r) {
      fill = context.createRadialGradient(mid[0] + LIGHT[0] * r * .5, mid[1] + LIGHT[1] * r * .5, r * .1, mid[0], mid[1], r + d / 2);
    } else {
      let n = [-dy / d, dx / d], facing = n[0] * LIGHT[0] + n[1] * LIGHT[1];
      if (facing < 0) { n = [-n[0], -n[1]]; facing = -facing; }
      const lean = [n[0] * r, n[1] * r];
      fill = context.createLinearGradient(mid[0] + lean[0], mid[1] + lean[1], mid[0] - lean[0], mid[1] - lean[1]);
    }
    fill.addColorStop(0, css(lit));
    fill.addColorStop(.42, css(colour));
    fill.addColorStop(1, css(dim));
    outline(context, a, b, ra, rb);
    context.fillStyle = fill;
    context.fill();
    context.lineWidth = .8;
    context.strokeStyle = css(dim, .55);
    context.stroke();
  };

  const drawGround = (scene, focus) => {
    const reach = 900, step = 100, piece = scene.ground ? 25 : 100;
    const fade = (x, z) => Math.max(0, 1 - Math.hypot(x - focus[0], z - focus[2]) / reach) ** 1.4;
    const x0 = Math.ceil((focus[0] - reach) / step) * step, z0 = Math.ceil((focus[2] - reach) / step) * step;
    context.lineWidth = 1;
    const segment = (x, z, dx, dz) => {
      const alpha = fade(x + dx / 2, z + dz / 2);
      if (alpha < .03) return;
      const a = project([x, height(scene, x, z), z]), b = project([x + dx, height(scene, x + dx, z + dz), z + dz]);
      if (a[2] < 20 || b[2] < 20) return;
      context.strokeStyle = css(paint.line, .5 * alpha);
      context.beginPath(); context.moveTo(a[0], a[1]); context.lineTo(b[0], b[1]); context.stroke();
    };
    const lines = scene.ground ? step / 2 : step;
    for (let x = x0; x <= focus[0] + reach; x += lines) for (let z = z0; z < focus[2] + reach; z += piece) segment(x, z, 0, piece);
    for (let z = z0; z <= focus[2] + reach; z += lines) for (let x = x0; x < focus[0] + reach; x += piece) segment(x, z, piece, 0);
  };
  const drawPath = (scene, focus, frame) => {
    context.lineWidth = 1.5;
    for (let f = 3; f < scene.frames; f += 3) {
      const near = Math.hypot(scene.root[3 * f] - focus[0], scene.root[3 * f + 2] - focus[2]);
      if (near > 800) continue;
      const [x, z, px, pz] = [scene.root[3 * f], scene.root[3 * f + 2], scene.root[3 * f - 9], scene.root[3 * f - 7]];
      const a = project([px, height(scene, px, pz), pz]), b = project([x, height(scene, x, z), z]);
      if (a[2] < 20 || b[2] < 20) continue;
      context.strokeStyle = css(paint.accent, (f <= frame ? .55 : .2) * (1 - near / 800));
      context.beginPath(); context.moveTo(a[0], a[1]); context.lineTo(b[0], b[1]); context.stroke();
    }
  };
  const drawPrints = (scene, focus, frame) => {
    context.lineCap = "round";
    context.lineJoin = "round";
    for (const print of scene.prints) {
      if (print.first > frame) continue;
      const path = print.path.slice(0, Math.floor(frame) - print.first + 1), [x, , z] = path[0];
      const near = Math.hypot(x - focus[0], z - focus[2]);
      if (near > 800) continue;
      const points = path.map(project);
      if (points.some((p) => p[2] < 20)) continue;
      context.strokeStyle = css(paint.ink, .34 * (1 - near / 800));
      context.lineWidth = Math.max(1.5, zoom * 6 / points[0][2]);
      context.beginPath();
      context.moveTo(points[0][0], points[0][1]);
      points.forEach((p) => context.lineTo(p[0], p[1] + .01));
      context.stroke();
    }
    context.lineCap = "butt";
  };

  const posed = (scene, time) => {
    const f = Math.min(scene.frames - 1, Math.max(0, time)), a = Math.floor(f), b = Math.min(scene.frames - 1, a + 1), t = f - a;
    const points = [];
    for (let j = 0; j < J; j++) points.push(mix(joint(scene, a, j), joint(scene, b, j), t));
    return points;
  };
  const bodyParts = (scene, frame, points) => scenes.capsules.map((c) => {
    const a = points[c.a];
    let b = points[c.b];
    if (c.beyond) {
      const dir = unit(minus(points[c.b], points[c.from]));
      b = points[c.b].map((v, i) => v + dir[i] * c.beyond);
      if (c.flat) b[1] = Math.max(b[1], height(scene, b[0], b[2]) + c.rb);
    }
    let severity = 0;
    if (scene.severity) for (const l of c.links) severity = Math.max(severity, scene.severity[frame * scenes.links.length + l] / 25);
    return { world: [c.centre ? b : a, b], a: project(c.centre ? b : a), b: project(b), ra: c.ra, rb: c.rb, severity };
  });
  const drawShadow = (scene, parts) => {
    shadow.setTransform(1, 0, 0, 1, 0, 0);
    shadow.clearRect(0, 0, shade.width, shade.height);
    shadow.setTransform(scale / 2, 0, 0, scale / 2, 0, 0);
    shadow.fillStyle = "#000";
    const drop = (p) => {
      const h = p[1] - height(scene, p[0], p[2]), x = p[0] + .35 * h, z = p[2] - .2 * h;
      return project([x, height(scene, x, z), z]);
    };
    for (const part of parts) {
      const [a, b] = part.world.map(drop);
      outline(shadow, a, b, .8 * zoom * part.size[0] / a[2], .8 * zoom * part.size[1] / b[2]);
      shadow.fill();
    }
    context.save();
    context.globalAlpha = paint.dark ? .5 : .17;
    context.filter = "blur(3px)";
    context.drawImage(shade, 0, 0, W, H);
    context.restore();
  };

  const draw = (scene, time) => {
    const frame = Math.min(scene.frames - 1, Math.floor(time)), next = Math.min(scene.frames - 1, frame + 1), t = time - frame;
    const focus = [0, 1, 2].map((i) => scene.focus[3 * frame + i] * (1 - t) + scene.focus[3 * next + i] * t);
    aim([focus[0], focus[1] - 8, focus[2]]);
    context.setTransform(scale, 0, 0, scale, 0, 0);
    context.clearRect(0, 0, W, H);
    drawGround(scene, focus);
    if (showTrails) { drawPath(scene, focus, time); drawPrints(scene, focus, time); }
    const points = posed(scene, time), parts = bodyParts(scene, frame, points);
    for (const part of parts) {
      part.size = [part.ra, part.rb];
      part.ra = zoom * part.ra / part.a[2];
      part.rb = zoom * part.rb / part.b[2];
      part.colour = severityColour(part.severity);
    }
    drawShadow(scene, parts);
    parts.sort((p, q) => (q.a[2] + q.b[2]) - (p.a[2] + p.b[2]));
    parts.forEach(capsule);
    tell(scene, frame);
  };

  // What is read off beside the figure

  const FEET = ["left heel", "left toe", "right heel", "right toe"];
  const tell = (scene, frame) => {
    const a = Math.max(0, frame - 7), b = Math.min(scene.frames - 1, frame + 7);
    const way = Math.hypot(scene.root[3 * b] - scene.root[3 * a], scene.root[3 * b + 2] - scene.root[3 * a + 2]);
    const speed = b > a ? way / 100 * fps / (b - a) : 0;
    const lines = [scene.description, `${speed.toFixed(2)} m/s`];
    if (scene.phase) lines[1] += ` · phase ${(scene.phase[frame] / 255).toFixed(2)}`;
    if (scene.contacts) lines.push(FEET.filter((_, i) => scene.contacts[frame] >> i & 1).join(", ") || "in the air");
    const hurt = scene.severity ? scenes.links
      .map((name, l) => [name, scene.severity[frame * scenes.links.length + l] / 25]).filter(([, s]) => s > 0) : [];
    hurt.slice(0, 4).forEach(([name, s]) => lines.push(`${name} ${s.toFixed(s % 1 ? 1 : 0)} of 10`));
    const nodes = [];
    lines.filter(Boolean).forEach((text, i) => {
      if (i) nodes.push(document.createElement("br"));
      const node = document.createElement(i === 0 && scene.description ? "b" : "span");
      node.textContent = text;
      nodes.push(node);
    });
    reading.replaceChildren(...nodes);
    clock.textContent = `${(frame / fps).toFixed(1)} of ${((scene.frames - 1) / fps).toFixed(1)} s`;
  };

  // Playing

  let scene, time = 0, playing = !matchMedia("(prefers-reduced-motion: reduce)").matches, rate = 1, showTrails = true;
  let last = null, visible = false, waiting = false;
  const ask = () => { if (!waiting && visible) { waiting = true; requestAnimationFrame(tick); } };
  const tick = (now) => {
    waiting = false;
    if (playing && last !== null) time = (time + Math.min(.1, (now - last) / 1000) * fps * rate) % Math.max(1, scene.frames - 1);
    last = now;
    slider.value = time;
    draw(scene, time);
    if (playing) ask(); else last = null;
  };
  const play = (on) => {
    playing = on;
    last = null;
    find("play").textContent = on ? "Pause" : "Play";
    ask();
  };
  const choose = (index) => {
    scene = unpack(index);
    choice.selectedIndex = index;
    time = 0;
    slider.max = scene.frames - 1;
    find("legend").hidden = !scene.severity || !scene.severity.some((s) => s > 0);
    ask();
  };
  const seek = (to) => { play(false); time = Math.min(scene.frames - 1, Math.max(0, to)); ask(); };
  const turn = (yaw, pitch) => {
    camera.yaw += yaw;
    camera.pitch = Math.min(1.45, Math.max(-.05, camera.pitch + pitch));
    ask();
  };
  const nearer = (factor) => { camera.distance = Math.min(1500, Math.max(140, camera.distance * factor)); ask(); };

  choice.addEventListener("change", () => choose(choice.selectedIndex));
  slider.addEventListener("input", () => seek(Number(slider.value)));
  find("play").addEventListener("click", () => play(!playing));
  find("slow").addEventListener("click", (event) => {
    rate = rate === 1 ? .25 : 1;
    event.target.setAttribute("aria-pressed", String(rate !== 1));
  });
  find("trails").addEventListener("click", (event) => {
    showTrails = !showTrails;
    event.target.setAttribute("aria-pressed", String(showTrails));
    ask();
  });
  find("view-reset").addEventListener("click", () => { Object.assign(camera, home); ask(); });
  const keys = {
    " ": () => play(!playing), ArrowLeft: () => turn(-.1, 0), ArrowRight: () => turn(.1, 0),
    ArrowUp: () => turn(0, .07), ArrowDown: () => turn(0, -.07), "+": () => nearer(.9), "=": () => nearer(.9),
    "-": () => nearer(1.1), ",": () => seek(Math.ceil(time) - 1), ".": () => seek(Math.floor(time) + 1),
    n: () => choose((choice.selectedIndex + 1) % scenes.scenarios.length),
  };
  stage.addEventListener("keydown", (event) => {
    const act = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!act || event.target !== stage || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    act();
  });
  const touches = new Map();
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    touches.set(event.pointerId, [event.clientX, event.clientY]);
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = touches.get(event.pointerId);
    if (!before) return;
    const spread = () => { const [p, q] = [...touches.values()]; return Math.hypot(p[0] - q[0], p[1] - q[1]); };
    const was = touches.size === 2 ? spread() : 0;
    touches.set(event.pointerId, [event.clientX, event.clientY]);
    if (touches.size === 2) nearer(was / Math.max(1, spread()));
    else turn(-(event.clientX - before[0]) / 160, (event.clientY - before[1]) / 220);
  });
  for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, (event) => touches.delete(event.pointerId));
  canvas.addEventListener("wheel", (event) => {
    if (!event.ctrlKey) return; // plain scrolling belongs to the page
    event.preventDefault();
    nearer(Math.exp(event.deltaY / 300));
  }, { passive: false });

  const fit = () => {
    W = canvas.clientWidth;
    H = canvas.clientHeight;
    scale = Math.min(2, devicePixelRatio || 1);
    [canvas.width, canvas.height] = [Math.round(W * scale), Math.round(H * scale)];
    [shade.width, shade.height] = [canvas.width >> 1, canvas.height >> 1];
    ask();
  };
  new ResizeObserver(fit).observe(canvas);
  new IntersectionObserver(([entry]) => { visible = entry.isIntersecting; last = null; ask(); }).observe(canvas);
  Hobble.onTheme.push(() => { mixPaint(); ask(); });
  mixPaint();
  choose(0);
  play(playing);
})();
