// What all parts of the page share: its data, its colours, and how channel values are named.
import { Color, SRGBColorSpace } from "three";
import { bytes, mix } from "./math.js";

// Unpacks zlib data in base64. Returns their text.
export const inflate = async (packed) => {
  const stream = new Blob([bytes(packed)]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Response(stream).text();
};

// The data of the page, by part. Each part is JSON in an element script#data-<part>. It is parsed when it is first used, so that the page
// opens fast. Parts that are not needed at once are compressed; `unpackParts` has to run before they are used.
const PARTS = ["name", "hero", "bodies", "playable", "charts", "tables", "compare"], texts = new Map();
const elementOf = (part) => document.querySelector(`script#data-${part}`);
export const material = Object.defineProperties({}, Object.fromEntries(PARTS.map((part) => {
  let parsed;
  const get = () => (parsed ??= JSON.parse(texts.get(part) ?? elementOf(part)?.textContent ?? "null"));
  return [part, { get, enumerable: true }];
})));
export const unpackParts = () => Promise.all(PARTS.map(async (part) => {
  const element = elementOf(part);
  if (element?.type === "application/zlib") texts.set(part, await inflate(element.textContent));
}));

// Functions to call when the colours change.
export const onTheme = [];

// The element with an id.
export const find = (id) => document.getElementById(id);

// The CSS colour of a token, in the current theme. A token is a colour variable of page.css, named without its two hyphens.
export const colour = (() => {
  // A token may contain light-dark(...). The browser computes its colour only for a property such as `color`. So this property is
  // set on a hidden element and read back.
  const probe = document.createElement("span");
  probe.hidden = true;
  document.body.append(probe);
  let colours = new Map();
  onTheme.push(() => { colours = new Map(); });
  return (token) => {
    if (!colours.has(token)) {
      probe.style.color = `var(--${token})`;
      colours.set(token, getComputedStyle(probe).color);
    }
    return colours.get(token);
  };
})();

// The colour of a token as [r, g, b], 0 to 255.
export const rgb = (token) => (colour(token).match(/[\d.]+/g) || [0, 0, 0]).slice(0, 3).map(Number);

// Lets the browser save a blob as a file. name: the file's name.
export const save = (blob, name) => {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
};

// Colours of the 3D views. They come from the tokens, which are the colour variables of page.css.

// All colours by name as [r, g, b], 0 to 255, for the current theme. dark: whether this theme is dark.
export const palette = () => {
  const dark = rgb("paper")[0] < 128;
  return {
    dark, body: dark ? [176, 184, 192] : [214, 214, 210], low: rgb("hurt-low"), high: rgb("hurt-high"),
    line: rgb("faint"), ink: rgb("ink"), accent: rgb("accent"), predicted: rgb("predicted"), second: rgb("g3"),
    ground: rgb("ground"), sky: rgb("sky"), zenith: rgb("zenith"), ghost: dark ? [196, 226, 238] : [96, 130, 146],
    healthy: dark ? [142, 170, 182] : [176, 198, 206],
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

// The key of a column of a channel in the Map of channel values.
export const valueKey = (channel, column) => `${channel.name}/${column}`;
// The channel whose columns stand for parts of the body; undefined if there is none.
export const bodyChannel = (spec) => spec.channels.find((channel) => channel.regions.length);
