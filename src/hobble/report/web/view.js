// A lit scene on a canvas. All views of the page share one WebGL context. Each view copies its picture to its own canvas, where it can be
// printed and saved. Centimetres, Y up.
import {
  DirectionalLight, HemisphereLight, PerspectiveCamera, Scene, VSMShadowMap, WebGLRenderer,
} from "three";
import { onTheme } from "./base.js";
import { createLand } from "./land.js";
import { createMarks } from "./marks.js";
import { cross, dot, minus, unit } from "./numbers.js";
import { createOrbit } from "./orbit.js";
import { palette } from "./paint.js";

// For printing: functions that draw each view, even if it was never scrolled to.
export const views = [];

// Levels of quality, best first. scale: pixels drawn for each CSS pixel. shadow: size of the shadow map. balls: round parts
// of bodies that darken the ground under them.
const LEVELS = [{ scale: 2, shadow: 768, balls: 24 }, { scale: 1, shadow: 512, balls: 16 }, { scale: .8, shadow: 0, balls: 12 }];
const SLOW = 50, PATIENCE = 24; // if more than PATIENCE pictures take longer than SLOW ms, the quality goes down a level
const requested = new URLSearchParams(location.search).get("quality");
let level = 0, slow = 0;

let renderer = null;
// The renderer, false without WebGL. first: the canvas of the view that is drawn first; the renderer's canvas gets its size.
const shared = (first) => {
  if (renderer === null) {
    try {
      const [width, height] = first ? [first.clientWidth, first.clientHeight] : [300, 150];
      const canvas = Object.assign(document.createElement("canvas"), { width, height });
      renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true, powerPreference: "high-performance" });
      renderer.shadowMap.enabled = true;
      renderer.shadowMap.type = VSMShadowMap;
      renderer.setScissorTest(true);
      const gl = renderer.getContext(), info = gl.getExtension("WEBGL_debug_renderer_info");
      const card = info ? String(gl.getParameter(info.UNMASKED_RENDERER_WEBGL)) : "";
      // Without a graphics card the processor draws, so start with the lowest quality.
      if (requested !== "high" && (requested === "low" || /swiftshader|llvmpipe|software|basic render/i.test(card))) level = LEVELS.length - 1;
    } catch { renderer = false; } // no WebGL: a message is drawn in place of the picture
  }
  return renderer;
};

const lit = (scene) => {
  const sky = new HemisphereLight(), key = new DirectionalLight(), rim = new DirectionalLight();
  key.shadow.mapSize.set(LEVELS[0].shadow, LEVELS[0].shadow);
  Object.assign(key.shadow, { radius: 6, blurSamples: 12, bias: -.0004, normalBias: 1, intensity: .85 });
  Object.assign(key.shadow.camera, { left: -190, right: 190, top: 190, bottom: -190, near: 100, far: 1200 });
  scene.add(sky, key, key.target, rim, rim.target);
  return {
    // Changes the size of the shadow map; 0 draws no shadows.
    fine(size) {
      key.castShadow = size > 0;
      if (!size || key.shadow.mapSize.x === size) return;
      key.shadow.mapSize.set(size, size);
      key.shadow.map?.dispose();
      key.shadow.map = null;
    },
    colour(paint) {
      sky.color.set(paint.dark ? 0xaebfd0 : 0xffffff);
      sky.groundColor.set(paint.dark ? 0x30363c : 0xbcb8b0);
      sky.intensity = paint.dark ? 1.0 : 1.45;
      key.color.set(0xfffaf3);
      key.intensity = paint.dark ? 2.2 : 2.3;
      rim.color.set(paint.dark ? 0x9fd4e0 : 0xdfeef5);
      rim.intensity = paint.dark ? 1.1 : .7;
    },
    // Places the lights relative to the camera: the key light to the left of it, the rim light behind the body.
    aim([x, y, z], yaw) {
      const put = (light, turn, out, up) => {
        light.target.position.set(x, y, z);
        light.position.set(x + out * Math.sin(yaw + turn), y + up, z + out * Math.cos(yaw + turn));
      };
      put(key, -.85, 380, 520);
      put(rim, 2.5, 420, 170);
      for (const light of [key, rim]) { light.updateMatrixWorld(); light.target.updateMatrixWorld(); }
    },
  };
};

