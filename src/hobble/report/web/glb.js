// Writes the played motion with the body as a binary glTF 2.0 file. Units are metres, Y is up.
import { at3, at4, bytes, conjugate, minus, multiply, rotate } from "./math.js";

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

// body: from `hobble.figure.pack.packed_body`. frames: as for `bvhText`. Returns the bytes of the file, with the bones of
// `hobble.figure.rig.rig_of`.
export const glbFile = (body, frames) => {
  const { names, parents, axes, places } = body.rig, buffer = createBuffer(), N = names.length;
  const corners = Array.from(new Int16Array(bytes(body.corners)), (v, k) => (v * body.unit + (k % 3 === 1 ? places[1][1] : 0)) / 100);
  const ends = (choose) => [0, 1, 2].map((i) => corners.reduce((best, v, k) => (k % 3 === i ? choose(best, v) : best), corners[i]));
  // The bytes of the normals are padded to lengths that glTF allows only as floats.
  const normals = Array.from(new Int8Array(bytes(body.normals)), (v) => v / 127);
  for (let i = 0; i < normals.length; i += 3) {
    const n = Math.hypot(normals[i], normals[i + 1], normals[i + 2]) || 1;
    for (let k = 0; k < 3; k++) normals[i + k] /= n;
  }
  const shares = new Uint8Array(bytes(body.share)), bone = new Uint8Array(bytes(body.bone)).map((b, i) => (shares[i] ? body.keep[b] + 1 : 0));
  const attributes = {
    POSITION: buffer.add(corners, "VEC3", 5126, { min: ends(Math.min), max: ends(Math.max) }), NORMAL: buffer.add(normals, "VEC3"),
    JOINTS_0: buffer.add(bone, "VEC4", 5121), WEIGHTS_0: buffer.add(shares, "VEC4", 5121, { normalized: true }),
  };
  const faces = body.wide ? new Uint32Array(bytes(body.faces)) : new Uint16Array(bytes(body.faces));
  const indices = buffer.add(faces, "SCALAR", body.wide ? 5125 : 5123);
  const inverseBindMatrices = buffer.add(places.flatMap((place, b) => inverseBind(place, axes[b])), "MAT4");
  const times = buffer.add(frames.map((_, f) => f / FPS), "SCALAR", 5126, { min: [0], max: [(frames.length - 1) / FPS] });
  const still = [1, 0, 0, 0], ordered = ([w, x, y, z]) => [x, y, z, w].map((v) => Math.max(-1, Math.min(1, v)));
  // The rotation of a bone relative to its parent. turn(b): that of the joint of bone b in the world.
  const local = (b, turn) => {
    const p = parents[b], q = p < 0 ? axes[b] : multiply(conjugate(multiply(turn(p), axes[p])), multiply(turn(b), axes[b])), n = Math.hypot(...q) || 1;
    return ordered(q.map((v) => v / n));
  };
  const samplers = [], channels = [];
  const animate = (node, path, type, values) => {
    channels.push({ sampler: samplers.length, target: { node, path } });
    samplers.push({ input: times, output: buffer.add(values, type), interpolation: "LINEAR" });
  };
  const hips = frames.map((frame) => at3(frame, 0).map((v) => v / 100));
  animate(0, "translation", "VEC3", hips.flatMap(([x, , z]) => [x, 0, z]));
  animate(1, "translation", "VEC3", hips.flatMap(([, y]) => rotate(conjugate(axes[0]), [0, y, 0])));
  for (let b = 1; b <= body.rig.joints; b++) {
    animate(b, "rotation", "VEC4", frames.flatMap((frame) => local(b, (k) => (k ? at4(frame.subarray(3), k - 1) : still))));
  }
  const nodes = names.map((name, b) => {
    const p = parents[b], children = parents.flatMap((q, k) => (q === b ? [k] : []));
    const translation = (p < 0 ? places[b] : rotate(conjugate(axes[p]), minus(places[b], places[p]))).map((v) => v / 100);
    return { name, translation, rotation: local(b, () => still), ...(children.length ? { children } : {}) };
  });
  const gltf = {
    asset: { version: "2.0", generator: "Hobble" }, scene: 0, scenes: [{ nodes: [0, N] }],
    nodes: [...nodes, { name: "body", mesh: 0, skin: 0 }],
    meshes: [{ primitives: [{ attributes, indices, material: 0 }] }],
    materials: [{ pbrMetallicRoughness: { baseColorFactor: [.66, .66, .64, 1], metallicFactor: 0, roughnessFactor: .8 } }],
    skins: [{ name: "character", skeleton: 0, joints: names.map((_, b) => b), inverseBindMatrices }],
    animations: [{ name: "played", samplers, channels }],
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
