// A camera that follows the character and turns behind it. Its movement depends on time, not on the number of pictures that are drawn.
import { wrap } from "./numbers.js";

const FOLLOW = 8, COME_ROUND = .9; // rates: in a second the camera moves by 1 - exp(-rate) of the remaining distance or angle
const PATIENCE = 2500; // ms: if the user has turned the camera, it turns behind the character again after this time

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
      if (going && now - touched > PATIENCE) {
        const off = wrap(Math.atan2(going[0], going[1]) + Math.PI - orbit.yaw);
        // If the character walks toward the camera, the user wants to see it from the front.
        if (Math.abs(off) < 2.4) orbit.yaw += (1 - Math.exp(-passed * COME_ROUND)) * off;
      }
      return target;
    },
  };
};
