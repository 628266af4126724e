// A camera that moves around its target. The user moves it by dragging, pinching, pressing keys, or turning the wheel with Ctrl.
import {
  DirectionalLight, HemisphereLight, PerspectiveCamera, Raycaster, Scene, Vector2, Vector3, VSMShadowMap, WebGLRenderer,
} from "three";
import { onTheme, palette } from "./base.js";
import { createLand, createMarks } from "./ground.js";
import { wrap } from "./math.js";

// home: where it starts and returns to: {yaw, pitch} in radians, {distance} in cm, and the limits {nearest, furthest} of the distance.
// changed(): called after every movement.
export const createOrbit = (canvas, home, changed) => {
  const orbit = { ...home };
  const { nearest = 140, furthest = 1500 } = home;

  orbit.turn = (yaw, pitch) => {
    orbit.yaw += yaw;
    orbit.pitch = Math.min(1.45, Math.max(.02, orbit.pitch + pitch));
    changed();
  };
  orbit.nearer = (factor) => {
    orbit.distance = Math.min(furthest, Math.max(nearest, orbit.distance * factor));
    changed();
  };
  orbit.reset = () => { Object.assign(orbit, home); changed(); };
  // key -> what it does
  orbit.keys = {
    ArrowLeft: () => orbit.turn(-.1, 0), ArrowRight: () => orbit.turn(.1, 0), ArrowUp: () => orbit.turn(0, .07),
    ArrowDown: () => orbit.turn(0, -.07), "+": () => orbit.nearer(.9), "=": () => orbit.nearer(.9),
    "-": () => orbit.nearer(1.1),
  };
  // Listens to the keys while `element` has the focus.
  orbit.listen = (element) => element.addEventListener("keydown", (event) => {
    const action = orbit.keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action || event.target !== element || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    action();
  });

  const touches = new Map(); // pointer -> where it is, [x, y] in pixels
  const fingerDistance = () => { const [p, q] = [...touches.values()]; return Math.max(1, Math.hypot(p[0] - q[0], p[1] - q[1])); };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    touches.set(event.pointerId, [event.clientX, event.clientY]);
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = touches.get(event.pointerId);
    if (!before) return;
    const was = touches.size === 2 ? fingerDistance() : 0;
    touches.set(event.pointerId, [event.clientX, event.clientY]);
    if (touches.size === 2) orbit.nearer(was / fingerDistance());
    else orbit.turn(-(event.clientX - before[0]) / 160, (event.clientY - before[1]) / 220);
  });
  for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, (event) => touches.delete(event.pointerId));
  canvas.addEventListener("wheel", (event) => {
    if (!event.ctrlKey) return; // without Ctrl the page scrolls
    event.preventDefault();
    orbit.nearer(Math.exp(event.deltaY / 300));
  }, { passive: false });
  return orbit;
};

// A camera that follows the character and turns behind it. Its movement depends on time, not on the number of pictures that are drawn.

const FOLLOW = 8, COME_ROUND = .9; // rates: in a second the camera moves by 1 - exp(-rate) of the remaining distance or angle
const REST = 2500; // ms: if the user has turned the camera, it turns behind the character again after this time

