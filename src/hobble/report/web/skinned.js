// Unpacks a body from JSON for three.js. The caller passes the classes of its own three.js.
import { bytes } from "./numbers.js";

// Returns {geometry, inverses, keep, balls}. keep: the joints that are bones. inverses: inverse matrix of each bone in the
// rest pose. balls: for each bone, a sphere [x, y, z, radius] around its part of the body, in the bone's coordinates.
export const unpackBody = ({ BufferAttribute, BufferGeometry, Matrix4, Quaternion, Sphere, Vector3 }, b) => {
  const geometry = new BufferGeometry(), steps = new Int16Array(bytes(b.corners));
  geometry.setAttribute("position", new BufferAttribute(Float32Array.from(steps, (v) => v * b.unit), 3));
  geometry.setAttribute("normal", new BufferAttribute(new Int8Array(bytes(b.normals)), 3, true));
  geometry.setAttribute("shade", new BufferAttribute(new Uint8Array(bytes(b.shade)), 1, true));
  geometry.setAttribute("skinIndex", new BufferAttribute(new Uint8Array(bytes(b.bone)), 4));
  geometry.setAttribute("skinWeight", new BufferAttribute(new Uint8Array(bytes(b.share)), 4, true));
  geometry.setIndex(new BufferAttribute(b.wide ? new Uint32Array(bytes(b.faces)) : new Uint16Array(bytes(b.faces)), 1));
  geometry.boundingSphere = new Sphere(new Vector3(), 1e6);
  const one = new Vector3(1, 1, 1);
  const inverses = b.places.map((place, i) => {
    const [w, x, y, z] = b.turns[i];
    return new Matrix4().compose(new Vector3(...place), new Quaternion(x, y, z, w), one).invert();
  });
  return { geometry, inverses, keep: b.keep, balls: b.balls };
};
