// Motion that is stored in the page: the places and rotations of a figure's bones, frame by frame.
import { find, material } from "./base.js";
import { createFigure } from "./figure.js";
import { bytes, mix, mixTurn } from "./math.js";
import { createView } from "./view.js";

const TURN = 32767; // a component of a rotation that is 1 is stored as this integer

// root, pose, turn: from `hobble.report.recorded_motion.packed_motion`. unit: `pose` has integers, and one stands for this many cm. In the result,
// frames: their number. roots: positions of the root, three numbers a frame, cm. at(frame, b): position of bone b.
export const createMotion = ({ root, pose, turn }, boneCount, unit) => {
  const roots = new Float32Array(bytes(root)), poseSteps = new Int16Array(bytes(pose));
  const turns = Float32Array.from(new Int16Array(bytes(turn)), (v) => v / TURN), frames = roots.length / 3;
  const place = (frame, b, i) => roots[3 * frame + i] + unit * poseSteps[3 * (frame * boneCount + b) + i];
  return {
    frames, roots,
    at: (frame, b) => [0, 1, 2].map((i) => place(frame, b, i)),
    // Sets the bones of a figure to the pose at a time in frames, moved by `shift` [x, z], cm.
    show(figure, time, shift = [0, 0]) {
      const f = Math.min(frames - 1, Math.floor(time)), g = Math.min(frames - 1, f + 1), t = time - f, moved = [shift[0], 0, shift[1]];
      for (let b = 0; b < boneCount; b++) {
        for (let i = 0; i < 3; i++) figure.places[3 * b + i] = (1 - t) * place(f, b, i) + t * place(g, b, i) + moved[i];
        mixTurn(turns, 4 * (f * boneCount + b), turns, 4 * (g * boneCount + b), t, figure.turns, 4 * b);
      }
    },
  };
};

// Plays frames over time, with a time slider, a clock, and a button that plays and pauses. name: the beginning of their ids. stage: id of the
// element whose keys control it. fps: frames a second. view(): the view, see createView. In the result, time: in frames.
const createPlayer = (name, stage, fps, view) => {
  const slider = find(`${name}time`), player = { time: 0, rate: 1 };
  let frames = 1, playing = false, last = null; // last: when the last picture was drawn (ms), or null while nothing plays
  player.play = (on) => {
    playing = on;
    last = null;
    find(`${name}pause`).textContent = on ? "Pause" : "Play";
    view().requestDraw();
  };
  // Pauses and shows a frame.
  player.seek = (to) => { player.play(false); player.time = Math.min(frames - 1, Math.max(0, to)); };
  // Goes to the start of a motion with this number of frames.
  player.load = (count) => { frames = count; player.time = 0; slider.max = count - 1; view().requestDraw(); };
  // Advances to `now`, before a picture is drawn.
  player.tick = (now) => {
    const passed = playing && last !== null ? Math.min(.1, (now - last) / 1000) * fps * player.rate : 0;
    if (passed) player.time = (player.time + passed) % Math.max(1, frames - 1);
    last = playing ? now : null;
    slider.value = player.time;
    find(`${name}clock`).textContent = `${(player.time / fps).toFixed(1)} of ${((frames - 1) / fps).toFixed(1)} s`;
    if (playing) view().requestDraw();
  };
  player.listen = (moreKeys = {}) => {
    slider.addEventListener("input", () => player.seek(Number(slider.value)));
    find(`${name}pause`).addEventListener("click", () => player.play(!playing));
    Object.assign(view().orbit.keys, {
      " ": () => player.play(!playing), ",": () => player.seek(Math.ceil(player.time) - 1), ".": () => player.seek(Math.floor(player.time) + 1), ...moreKeys,
    });
    view().orbit.listen(find(stage));
    view().onHidden = () => { last = null; };
  };
  return player;
};

// The view of captured (transparent) and predicted (blue) motion, with the distance between them over time.

// Opens a clip by name at the frame with the largest distance. Returns false if the page does not have the clip.
export let openClip = () => false;

