// Colours of the 3D views. They come from the tokens, which are the colour variables of page.css.
import { Color, SRGBColorSpace } from "three";
import { rgb } from "./base.js";
import { mix } from "./numbers.js";

// All colours by name as [r, g, b], 0 to 255, for the current theme. dark: whether this theme is dark.
export const palette = () => {
  const dark = rgb("paper")[0] < 128;
  return {
    dark, body: dark ? [176, 184, 192] : [214, 214, 210], low: rgb("hurt-low"), high: rgb("hurt-high"),
    line: rgb("faint"), ink: rgb("ink"), accent: rgb("accent"), predicted: rgb("predicted"), second: rgb("g3"),
    ground: rgb("ground"), sky: rgb("sky"), zenith: rgb("zenith"), ghost: dark ? [196, 226, 238] : [96, 130, 146],
  };
};

// The colour of a part of the body. t: its channel value as a share of the highest value. The colour is `plain` for 0, then amber, then red
// for 1.
export const channelColour = (paint, t, plain = paint.body) => {
  if (!t) return plain;
  return t < .5 ? mix(plain, paint.low, .35 + 1.3 * t) : mix(paint.low, paint.high, 2 * t - 1);
};

// Sets a three.js colour to [r, g, b], 0 to 255. three.js converts it to its linear colour space.
export const linear = ([r, g, b], colour = new Color()) => colour.setRGB(r / 255, g / 255, b / 255, SRGBColorSpace);
