// A camera that follows the character and turns behind it. Its movement is smoothed in seconds, not in frames.
import { wrap } from "./numbers.js";

const FOLLOW = 8, COME_ROUND = .9; // rates: in a second the camera moves by 1 - exp(-rate) of the remaining distance or angle
const PATIENCE = 2500; // ms after the user turned the camera until it turns behind the character again

export const createChase = (orbit, canvas) => {
  let eye = null, last = null, touched = -Infinity;
  for (const name of ["pointerdown", "pointermove"]) {
    canvas.addEventListener(name, (event) => { if (event.buttons) touched = performance.now(); });
  }
  return {
    reset() { eye = null; last = null; },
    rest() { last = null; },
    touch() { touched = performance.now(); },
    // middle: [x, y, z] to follow. going: [x, z] target direction, or null if the character stands or strafes. Returns the
    // point to look at.
    follow(now, middle, going) {
      const passed = last === null ? 0 : Math.min(.25, (now - last) / 1000);
      last = now;
      if (!eye || Math.hypot(eye[0] - middle[0], eye[2] - middle[2]) > 250) eye = [...middle];
      eye = eye.map((v, i) => v + (1 - Math.exp(-passed * (i === 1 ? .5 * FOLLOW : FOLLOW))) * (middle[i] - v));
      if (going && now - touched > PATIENCE) {
        const off = wrap(Math.atan2(going[0], going[1]) + Math.PI - orbit.yaw);
        // If the character walks toward the camera, the user wants to see it from the front.
        if (Math.abs(off) < 2.4) orbit.yaw += (1 - Math.exp(-passed * COME_ROUND)) * off;
      }
      return eye;
    },
  };
};
