// Writes the played motion with the body as a binary glTF 2.0 file. Units are metres, Y is up.
import { at3, at4, bytes, conjugate, multiply, rotate } from "./math.js";

const FPS = 60;
const TYPES = { [5120]: Int8Array, [5121]: Uint8Array, [5123]: Uint16Array, [5125]: Uint32Array, [5126]: Float32Array };

// The numbers of the file, one after another, and what glTF says of them.
const createBuffer = () => {
  const parts = [], views = [], accessors = [];
  let size = 0;
  return {
    views, accessors,
    // Adds numbers and returns the index of their accessor. type: of an element, such as "VEC3". component: a key of TYPES.
    add(values, type, component = 5126, more = {}) {
      const data = TYPES[component].from(values), count = data.length / { SCALAR: 1, VEC3: 3, VEC4: 4, MAT4: 16 }[type];
      views.push({ buffer: 0, byteOffset: size, byteLength: data.byteLength });
      accessors.push({ bufferView: views.length - 1, componentType: component, count, type, ...more });
      parts.push(new Uint8Array(data.buffer));
      size += data.byteLength;
      if (size % 4) { parts.push(new Uint8Array(4 - size % 4)); size += 4 - size % 4; }
      return accessors.length - 1;
    },
    get size() { return size; },
    get parts() { return parts; },
  };
};

// The inverse bind matrix of a bone at `place` (cm) with rotation `turn`, in metres and by columns.
const inverseBind = (place, turn) => {
  const back = conjugate(turn), columns = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map((axis) => rotate(back, axis));
  const origin = rotate(back, place).map((v) => -v / 100);
  return [...columns.flatMap((column) => [...column, 0]), ...origin, 1];
};

// spec: the character. body: from `hobble.figure.pack.packed_body`. frames: as for `bvhText`. Returns the bytes of the file.
export const glbFile = (spec, body, frames) => {
  const { names, parents, offsets } = spec, buffer = createBuffer(), J = names.length, root = parents.findIndex((p) => p < 0);
  const corners = Array.from(new Int16Array(bytes(body.corners)), (v) => v * body.unit / 100), axes = [0, 1, 2];
  const ends = (choose) => axes.map((i) => corners.reduce((best, v, k) => (k % 3 === i ? choose(best, v) : best), corners[i]));
  // The bytes of the normals are padded to lengths that glTF allows only as floats.
  const normals = Array.from(new Int8Array(bytes(body.normals)), (v) => v / 127);
  for (let i = 0; i < normals.length; i += 3) {
    const n = Math.hypot(normals[i], normals[i + 1], normals[i + 2]) || 1;
    for (let k = 0; k < 3; k++) normals[i + k] /= n;
  }
  const shares = new Uint8Array(bytes(body.share));
  const attributes = {
    POSITION: buffer.add(corners, "VEC3", 5126, { min: ends(Math.min), max: ends(Math.max) }), NORMAL: buffer.add(normals, "VEC3"),
    JOINTS_0: buffer.add(new Uint8Array(bytes(body.bone)).map((bone, i) => (shares[i] ? bone : 0)), "VEC4", 5121), WEIGHTS_0: buffer.add(shares, "VEC4", 5121, { normalized: true }),
  };
  const faces = body.wide ? new Uint32Array(bytes(body.faces)) : new Uint16Array(bytes(body.faces));
  const indices = buffer.add(faces, "SCALAR", body.wide ? 5125 : 5123);
  const inverseBindMatrices = buffer.add(body.places.flatMap((place, b) => inverseBind(place, body.turns[b])), "MAT4");
  const times = buffer.add(frames.map((_, f) => f / FPS), "SCALAR", 5126, { min: [0], max: [(frames.length - 1) / FPS] });
  const localTurn = (frame, j) => {
    const turns = frame.subarray(3);
    return parents[j] < 0 ? at4(turns, j) : multiply(conjugate(at4(turns, parents[j])), at4(turns, j));
  };
  const unitTurn = (turn) => { const n = Math.hypot(...turn) || 1; return [turn[1], turn[2], turn[3], turn[0]].map((v) => v / n); };
  const tracks = names.map((_, j) => ({ input: times, output: buffer.add(frames.flatMap((frame) => unitTurn(localTurn(frame, j))), "VEC4"), interpolation: "LINEAR" }));
  tracks.push({ input: times, output: buffer.add(frames.flatMap((frame) => at3(frame, 0).map((v) => v / 100)), "VEC3"), interpolation: "LINEAR" });
  const nodes = names.map((name, j) => {
    const children = parents.flatMap((p, k) => (p === j ? [k] : []));
    return { name, translation: (j === root ? [0, 0, 0] : offsets[j]).map((v) => v / 100), ...(children.length ? { children } : {}) };
  });
  const gltf = {
    asset: { version: "2.0", generator: "Hobble" }, scene: 0, scenes: [{ nodes: [root, J] }],
    nodes: [...nodes, { name: "body", mesh: 0, skin: 0 }],
    meshes: [{ primitives: [{ attributes, indices, material: 0 }] }],
    materials: [{ pbrMetallicRoughness: { baseColorFactor: [.66, .66, .64, 1], metallicFactor: 0, roughnessFactor: .8 } }],
    skins: [{ joints: body.keep, inverseBindMatrices }],
    animations: [{
      name: "played", samplers: tracks,
      channels: tracks.map((_, k) => ({ sampler: k, target: k === J ? { node: root, path: "translation" } : { node: k, path: "rotation" } })),
    }],
    buffers: [{ byteLength: buffer.size }], bufferViews: buffer.views, accessors: buffer.accessors,
  };
  return joinChunks(new TextEncoder().encode(JSON.stringify(gltf)), buffer);
};

// The header of a binary glTF file and its two chunks: JSON, padded with spaces, and the numbers.
const joinChunks = (text, buffer) => {
  const padding = new Uint8Array((4 - text.length % 4) % 4).fill(32), length = text.length + padding.length;
  const head = new Uint32Array([0x46546c67, 2, 28 + length + buffer.size, length, 0x4e4f534a]), second = new Uint32Array([buffer.size, 0x004e4942]);
  const out = new Uint8Array(head[2]);
  let at = 0;
  for (const part of [head, text, padding, second, ...buffer.parts]) { out.set(new Uint8Array(part.buffer, part.byteOffset, part.byteLength), at); at += part.byteLength; }
  return out;
};