export const startCaptured = () => {
  const data = material.compare, canvas = document.getElementById("compare-view");
  if (!canvas || !data || !data.clips) return;
  const boneCount = data.joints, choice = find("compare-choice"), unpacked = new Map();

  const unpack = (index) => {
    if (!unpacked.has(index)) {
      const stored = data.clips[index], unpackMotion = (motion) => createMotion(motion, boneCount, data.unit);
      unpacked.set(index, { ...stored, captured: unpackMotion(stored.captured), predicted: unpackMotion(stored.predicted) });
    }
    return unpacked.get(index);
  };

  let clip, sideOffset = 0; // the unpacked clip that is shown; cm between the two figures, 0 draws them over each other
  const view = createView(canvas, { yaw: .75, pitch: .16, distance: 400 }, (now) => {
    player.tick(now);
    const { time } = player;
    const { paint } = view, yaw = view.orbit.yaw, { roots } = clip.captured, at = 3 * Math.min(clip.frames - 1, Math.floor(time));
    const [x, z] = [roots[at], roots[at + 2]];
    view.aim([x, 82, z]); // 82 cm: half the height of a body
    view.land.drawAround([x, 0, z]);
    const aside = [sideOffset * Math.cos(yaw), -sideOffset * Math.sin(yaw)]; // to the right as the camera sees it
    clip.captured.show(captured, time);
    clip.predicted.show(predicted, time, aside);
    captured.pose(() => (sideOffset ? paint.body : paint.ghost));
    predicted.pose(() => paint.predicted);
    view.land.darkenUnder([...predicted.balls(), ...(sideOffset ? captured.balls() : [])]);
    const f = Math.min(clip.frames - 1, Math.round(time));
    const split = clip.split === "held_out" ? "held out: not used for training" : "a training clip";
    find("compare-reading").replaceChildren(split, document.createElement("br"), `distance ${clip.error[f].toFixed(1)} cm per joint`);
    find("compare-mark").setAttribute("x1", time);
    find("compare-mark").setAttribute("x2", time);
  });
  const captured = createFigure(view, data.body, [], { ghost: true }), predicted = createFigure(view, data.body);
  const player = createPlayer("compare-", "compare-stage", data.fps, () => view);
  const choose = () => {
    clip = unpack(choice.selectedIndex);
    player.load(clip.frames);
    const most = Math.max(1, ...clip.error), curve = find("compare-curve");
    curve.closest("svg").setAttribute("viewBox", `0 0 ${clip.frames - 1} 40`);
    curve.setAttribute("d", `M${clip.error.map((e, f) => `${f} ${(39 - 37 * e / most).toFixed(1)}`).join("L")}`);
    find("compare-most").textContent = `${most.toFixed(1)} cm`;
  };
  openClip = (name) => {
    const index = data.clips.findIndex((c) => c.name === name);
    if (index < 0) return false;
    choice.selectedIndex = index;
    choose();
    player.seek(clip.error.indexOf(Math.max(...clip.error)));
    find("compare").scrollIntoView({ block: "center" });
    return true;
  };
  choice.addEventListener("change", choose);
  find("compare-apart").addEventListener("click", (event) => {
    sideOffset = sideOffset ? 0 : 95;
    event.currentTarget.setAttribute("aria-pressed", String(sideOffset > 0));
    view.requestDraw();
  });
  player.listen();
  choose();
};

// Plays the scripted walks (scenarios), with footprints, readings and a time slider.
// A scene, or `s`, is a scenario whose data are unpacked.

