// Converts the caller's target for the trajectory. A target is that of `ProceduralAnimation.next_pose` in Python: velocity ([x, z], cm a frame),
// facing ([x, z], or null to look where the character goes) and gait (its name, or null to choose by speed). The limits of the body are those
// of `hobble.runtime.bounds`: a highest speed, and a walk instead of a jog if the body cannot jog.
import { wrap } from "./numbers.js";

export const createTargets = (spec, c) => {
  const { gaits, constants: k } = spec, M = spec.window, G = gaits.length, { atan2, hypot, min, max, abs } = Math;

  // Returns [strafe, direction]: the share of strafing from 0 to 1, and the direction [x, z] in which to look. ahead: the facing of the target.
  const chooseFacing = (velocity, ahead) => {
    const going = hypot(...velocity) >= k.still;
    if (!ahead) return [0, going ? velocity : c.smoothedDirection];
    const aside = abs(wrap(atan2(...velocity) - atan2(...ahead)));
    return [going ? min(1, aside / k.strafeFrom) : 1, ahead];
  };
  // The target share of each gait. direction: in which to look.
  const gaitShares = (velocity, direction, gait) => {
    const out = new Array(G).fill(0), speed = hypot(...velocity), name = gait || (speed >= k.jogFrom ? "jog" : "walk");
    if (speed < k.still) {
      const [a, b] = [c.dx[M], c.dz[M]];
      const angle = atan2(direction[0] * b - direction[1] * a, direction[0] * a + direction[1] * b);
      const turning = abs(angle) > k.turnInPlace ? 1 : 0;
      out[gaits.indexOf("stand")] = 1 - turning;
      out[gaits.indexOf("walk")] = turning;
      if (name !== "crouch") return out;
    }
    out[gaits.indexOf(name)] = 1;
    return out;
  };

  // The channels that limit the speed.
  const limited = spec.channels.filter((one) => one.limits);
  // Of each of these channels: for each gait, the highest speed of a healthy body, cm a frame.
  const healthySpeeds = limited.map(({ limits }) => limits.speeds.map((labels) => max(...labels.map(([unhurt]) => unhurt))));
  // The highest speed in gait g, cm a frame, under the limits of all channels, as in `combine_limits` of `hobble.channels.speed_limits`.
  const highestSpeed = (g) => {
    let least = Infinity, slowed = limited[0].limits.usual[g];
    const usual = slowed;
    limited.forEach(({ first, limits }, channel) => {
      const { levels, speeds } = limits, healthy = healthySpeeds[channel][g];
      let highest = Infinity, lost = 0, values = 0;
      for (let l = 0; l < speeds[g].length; l++) {
        const v = c.channelValues[first + l];
        if (!(v > 0)) continue;
        let i = 0;
        while (i < levels.length - 2 && levels[i + 1] <= v) i++;
        const [low, high] = [speeds[g][l][i], speeds[g][l][i + 1]], speed = low + (v - levels[i]) / (levels[i + 1] - levels[i]) * (high - low);
        highest = min(highest, speed);
        lost += (1 - min(speed / healthy, 1)) ** k.sumNorm;
        values++;
      }
      if (values > 1) highest = min(highest, healthy * max(1 - lost ** (1 / k.sumNorm), k.slowestShare));
      least = min(least, highest);
      if (usual > 0) slowed *= min(1, highest / usual);
    });
    return least < usual ? slowed : least;
  };
  // The target velocity within the limits. gait: the target share of each gait. It is changed if the body cannot jog.
  const limitSpeed = (velocity, gait) => {
    if (!limited.some(({ first, columns: own }) => own.some((_, l) => c.channelValues[first + l] > 0))) return velocity;
    const highestSpeeds = gaits.map((_, g) => highestSpeed(g)), walk = gaits.indexOf("walk"), jog = gaits.indexOf("jog");
    let hurry = 1;
    if (highestSpeeds[jog] < k.lameBelow) {
      hurry += (k.hurryFactor - 1) * gait[jog];
      gait[walk] += gait[jog];
      gait[jog] = 0;
    }
    let total = 0, highest = 0;
    gaits.forEach((name, g) => {
      if (name === "stand" || !(gait[g] > 0)) return;
      total += gait[g];
      highest += gait[g] * highestSpeeds[g];
    });
    const held = total > 0 ? min(1, hurry * highest / total / max(hypot(...velocity), 1e-9)) : 1;
    return velocity.map((v) => v * held);
  };

  return { chooseFacing, gaitShares, limitSpeed };
};
