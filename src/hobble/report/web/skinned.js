// Unpacks a body from JSON for three.js. The caller passes the classes of its own three.js.
import { bytes } from "./numbers.js";

// body: from `hobble.figure.pack.packed_body`. In the result, keep: the joints that are bones. inverses: the inverse matrix of each bone in the
// rest pose. balls: for each bone, a sphere [x, y, z, radius] around its part of the body, in the coordinates of the bone.
export const unpackBody = ({ BufferAttribute, BufferGeometry, Matrix4, Quaternion, Sphere, Vector3 }, body) => {
  const geometry = new BufferGeometry(), corners = new Int16Array(bytes(body.corners));
  geometry.setAttribute("position", new BufferAttribute(Float32Array.from(corners, (v) => v * body.unit), 3));
  geometry.setAttribute("normal", new BufferAttribute(new Int8Array(bytes(body.normals)), 3, true));
  geometry.setAttribute("shade", new BufferAttribute(new Uint8Array(bytes(body.shade)), 1, true));
  geometry.setAttribute("skinIndex", new BufferAttribute(new Uint8Array(bytes(body.bone)), 4));
  geometry.setAttribute("skinWeight", new BufferAttribute(new Uint8Array(bytes(body.share)), 4, true));
  geometry.setIndex(new BufferAttribute(body.wide ? new Uint32Array(bytes(body.faces)) : new Uint16Array(bytes(body.faces)), 1));
  geometry.boundingSphere = new Sphere(new Vector3(), 1e6);
  const unscaled = new Vector3(1, 1, 1);
  const inverses = body.places.map((place, i) => {
    const [w, x, y, z] = body.turns[i];
    return new Matrix4().compose(new Vector3(...place), new Quaternion(x, y, z, w), unscaled).invert();
  });
  return { geometry, inverses, keep: body.keep, balls: body.balls };
};
