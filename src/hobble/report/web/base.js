// What every part of the page shares: its data, its colours, numbers packed as text, and vectors.

export const material = JSON.parse(document.getElementById("material").textContent);

// Called when the colours change.
export const onTheme = [];

export const find = (id) => document.getElementById(id);

export const colour = (() => {
  // A custom property may hold light-dark(...), which only a real property resolves; so a hidden element wears it.
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

// The numbers [r, g, b] of a token, 0 to 255, for blending.
export const rgb = (token) => (colour(token).match(/[\d.]+/g) || [0, 0, 0]).slice(0, 3).map(Number);

// Saves a blob under a name.
export const save = (blob, name) => {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
};
