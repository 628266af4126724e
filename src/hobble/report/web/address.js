// Reads the state of Play from a link. Anybody can write a link, so every part is checked.

// The values after "#play?" in an address. null if the address has no "#play?".
export const readAddress = (hash) => {
  const [, text = null] = hash.match(/^#play\?(.*)$/s) || [];
  return text === null ? null : new URLSearchParams(text);
};
// Reads a camera from the text "yaw,pitch,distance": {yaw, pitch} in radians and {distance} in cm, moved into the limits of the camera.
// null if the text is not three numbers.
export const readCamera = (text, { nearest = 140, furthest = 1500 } = {}) => {
  const parts = (text || "").split(",");
  if (parts.length !== 3 || !parts.every((part) => /^-?\d+(\.\d+)?$/.test(part.trim()))) return null;
  const [yaw, pitch, distance] = parts.map(Number);
  return {
    yaw: yaw % (2 * Math.PI), pitch: Math.min(1.45, Math.max(.02, pitch)), distance: Math.min(furthest, Math.max(nearest, distance)),
  };
};
// Reads [column, value] pairs from the text "column:value,column:value". Values that are not numbers from 0 to `highest` are left out.
export const readPairs = (text, highest) => (text || "").split(",").flatMap((pair) => {
  const cut = pair.lastIndexOf(":"), value = pair.slice(cut + 1);
  return cut > 0 && /^\d+(\.\d+)?$/.test(value) && Number(value) <= highest ? [[pair.slice(0, cut), Number(value)]] : [];
});
