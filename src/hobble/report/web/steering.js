// Computes the target of the character from keys, a gamepad, or a thumb on the disc in the corner of the view.
import { find } from "./base.js";

// Keys are named by their place on the keyboard, not by letter, so that WASD is in the same place on every layout.
// key -> its direction [right, ahead], as the camera sees it
const DIRECTIONS = {
  KeyW: [0, 1], KeyS: [0, -1], KeyA: [-1, 0], KeyD: [1, 0],
  ArrowUp: [0, 1], ArrowDown: [0, -1], ArrowLeft: [-1, 0], ArrowRight: [1, 0],
};
const SPEED = { crouch: 2, walk: 2.5, jog: 7 }; // cm a frame

export const createSteering = (stage, orbit) => {
  // pressed: codes of the keys that are down. stick: where the thumb is on the disc, -1 to 1. on: which buttons are on.
  const pressed = new Set(), stick = { x: 0, y: 0 }, on = { crouch: false, jog: false, strafe: false };
  const steering = { on };

  steering.toggle = (name, value = !on[name]) => {
    on[name] = value;
    if (value && name === "crouch" && on.jog) steering.toggle("jog", false);
    if (value && name === "jog" && on.crouch) steering.toggle("crouch", false);
    find(`play-${name}`).setAttribute("aria-pressed", String(value));
  };
  for (const name of Object.keys(on)) find(`play-${name}`).addEventListener("click", () => steering.toggle(name));

  // The target now: velocity [x, z], facing [x, z] or null, gait or null, in the world. Keys and sticks are relative to the camera.
  steering.target = () => {
    let [right, ahead] = [stick.x, -stick.y], fast = on.jog || pressed.has("ShiftLeft") || pressed.has("ShiftRight"), keepsFacing = on.strafe;
    for (const code of pressed) if (DIRECTIONS[code]) { right += DIRECTIONS[code][0]; ahead += DIRECTIONS[code][1]; }
    const pad = [...(navigator.getGamepads ? navigator.getGamepads() : [])].find((p) => p && p.connected);
    if (pad) {
      const dead = (v) => (Math.abs(v) < .15 ? 0 : v);
      right += dead(pad.axes[0]);
      ahead -= dead(pad.axes[1]);
      fast = fast || pad.buttons[0]?.pressed;
      keepsFacing = keepsFacing || pad.buttons[4]?.pressed;
      orbit.yaw -= .04 * dead(pad.axes[2] || 0);
    }
    const size = Math.hypot(right, ahead);
    if (size > 1) { right /= size; ahead /= size; }
    const gait = on.crouch ? "crouch" : fast ? "jog" : "walk", { yaw } = orbit;
    const forward = [-Math.sin(yaw), -Math.cos(yaw)], side = [-forward[1], forward[0]];
    const velocity = [0, 1].map((i) => SPEED[gait] * (ahead * forward[i] + right * side[i]));
    return { velocity, facing: keepsFacing ? forward : null, gait: gait === "walk" && !size ? null : gait };
  };
  steering.release = () => pressed.clear();

  // Listens to the keys. onKey(event): called for a key that steering does not use; it returns whether the key had an effect.
  steering.listen = (onKey) => {
    stage.addEventListener("keydown", (event) => {
      if (event.target !== stage || event.ctrlKey || event.metaKey || event.altKey) return;
      if (event.code === "KeyC") { if (!event.repeat) steering.toggle("crouch"); }
      else if (event.code === "KeyF") { if (!event.repeat) steering.toggle("strafe"); }
      else if (event.code === "KeyQ") orbit.turn(.08, 0);
      else if (event.code === "KeyE") orbit.turn(-.08, 0);
      else if (event.code === "Equal") orbit.nearer(.9);
      else if (event.code === "Minus") orbit.nearer(1.1);
      else if (DIRECTIONS[event.code] || event.code.startsWith("Shift")) pressed.add(event.code);
      else if (!onKey(event)) return;
      event.preventDefault();
    });
    stage.addEventListener("keyup", (event) => pressed.delete(event.code));
    stage.addEventListener("blur", () => pressed.clear());
  };

  const pad = find("play-pad");
  const steer = (event) => {
    const box = pad.getBoundingClientRect(), r = box.width / 2;
    const [x, y] = [(event.clientX - box.x - r) / r, (event.clientY - box.y - r) / r], n = Math.max(1, Math.hypot(x, y));
    Object.assign(stick, { x: x / n, y: y / n });
    pad.firstElementChild.style.translate = `${stick.x * r * .6}px ${stick.y * r * .6}px`;
  };
  const release = () => { Object.assign(stick, { x: 0, y: 0 }); pad.firstElementChild.style.translate = ""; };
  pad.addEventListener("pointerdown", (event) => { pad.setPointerCapture(event.pointerId); steer(event); });
  pad.addEventListener("pointermove", (event) => { if (pad.hasPointerCapture(event.pointerId)) steer(event); });
  for (const name of ["pointerup", "pointercancel"]) pad.addEventListener(name, release);
  return steering;
};
