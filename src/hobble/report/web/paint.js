// Colours of the scenes, from the page's tokens.
import { Color, SRGBColorSpace } from "three";
import { rgb } from "./base.js";
import { mix } from "./numbers.js";

// All colours as [r, g, b], 0 to 255, for the current theme.
export const palette = () => {
  const dark = rgb("paper")[0] < 128;
  return {
    dark, body: dark ? [176, 184, 192] : [214, 214, 210], low: rgb("hurt-low"), high: rgb("hurt-high"),
    line: rgb("faint"), ink: rgb("ink"), accent: rgb("accent"), predicted: rgb("predicted"), second: rgb("g3"),
    ground: rgb("ground"), sky: rgb("sky"), zenith: rgb("zenith"), ghost: dark ? [196, 226, 238] : [96, 130, 146],
  };
};

// Colour of a part of the body: grey for a channel value of 0, then amber, then red for the highest value. t: 0 to 1.
export const channelColour = (paint, t, plain = paint.body) => {
  if (!t) return plain;
  return t < .5 ? mix(plain, paint.low, .35 + 1.3 * t) : mix(paint.low, paint.high, 2 * t - 1);
};

// A colour [r, g, b], 0 to 255, in the linear colour space of three.js.
export const linear = ([r, g, b], colour = new Color()) => colour.setRGB(r / 255, g / 255, b / 255, SRGBColorSpace);
