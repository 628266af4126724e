// What all parts of the page share: its data and its colours.

// The data of the page, by part. Each part is JSON in an element script#data-<part>. It is parsed when it is first used, so that the page
// opens fast.
const PARTS = ["name", "hero", "bodies", "playable", "charts", "scenes", "strips", "grounds", "compare"];
export const material = Object.defineProperties({}, Object.fromEntries(PARTS.map((part) => {
  let parsed;
  const get = () => (parsed ??= JSON.parse(document.querySelector(`script#data-${part}`)?.textContent ?? "null"));
  return [part, { get, enumerable: true }];
})));

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
