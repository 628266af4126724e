// The state in a link. Anybody can write a link, so every part is checked.

// The values after "#play?" in an address, or null without them.
export const read = (hash) => {
  const [, text = null] = hash.match(/^#play\?(.*)$/s) || [];
  return text === null ? null : new URLSearchParams(text);
};
// "yaw,pitch,distance" as numbers within bounds; null if the text is not a camera.
export const camera = (text, { nearest = 140, furthest = 1500 } = {}) => {
  const parts = (text || "").split(",");
  if (parts.length !== 3 || !parts.every((part) => /^-?\d+(\.\d+)?$/.test(part.trim()))) return null;
  const [yaw, pitch, distance] = parts.map(Number);
  return {
    yaw: yaw % (2 * Math.PI), pitch: Math.min(1.45, Math.max(.02, pitch)), distance: Math.min(furthest, Math.max(nearest, distance)),
  };
};
// "column:value,column:value" as pairs. Values that are not a number from 0 to the highest are left out.
export const pairs = (text, highest) => (text || "").split(",").flatMap((pair) => {
  const cut = pair.lastIndexOf(":"), much = pair.slice(cut + 1);
  return cut > 0 && /^\d+(\.\d+)?$/.test(much) && Number(much) <= highest ? [[pair.slice(0, cut), Number(much)]] : [];
});
