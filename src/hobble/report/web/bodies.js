// The bodies that are stored in the page. Each is unpacked once.
import { BufferAttribute, BufferGeometry, Matrix4, Quaternion, Sphere, Vector3 } from "three";
import { material } from "./base.js";
import { unpackBody } from "./skinned.js";

const made = new Map();

export const bodyOf = (name) => {
  if (!made.has(name)) {
    made.set(name, unpackBody({ BufferAttribute, BufferGeometry, Matrix4, Quaternion, Sphere, Vector3 }, material.bodies[name]));
  }
  return made.get(name);
};
