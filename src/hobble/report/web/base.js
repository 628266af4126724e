// What all parts of the page share: its data and its colours.

// The data of the page, one element for each part. A part is parsed when it is first used, so that the page opens fast.
const PARTS = ["name", "hero", "bodies", "playable", "charts", "scenes", "strips", "grounds", "compare"];
export const material = Object.defineProperties({}, Object.fromEntries(PARTS.map((part) => {
  let known;
  const get = () => (known ??= JSON.parse(document.querySelector(`script#data-${part}`)?.textContent ?? "null"));
  return [part, { get, enumerable: true }];
})));

// Functions to call when the colours change.
export const onTheme = [];

export const find = (id) => document.getElementById(id);

export const colour = (() => {
  // A custom property may contain light-dark(...). The browser resolves that only in a real property, so set one on a
  // hidden element and read it back.
  const probe = document.createElement("span");
  probe.hidden = true;
  document.body.append(probe);
  let known = new Map();
  onTheme.push(() => { known = new Map(); });
  return (token) => {
    if (!known.has(token)) {
      probe.style.color = `var(--${token})`;
      known.set(token, getComputedStyle(probe).color);
    }
    return known.get(token);
  };
})();

// The colour [r, g, b], 0 to 255, of a token, for blending.
export const rgb = (token) => (colour(token).match(/[\d.]+/g) || [0, 0, 0]).slice(0, 3).map(Number);

// Saves a blob under a name.
export const save = (blob, name) => {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
};
