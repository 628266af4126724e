// Unpacks a body from JSON for three.js. The caller passes the classes of its own three.js.
import { createCharacter as createController } from "./controller.js";
import { createRig } from "./feet.js";
import { bytes } from "./math.js";

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

// An ES module without dependencies, with which another page or a game runs and draws a character. hobble.d.ts documents it.

const FLAT = () => 0;

// data: content of character.json. place: [x, z] in cm, and heading: yaw in radians, where the character starts.
export const createCharacter = (data, { place = [0, 0], heading = 0 } = {}) => {
  const { spec } = data, controller = createController(spec, place, heading), rig = createRig(spec);
  const character = { spec, joints: spec.names, gaits: spec.gaits, channels: {}, parts: {}, places: rig.places, turns: rig.turns };
  for (const channel of spec.channels) {
    character.channels[channel.name] = { columns: channel.trained, highest: channel.highest };
    for (const [label, l] of Object.entries(channel.sliders)) character.parts[label] = { channel: channel.name, column: channel.columns[l] };
  }
  const copyState = () => Object.assign(character, { contacts: [...controller.contacts], phase: controller.phase, root: [...controller.root] });
  rig.take(controller.posePosition, controller.poseRotation);
  copyState();

  // Sets the values of a channel. values: column -> value. Columns that are not in `values` go back to 0.
  character.setChannel = (name, values = {}) => {
    const channel = spec.channels.find((each) => each.name === name);
    if (!channel) throw new RangeError(`there is no channel ${name}; the channels are: ${spec.channels.map((channel) => channel.name).join(", ") || "none"}`);
    for (const [column, value] of Object.entries(values)) {
      if (!channel.trained.includes(column)) throw new RangeError(`${name}: ${column} was not trained; the trained columns are: ${channel.trained.join(", ")}`);
      if (!(value >= 0 && value <= channel.highest)) throw new RangeError(`${name}: the value of ${column} is ${value}, but it must be a number from 0 to ${channel.highest}`);
    }
    channel.columns.forEach((column, l) => { controller.channelTargets[channel.first + l] = (values[column] || 0) / channel.scale; });
  };
  // Runs one frame, a sixtieth of a second. ground(x, z): height of the ground, cm. The other arguments are the target, see createTargets.
  character.step = ({ velocity = [0, 0], facing = null, gait = null, ground = FLAT } = {}) => {
    if (gait !== null && !spec.gaits.includes(gait)) throw new RangeError(`there is no gait ${gait}; the gaits are: ${spec.gaits.join(", ")}`);
    controller.frame(velocity, facing, gait, ground);
    rig.take(controller.posePosition, controller.poseRotation);
    copyState();
    return character;
  };
  return character;
};

// The body for three.js: {mesh, pose(character)}. `pose` moves the mesh to the pose of the character. THREE: the caller's three.js.
export const createFigure = (THREE, data, material = new THREE.MeshStandardMaterial({ color: 0xd6d6d2, roughness: .8 })) => {
  const { geometry, inverses, keep } = unpackBody(THREE, data.body), bones = keep.map(() => new THREE.Bone());
  const mesh = new THREE.SkinnedMesh(geometry, material), spot = new THREE.Vector3(), turn = new THREE.Quaternion(), unscaled = new THREE.Vector3(1, 1, 1);
  mesh.bindMode = THREE.DetachedBindMode;
  mesh.bind(new THREE.Skeleton(bones, inverses), new THREE.Matrix4());
  mesh.frustumCulled = false;
  return {
    mesh,
    pose({ places, turns }) {
      keep.forEach((j, b) => {
        spot.fromArray(places, 3 * j);
        turn.set(turns[4 * j + 1], turns[4 * j + 2], turns[4 * j + 3], turns[4 * j]);
        bones[b].matrixWorld.compose(spot, turn, unscaled);
      });
    },
  };
};