export const createChase = (orbit, canvas) => {
  // target: the point that the camera looks at. last: time of the last picture. touched: when the user last turned the camera. Both in ms.
  let target = null, last = null, touched = -Infinity;
  for (const name of ["pointerdown", "pointermove"]) {
    canvas.addEventListener(name, (event) => { if (event.buttons) touched = performance.now(); });
  }
  return {
    // Forgets where the camera was, because the character starts again somewhere else.
    reset() { target = null; last = null; },
    // Tells that no pictures are drawn for a while.
    rest() { last = null; },
    // Tells that the camera was set, so that it stays for a while.
    touch() { touched = performance.now(); },
    // Moves the camera, and returns the point that it looks at. now: ms. middle: the point [x, y, z] to follow, cm. going: the direction
    // [x, z] in which the character wants to go, or null if it stands or strafes.
    follow(now, middle, going) {
      const passed = last === null ? 0 : Math.min(.25, (now - last) / 1000);
      last = now;
      if (!target || Math.hypot(target[0] - middle[0], target[2] - middle[2]) > 250) target = [...middle];
      target = target.map((v, i) => v + (1 - Math.exp(-passed * (i === 1 ? .5 * FOLLOW : FOLLOW))) * (middle[i] - v));
      if (going && now - touched > REST) {
        const off = wrap(Math.atan2(going[0], going[1]) + Math.PI - orbit.yaw);
        // If the character walks toward the camera, the user wants to see it from the front.
        if (Math.abs(off) < 2.4) orbit.yaw += (1 - Math.exp(-passed * COME_ROUND)) * off;
      }
      return target;
    },
  };
};

// A view: a 3D scene with lights on a canvas. All views of the page share one WebGL context, whose picture each view copies to its own canvas.
// There it can be printed and saved. Units are centimetres, Y is up.

// A function for each view that draws it, even if the user never scrolled to it. They are called before printing.
export const views = [];

// Levels of quality, best first. scale: pixels drawn for each CSS pixel, at most. shadow: size of the shadow map, or 0 for no shadows. balls: how
// many round parts of bodies darken the ground. The levels from SOFTWARE on are for a processor that draws without a graphics card.
const LEVELS = [
  { scale: 2, shadow: 768, balls: 24 }, { scale: 1, shadow: 512, balls: 16 }, { scale: .8, shadow: 0, balls: 12 },
  { scale: .6, shadow: 0, balls: 8 }, { scale: .42, shadow: 0, balls: 6 }, { scale: .3, shadow: 0, balls: 4 },
];
const SOFTWARE = 3;
const ON_TIME = 60, PATIENCE = 1000; // if pictures that follow one another are later than ON_TIME by PATIENCE in all, ms, the quality goes down a level
const requested = new URLSearchParams(location.search).get("quality");
let level = 0, late = 0;

// A WebGL context without smooth edges. software: whether the processor draws.
const probe = (canvas) => {
  const gl = canvas.getContext("webgl2", { antialias: false, alpha: true }), info = gl.getExtension("WEBGL_debug_renderer_info");
  return { gl, software: /swiftshader|llvmpipe|software|basic render/i.test(info ? String(gl.getParameter(info.UNMASKED_RENDERER_WEBGL)) : "") };
};

let renderer = null;
// The renderer that all views share; false without WebGL. firstCanvas: a canvas whose size the renderer's canvas gets when it is created.
const getRenderer = (firstCanvas) => {
  if (renderer === null) {
    try {
      const [width, height] = firstCanvas ? [firstCanvas.clientWidth, firstCanvas.clientHeight] : [300, 150];
      const create = () => Object.assign(document.createElement("canvas"), { width, height }), canvas = create(), { gl, software } = probe(canvas);
      const low = requested !== "high" && (software || requested === "low");
      // Smooth edges take a processor several times as long, so it keeps the context without them.
      renderer = new WebGLRenderer(low ? { canvas, context: gl } : { canvas: create(), antialias: true, alpha: true, powerPreference: "high-performance" });
      if (!low) gl.getExtension("WEBGL_lose_context")?.loseContext();
      else level = SOFTWARE;
      renderer.shadowMap.enabled = true;
      renderer.shadowMap.type = VSMShadowMap;
      renderer.setScissorTest(true);
    } catch { renderer = false; } // no WebGL: a message is drawn in place of the picture
  }
  return renderer;
};

