// The bodies that the page contains. Each is unpacked when it is first used.
import { BufferAttribute, BufferGeometry, Matrix4, Quaternion, Sphere, Vector3 } from "three";
import { material } from "./base.js";
import { unpackBody } from "./skinned.js";

const unpacked = new Map();

// The unpacked body with a name, see `unpackBody`.
export const bodyOf = (name) => {
  if (!unpacked.has(name)) {
    unpacked.set(name, unpackBody({ BufferAttribute, BufferGeometry, Matrix4, Quaternion, Sphere, Vector3 }, material.bodies[name]));
  }
  return unpacked.get(name);
};