// draw(now, view) is called after `view.ask()`, once the canvas can be seen.
export const createView = (canvas, home, draw) => {
  const context = canvas.getContext("2d"), scene = new Scene(), camera = new PerspectiveCamera(30, 1, 10, 6000);
  const lights = lit(scene);
  let scale = 1, eye = [0, 0, 1], right, up, ahead, seen = false, waiting = false, drawnAt = 0, drawnFor = -1;
  // framing: size of the body in the picture, and its shift as a share of the picture's width (aside) and height (up).
  const view = { scene, W: 0, H: 0, zoom: 1, paint: {}, milliseconds: 0, framing: { size: 1.75, aside: 0, up: 0 }, balls: 12, inputs: false, onHidden: () => {} };
  view.land = createLand(scene);
  view.marks = createMarks(scene);
  view.over = createMarks(scene, { most: 400, over: true });

  const paint = (now) => {
    if (drawnFor < 0) return; // not laid out yet
    if (view.W < 4 || view.H < 4) return; // the window is opening or closing
    const gl = shared();
    if (!gl) {
      context.fillStyle = "gray";
      context.fillText("This browser draws no 3D pictures (WebGL is off).", 16 * scale, 24 * scale);
      return;
    }
    if (drawnFor !== level) fit();
    // Lower the quality if pictures keep coming slowly.
    slow = now - drawnAt > SLOW && now - drawnAt < 1000 ? slow + 1 : Math.max(0, slow - 2);
    drawnAt = now;
    if (slow > PATIENCE && level + 1 < LEVELS.length && !requested) { level++; slow = 0; }
    view.marks.clear();
    view.over.clear();
    draw(now, view);
    const before = performance.now(), [w, h] = [canvas.width, canvas.height], room = gl.domElement;
    if (room.width < w || room.height < h) gl.setSize(Math.max(room.width, w), Math.max(room.height, h), false);
    gl.setViewport(0, 0, w, h);
    gl.setScissor(0, 0, w, h);
    view.marks.done();
    view.over.done();
    gl.render(scene, camera);
    // Draw the sky first, so that saved pictures and films have one.
    const sky = context.createLinearGradient(0, 0, 0, h), [r, g, b] = view.paint.sky, [u, v, t] = view.paint.zenith;
    sky.addColorStop(0, `rgb(${u},${v},${t})`);
    sky.addColorStop(.7, `rgb(${r},${g},${b})`);
    context.fillStyle = sky;
    context.fillRect(0, 0, w, h);
    context.drawImage(room, 0, room.height - h, w, h, 0, 0, w, h);
    view.milliseconds += .1 * (performance.now() - before - view.milliseconds);
  };
  view.ask = () => {
    if (waiting || !seen) return;
    waiting = true;
    requestAnimationFrame((now) => { waiting = false; paint(now); });
  };
  view.orbit = createOrbit(canvas, home, () => view.ask());
  view.aim = (target) => {
    const { yaw, pitch, distance } = view.orbit, c = Math.cos(pitch);
    const away = [c * Math.sin(yaw), Math.sin(pitch), c * Math.cos(yaw)];
    eye = away.map((v, i) => target[i] + distance * v);
    ahead = away.map((v) => -v);
    right = unit(cross(ahead, [0, 1, 0]));
    up = cross(right, ahead);
    view.zoom = view.framing.size * Math.min(view.H, view.W * 1.15);
    camera.setViewOffset(view.W, view.H, -view.framing.aside * view.W, view.framing.up * view.H, view.W, view.H);
    camera.fov = 2 * Math.atan(view.H / 2 / view.zoom) * 180 / Math.PI;
    camera.aspect = view.W / view.H;
    camera.position.set(...eye);
    camera.lookAt(...target);
    camera.updateProjectionMatrix();
    lights.aim(target, yaw);
  };
  // The x and y of a point on the screen, and its distance from the camera along the view.
  view.project = (p) => {
    const d = minus(p, eye), z = Math.max(1, dot(d, ahead));
    const { aside, up: raised } = view.framing;
    return [view.W * (.5 + aside) + view.zoom * dot(d, right) / z, view.H * (.5 - raised) - view.zoom * dot(d, up) / z, z];
  };

  const recolour = () => {
    view.paint = palette();
    lights.colour(view.paint);
    view.land.colour(view.paint);
    view.ask();
  };
  onTheme.push(recolour);
  recolour();
  const fit = () => {
    drawnFor = level;
    view.W = canvas.clientWidth;
    view.H = canvas.clientHeight;
    scale = Math.min(LEVELS[level].scale, level ? 1 : devicePixelRatio || 1);
    [canvas.width, canvas.height] = [Math.round(view.W * scale), Math.round(view.H * scale)];
    lights.fine(LEVELS[level].shadow);
    view.balls = LEVELS[level].balls;
  };
  // Begins to compile the shaders of the scene. The graphics card does this while the scripts continue.
  view.compile = () => {
    const gl = shared(canvas);
    if (!gl) return;
    fit();
    gl.compile(scene, camera);
  };
  const fits = () => drawnFor >= 0 && view.W === canvas.clientWidth && view.H === canvas.clientHeight;
  // Setting the size of a canvas clears it. For printing, the size is set first and then the picture is drawn. The observer
  // is told of this size afterwards and must not clear the picture again, hence `fits`.
  views.push(() => {
    shared(canvas);
    if (!fits()) fit();
    paint(performance.now());
  });
  new ResizeObserver(() => {
    shared(canvas);
    if (fits()) return;
    fit();
    if (seen) paint(performance.now()); // at once
  }).observe(canvas);
  new IntersectionObserver((entries) => { seen = entries.at(-1).isIntersecting; if (!seen) view.onHidden(); view.ask(); }).observe(canvas);
  return view;
};