export const startWalks = () => {
  const scenes = material.scenes, stage = document.getElementById("stage");
  if (!stage || !scenes.scenarios || !scenes.scenarios.length) return;
  const reading = find("reading"), choice = find("scenario");
  const boneCount = scenes.joints, fps = scenes.fps, unpacked = new Map();

  const unpack = (index) => {
    if (!unpacked.has(index)) {
      const stored = scenes.scenarios[index], unpackBytes = (text) => text && new Uint8Array(bytes(text));
      const scene = {
        ...stored, motion: createMotion(stored, boneCount, scenes.unit),
        contacts: unpackBytes(stored.contacts), phase: unpackBytes(stored.phase),
      };
      scene.focus = cameraTargets(scene);
      scene.prints = findFootprints(scene);
      unpacked.set(index, scene);
    }
    return unpacked.get(index);
  };
  const placeOf = (s, frame, b) => s.motion.at(frame, b);
  // The point that the camera looks at in each frame, three numbers each: the mean position of the root over a second around the frame. So the
  // camera moves smoothly, and a frame always looks the same.
  const cameraTargets = (s) => {
    const half = Math.round(fps / 2), { roots } = s.motion, out = new Float32Array(roots.length);
    for (let f = 0; f < s.frames; f++) {
      const a = Math.max(0, f - half), b = Math.min(s.frames - 1, f + half);
      for (let i = 0; i < 3; i++) {
        let sum = 0;
        for (let k = a; k <= b; k++) sum += roots[3 * k + i];
        out[3 * f + i] = sum / (b - a + 1);
      }
    }
    return out;
  };
  // {frame, heel, toe} of each standing foot in every second frame. A sliding foot leaves overlapping prints.
  const findFootprints = (s) => {
    const out = [];
    if (!s.contacts || !scenes.feet.length) return out;
    for (const [heel, toe, bit] of [[scenes.feet[0], scenes.feet[1], 1], [scenes.feet[2], scenes.feet[3], 3]]) {
      for (let f = 0; f < s.frames; f += 2) {
        if (s.contacts[f] >> bit & 1) out.push({ frame: f, heel: onGround(placeOf(s, f, heel)), toe: onGround(placeOf(s, f, toe)) });
      }
    }
    return out;
  };
  const onGround = ([x, , z]) => [x, 0, z];

  // Drawing

  const view = createView(find("view"), { yaw: .75, pitch: .2, distance: 430 }, (now) => {
    player.tick(now);
    drawScene(scene, player.time);
  });
  const figure = createFigure(view, scenes.body);
  // How near a point on the ground is to the focus: 1 at the focus, 0 from 8 m on. Marks further away are fainter.
  const nearness = ([x, , z], focus) => Math.max(0, 1 - Math.hypot(x - focus[0], z - focus[2]) / 800);
  const drawPath = (s, focus, frame) => {
    for (let f = 3; f < s.frames; f += 3) {
      const [a, b] = [f - 3, f].map((k) => [s.motion.roots[3 * k], 0, s.motion.roots[3 * k + 2]]);
      view.marks.addStrip(a, b, 1.6, view.paint.accent, (f <= frame ? .6 : .25) * nearness(b, focus));
    }
  };
  const drawPrints = (s, focus, frame) => {
    for (const { frame: f, heel, toe } of s.prints) {
      if (f <= frame) view.marks.addPrint(heel, toe, view.paint.ink, .1 * nearness(toe, focus));
    }
  };
  const drawScene = (s, at) => {
    const frame = Math.min(s.frames - 1, Math.floor(at)), next = Math.min(s.frames - 1, frame + 1), t = at - frame;
    const focus = [0, 1, 2].map((i) => s.focus[3 * frame + i] * (1 - t) + s.focus[3 * next + i] * t);
    view.aim([focus[0], focus[1] - 8, focus[2]]);
    view.land.drawAround(focus);
    if (trails) { drawPath(s, focus, at); drawPrints(s, focus, at); }
    s.motion.show(figure, at);
    figure.pose(() => view.paint.body);
    view.land.darkenUnder(figure.balls(view.balls));
    showReadings(s, frame);
  };

  // Readings next to the figure

  const FEET = ["left heel", "left toe", "right heel", "right toe"];
  const showReadings = (s, frame) => {
    const a = Math.max(0, frame - 7), b = Math.min(s.frames - 1, frame + 7), { roots } = s.motion;
    const way = Math.hypot(roots[3 * b] - roots[3 * a], roots[3 * b + 2] - roots[3 * a + 2]);
    const moment = [`${(b > a ? way / 100 * fps / (b - a) : 0).toFixed(2)} m/s`];
    if (s.phase) moment.push(`phase ${(s.phase[frame] / 255).toFixed(2)}`);
    const lines = [moment.join(" · ")];
    if (s.contacts) lines.push(FEET.filter((_, i) => s.contacts[frame] >> i & 1).join(", ") || "no foot on the ground");
    const title = document.createElement("b");
    title.textContent = s.description || s.name;
    reading.replaceChildren(title, ...lines.flatMap((text) => [document.createElement("br"), text]));
  };

  // Playing

  let scene, trails = true;
  const player = createPlayer("", "stage", fps, () => view);
  const choose = (index) => {
    scene = unpack(index);
    choice.selectedIndex = index;
    player.load(scene.frames);
  };
  const toggle = (event, on) => event.currentTarget.setAttribute("aria-pressed", String(on));

  choice.addEventListener("change", () => choose(choice.selectedIndex));
  find("slow").addEventListener("click", (event) => { player.rate = player.rate === 1 ? .25 : 1; toggle(event, player.rate !== 1); });
  find("trails").addEventListener("click", (event) => { trails = !trails; toggle(event, trails); view.requestDraw(); });
  find("view-reset").addEventListener("click", view.orbit.reset);
  player.listen({ n: () => choose((choice.selectedIndex + 1) % scenes.scenarios.length) });
  choose(0);
  player.play(!matchMedia("(prefers-reduced-motion: reduce)").matches);
};