const createLights = (scene) => {
  const sky = new HemisphereLight(), key = new DirectionalLight(), rim = new DirectionalLight();
  key.shadow.mapSize.set(LEVELS[0].shadow, LEVELS[0].shadow);
  Object.assign(key.shadow, { radius: 6, blurSamples: 12, bias: -.0004, normalBias: 1, intensity: .85 });
  Object.assign(key.shadow.camera, { left: -190, right: 190, top: 190, bottom: -190, near: 100, far: 1200 });
  scene.add(sky, key, key.target, rim, rim.target);
  return {
    // Changes the size of the shadow map; 0 draws no shadows.
    setShadowSize(size) {
      key.castShadow = size > 0;
      if (!size || key.shadow.mapSize.x === size) return;
      key.shadow.mapSize.set(size, size);
      key.shadow.map?.dispose();
      key.shadow.map = null;
    },
    setColours(paint) {
      sky.color.set(paint.dark ? 0xaebfd0 : 0xffffff);
      sky.groundColor.set(paint.dark ? 0x30363c : 0xbcb8b0);
      sky.intensity = paint.dark ? 1.0 : 1.45;
      key.color.set(0xfffaf3);
      key.intensity = paint.dark ? 2.2 : 2.3;
      rim.color.set(paint.dark ? 0x9fd4e0 : 0xdfeef5);
      rim.intensity = paint.dark ? 1.1 : .7;
    },
    // Places the lights around a point: the key light to the left of the camera, the rim light behind the body. yaw: of the camera.
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

// home: where the camera starts, see createOrbit. draw(now, view): sets up the scene for a picture at time `now`, ms. It is called after
// `view.requestDraw()`, if the canvas is on the screen. marks: the most quads on the ground.
export const createView = (canvas, home, draw, { marks = 4000 } = {}) => {
  // The sky covers the canvas. If the browser knows, a processor that draws needs an eighth less time for a picture.
  const context = canvas.getContext("2d", { alpha: false }), scene = new Scene(), camera = new PerspectiveCamera(30, 1, 10, 6000);
  const lights = createLights(scene);
  // seen: whether the canvas is on the screen. waiting: whether a picture was requested.
  // drawnAt: time of the last picture, ms. goesOn: whether it asked for this one. drawnFor: level of quality for which the size was set, or -1.
  let scale = 1, seen = false, waiting = false, drawnAt = 0, goesOn = false, drawnFor = -1;
  // framing: size of the body in the picture, and its shift as a share of the picture's width (aside) and height (up).
  const view = { scene, W: 0, H: 0, paint: {}, milliseconds: 0, framing: { size: 1.75, aside: 0, up: 0 }, balls: 12, onHidden: () => {} };
  view.simple = Boolean(getRenderer(canvas)) && level >= SOFTWARE;
  view.land = createLand(scene, view.simple);
  view.marks = createMarks(scene, marks);

  const drawSky = () => {
    const { width, height } = canvas, sky = context.createLinearGradient(0, 0, 0, height);
    sky.addColorStop(0, `rgb(${view.paint.zenith})`);
    sky.addColorStop(.7, `rgb(${view.paint.sky})`);
    context.fillStyle = sky;
    context.fillRect(0, 0, width, height);
  };
  const paint = (now) => {
    if (drawnFor < 0) return; // the browser has not laid out the canvas yet
    if (view.W < 4 || view.H < 4) return; // the window is opening or closing
    const gl = getRenderer();
    if (!gl) {
      drawSky();
      [context.fillStyle, context.font] = [`rgb(${view.paint.ink})`, `${15 * scale}px sans-serif`];
      context.fillText("This browser draws no 3D pictures (WebGL is off).", 16 * scale, 28 * scale);
      return;
    }
    if (drawnFor !== level) setSize();
    // Lower the quality if pictures keep coming late. One very late picture may be the first after a pause, so it counts as one second.
    if (goesOn) late = Math.max(0, late + Math.min(1000, now - drawnAt) - ON_TIME);
    drawnAt = now;
    if (late > PATIENCE && level + 1 < LEVELS.length && !requested) { level++; late = 0; }
    view.marks.clear();
    draw(now, view);
    goesOn = waiting;
    const before = performance.now(), [w, h] = [canvas.width, canvas.height], glCanvas = gl.domElement;
    if (glCanvas.width < w || glCanvas.height < h) gl.setSize(Math.max(glCanvas.width, w), Math.max(glCanvas.height, h), false);
    gl.setViewport(0, 0, w, h);
    gl.setScissor(0, 0, w, h);
    view.marks.upload();
    gl.render(scene, camera);
    drawSky(); // first, so that saved pictures and films have one
    context.drawImage(glCanvas, 0, glCanvas.height - h, w, h, 0, 0, w, h);
    view.milliseconds += .1 * (performance.now() - before - view.milliseconds);
  };
  view.requestDraw = () => {
    if (waiting || !seen) return;
    waiting = true;
    requestAnimationFrame((now) => { waiting = false; paint(now); });
  };
  view.orbit = createOrbit(canvas, home, () => view.requestDraw());
  // Points the camera at a target [x, y, z].
  view.aim = (target) => {
    const { yaw, pitch, distance } = view.orbit, c = Math.cos(pitch);
    const away = [c * Math.sin(yaw), Math.sin(pitch), c * Math.cos(yaw)];
    const zoom = view.framing.size * Math.min(view.H, view.W * 1.15);
    camera.setViewOffset(view.W, view.H, -view.framing.aside * view.W, view.framing.up * view.H, view.W, view.H);
    camera.fov = 2 * Math.atan(view.H / 2 / zoom) * 180 / Math.PI;
    camera.aspect = view.W / view.H;
    camera.position.set(...away.map((v, i) => target[i] + distance * v));
    camera.lookAt(...target);
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
    lights.aim(target, yaw);
  };
  // Returns [x, y]: where a point is on the canvas, in pixels.
  view.project = (point) => {
    const { x, y } = new Vector3(...point).project(camera);
    return [view.W * (1 + x) / 2, view.H * (1 - y) / 2];
  };
  // The ray from the camera through the point (x, y) of the canvas, in pixels.
  view.rayThrough = (x, y) => {
    const ray = new Raycaster();
    ray.setFromCamera(new Vector2(2 * x / view.W - 1, 1 - 2 * y / view.H), camera);
    return ray;
  };

  const recolour = () => {
    view.paint = palette();
    lights.setColours(view.paint);
    view.land.setColours(view.paint);
    view.requestDraw();
  };
  onTheme.push(recolour);
  recolour();
  const setSize = () => {
    drawnFor = level;
    view.W = canvas.clientWidth;
    view.H = canvas.clientHeight;
    scale = Math.min(LEVELS[level].scale, level ? 1 : devicePixelRatio || 1);
    [canvas.width, canvas.height] = [Math.round(view.W * scale), Math.round(view.H * scale)];
    lights.setShadowSize(LEVELS[level].shadow);
    view.balls = LEVELS[level].balls;
  };
  // Begins to compile the shaders of the scene. The graphics card does this while the scripts continue.
  view.compile = () => {
    const gl = getRenderer(canvas);
    if (!gl) return;
    setSize();
    gl.compile(scene, camera);
  };
  const hasRightSize = () => drawnFor >= 0 && view.W === canvas.clientWidth && view.H === canvas.clientHeight;
  // Setting the size of a canvas clears it. For printing, the size is set first, and then the picture is drawn. Afterwards the observer below is
  // told of this size. It must not clear the picture again, so it first checks `hasRightSize`.
  views.push(() => {
    getRenderer(canvas);
    if (!hasRightSize()) setSize();
    paint(performance.now());
  });
  new ResizeObserver(() => {
    getRenderer(canvas);
    if (hasRightSize()) return;
    setSize();
    if (seen) paint(performance.now()); // at once, because the canvas is empty now
  }).observe(canvas);
  new IntersectionObserver((entries) => { seen = entries.at(-1).isIntersecting; if (!seen) view.onHidden(); view.requestDraw(); }).observe(canvas);
  return view;
};
