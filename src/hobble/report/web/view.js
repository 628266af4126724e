// A lit scene on a canvas. One WebGL context draws every view of the page, which keeps its picture for printing and
// saving; centimetres, Y up.
import {
  DirectionalLight, HemisphereLight, PerspectiveCamera, Scene, VSMShadowMap, WebGLRenderer,
} from "three";
import { onTheme } from "./base.js";
import { createLand } from "./land.js";
import { createMarks } from "./marks.js";
import { cross, dot, minus, unit } from "./numbers.js";
import { createOrbit } from "./orbit.js";
import { palette } from "./paint.js";

// Draws every view, also those that were never scrolled to: for printing.
export const views = [];

let renderer = null;
const shared = () => {
  if (renderer === null) {
    try {
      renderer = new WebGLRenderer({ antialias: true, alpha: true, powerPreference: "high-performance" });
      renderer.shadowMap.enabled = true;
      renderer.shadowMap.type = VSMShadowMap;
      renderer.setScissorTest(true);
    } catch { renderer = false; } // no WebGL here: the page says so where the picture would be
  }
  return renderer;
};

const lit = (scene) => {
  const sky = new HemisphereLight(), key = new DirectionalLight(), rim = new DirectionalLight();
  key.castShadow = true;
  key.shadow.mapSize.set(768, 768);
  Object.assign(key.shadow, { radius: 6, blurSamples: 12, bias: -.0004, normalBias: 1, intensity: .85 });
  Object.assign(key.shadow.camera, { left: -190, right: 190, top: 190, bottom: -190, near: 100, far: 1200 });
  scene.add(sky, key, key.target, rim, rim.target);
  return {
    colour(paint) {
      sky.color.set(paint.dark ? 0xaebfd0 : 0xffffff);
      sky.groundColor.set(paint.dark ? 0x30363c : 0xbcb8b0);
      sky.intensity = paint.dark ? 1.0 : 1.45;
      key.color.set(0xfffaf3);
      key.intensity = paint.dark ? 2.2 : 2.3;
      rim.color.set(paint.dark ? 0x9fd4e0 : 0xdfeef5);
      rim.intensity = paint.dark ? 1.1 : .7;
    },
    // From the left of the camera, and against it from behind, wherever it is.
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

// draw(now, view) is called when something asked for it and the canvas can be seen.
export const createView = (canvas, home, draw) => {
  const context = canvas.getContext("2d"), scene = new Scene(), camera = new PerspectiveCamera(30, 1, 10, 6000);
  const lights = lit(scene);
  let scale = 1, eye = [0, 0, 1], right, up, ahead, seen = false, waiting = false;
  // framing: how large what is looked at is drawn, and by how much of the width and height it is moved aside.
  const view = { scene, W: 0, H: 0, zoom: 1, paint: {}, milliseconds: 0, framing: { size: 1.75, aside: 0, up: 0 }, onHidden: () => {} };
  view.land = createLand(scene);
  view.marks = createMarks(scene);

  const paint = (now) => {
    if (view.W < 4 || view.H < 4) return; // a window that is being made or folded away
    const gl = shared();
    if (!gl) {
      context.fillStyle = "gray";
      context.fillText("This browser draws no 3D pictures (WebGL is off).", 16 * scale, 24 * scale);
      return;
    }
    view.marks.clear();
    draw(now, view);
    const before = performance.now(), [w, h] = [canvas.width, canvas.height], room = gl.domElement;
    if (room.width < w || room.height < h) gl.setSize(Math.max(room.width, w), Math.max(room.height, h), false);
    gl.setViewport(0, 0, w, h);
    gl.setScissor(0, 0, w, h);
    view.marks.done();
    gl.render(scene, camera);
    // The sky lies under the scene, so that saved pictures and films have one.
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
  // Screen x, y and distance along the view.
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
  views.push(() => paint(performance.now()));
  new ResizeObserver(() => {
    view.W = canvas.clientWidth;
    view.H = canvas.clientHeight;
    scale = Math.min(2, devicePixelRatio || 1);
    [canvas.width, canvas.height] = [Math.round(view.W * scale), Math.round(view.H * scale)];
    if (seen) paint(performance.now()); // at once: a canvas loses its picture with its size
  }).observe(canvas);
  new IntersectionObserver((entries) => { seen = entries.at(-1).isIntersecting; view.onHidden(); view.ask(); }).observe(canvas);
  return view;
};