// Shows terrain fits. A picture has the ground of one gait cycle, dots for the soles to which it was fitted, and the figure at three moments.

export const startFits = () => {
  const grounds = material.grounds, canvas = document.getElementById("ground");
  if (!canvas || !grounds || !grounds.pictures.length) return;
  const choice = document.getElementById("ground-choice");
  const unpacked = new Map();
  const unpack = (index) => {
    if (!unpacked.has(index)) {
      const picture = grounds.pictures[index], unpackLengths = (text) => Array.from(new Int16Array(bytes(text)), (v) => v / 10);
      const triples = (values) => values.reduce((out, v, i) => (i % 3 ? out.at(-1).push(v) : out.push([v]), out), []);
      const soles = triples(unpackLengths(picture.soles)), down = new Uint8Array(bytes(picture.contacts));
      const places = unpackLengths(picture.pose), turns = Array.from(new Int16Array(bytes(picture.turn)), (v) => v / 32767), boneCount = grounds.joints;
      unpacked.set(index, {
        heights: unpackLengths(picture.ground), n: picture.n, x: picture.x, z: picture.z, standing: soles.filter((_, i) => down[i]),
        poses: [0, 1, 2].map((k) => [places.slice(3 * k * boneCount, 3 * (k + 1) * boneCount), turns.slice(4 * k * boneCount, 4 * (k + 1) * boneCount)]),
      });
    }
    return unpacked.get(index);
  };
  // Corners of a dot, in the plane of the ground.
  const DOT = [[-1, 0], [0, -1], [1, 0], [0, 1]];
  const view = createView(canvas, { yaw: .9, pitch: .5, distance: 560 }, () => {
    const fit = unpack(choice.selectedIndex), { paint } = view, middle = fit.poses[1][0];
    view.aim([middle[0], middle[1] - 35, middle[2]]);
    view.land.drawPiece(fit.n, fit.x, fit.z, fit.heights);
    for (const [x, y, z] of fit.standing) {
      view.marks.addQuad(DOT.map(([a, b]) => [x + 1.6 * a, y + .4, z + 1.6 * b]), paint.accent, .85);
    }
    const pale = mix(paint.body, paint.dark ? [40, 46, 52] : [244, 243, 239], .6);
    fit.poses.forEach(([places, turns], k) => {
      figures[k].places.set(places);
      figures[k].turns.set(turns);
      figures[k].pose(() => (k === 1 ? paint.body : pale));
    });
    view.land.darkenUnder(figures.flatMap((figure) => figure.balls(8)));
  });
  const figures = [0, 1, 2].map(() => createFigure(view, grounds.body));
  choice.addEventListener("change", view.requestDraw);
  view.orbit.listen(document.getElementById("ground-stage"));
};
