// Computes with vectors of three numbers and with rotations, and unpacks a body.

// The bytes of a base64 text, as an ArrayBuffer.
export const bytes = (text) => {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text).buffer;
  const raw = atob(text), out = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) out[i] = raw.charCodeAt(i);
  return out.buffer;
};

const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
// The vector between a (t = 0) and b (t = 1).
export const mix = (a, b, t) => a.map((v, i) => v + (b[i] - v) * t);
// The same angle in -pi to pi.
export const wrap = (angle) => angle - 2 * Math.PI * Math.floor((angle + Math.PI) / (2 * Math.PI));

// Computes with rotations. A rotation is a quaternion [w, x, y, z]. Flat arrays have four numbers for each rotation.

// The rotation that turns by the second argument first, then by the first.
export const multiply = ([a, b, c, d], [e, f, g, h]) => [
  a * e - b * f - c * g - d * h, a * f + b * e + c * h - d * g, a * g - b * h + c * e + d * f, a * h + b * g - c * f + d * e,
];
// The inverse rotation.
export const conjugate = ([w, x, y, z]) => [w, -x, -y, -z];
// The vector v, turned by q.
export const rotate = (q, v) => {
  const axis = [q[1], q[2], q[3]], t = cross(axis, v).map((x) => 2 * x), more = cross(axis, t);
  return v.map((x, i) => x + q[0] * t[i] + more[i]);
};
// Rotation j of a flat array of rotations, and position j of a flat array of positions.
export const at4 = (array, j) => [array[4 * j], array[4 * j + 1], array[4 * j + 2], array[4 * j + 3]];
export const at3 = (array, j) => [array[3 * j], array[3 * j + 1], array[3 * j + 2]];

// Interpolates along the shorter way from the rotation at index `i` of `a` (t = 0) to the rotation at index `k` of `b` (t = 1). Writes the
// result into `out` at index `o`.
export const mixTurn = (a, i, b, k, t, out, o) => {
  const near = a[i] * b[k] + a[i + 1] * b[k + 1] + a[i + 2] * b[k + 2] + a[i + 3] * b[k + 3] < 0 ? -t : t;
  let n = 0;
  for (let c = 0; c < 4; c++) { out[o + c] = (1 - t) * a[i + c] + near * b[k + c]; n += out[o + c] ** 2; }
  n = Math.sqrt(n) || 1;
  for (let c = 0; c < 4; c++) out[o + c] /= n;
};

// A body from JSON for three.js. The caller passes its own three.js. body: from `hobble.figure.pack.packed_body`. coarse: whether it has fewer
// triangles, for a processor that draws without a graphics card. In the result, keep: the joints that are bones. balls: for each bone, a sphere [x, y, z, radius] around its part of the body, in the coordinates of the bone.
export const unpackBody = ({ BufferAttribute, BufferGeometry, Sphere, Vector3 }, body, coarse = false) => {
  const geometry = new BufferGeometry(), set = (name, ...values) => geometry.setAttribute(name, new BufferAttribute(...values));
  set("position", Float32Array.from(new Int16Array(bytes(body.corners)), (v) => v * body.unit), 3);
  set("normal", new Int8Array(bytes(body.normals)), 3, true);
  set("shade", new Uint8Array(bytes(body.shade)), 1, true);
  set("skinIndex", new Uint8Array(bytes(body.bone)), 4);
  set("skinWeight", new Uint8Array(bytes(body.share)), 4, true);
  geometry.setIndex(new BufferAttribute(new Uint16Array(bytes(coarse ? body.coarse : body.faces)), 1));
  geometry.boundingSphere = new Sphere(new Vector3(), 1e6);
  return { geometry, places: body.places, keep: body.keep, balls: body.balls };
};

// The bones of an unpacked body. add(material): a surface that they move. move(b, places, turns, j): puts bone b to place and rotation j of flat
// arrays.
export const createBones = ({ Bone, DetachedBindMode, Matrix4, Quaternion, Skeleton, SkinnedMesh, Vector3 }, { geometry, places: rest }) => {
  const bones = rest.map(() => new Bone()), skeleton = new Skeleton(bones, rest.map(([x, y, z]) => new Matrix4().makeTranslation(-x, -y, -z)));
  const spot = new Vector3(), turn = new Quaternion(), unscaled = new Vector3(1, 1, 1);
  return {
    bones,
    add(material) {
      const mesh = new SkinnedMesh(geometry, material);
      mesh.bindMode = DetachedBindMode;
      mesh.bind(skeleton, new Matrix4());
      mesh.frustumCulled = false;
      return mesh;
    },
    move(b, places, turns, j) {
      spot.fromArray(places, 3 * j);
      turn.set(turns[4 * j + 1], turns[4 * j + 2], turns[4 * j + 3], turns[4 * j]);
      bones[b].matrixWorld.compose(spot, turn, unscaled);
    },
  };
};
