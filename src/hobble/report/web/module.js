// The character for another page or a game: an ES module without dependencies. hobble.d.ts documents it.
import { createCharacter as controller } from "./character.js";
import { createRig } from "./rig.js";
import { unpackBody } from "./skinned.js";

const FLAT = () => 0;

// data: content of character.json. place: [x, z] in cm, and heading: radians, where the character starts.
export const createCharacter = (data, { place = [0, 0], heading = 0 } = {}) => {
  const { spec } = data, c = controller(spec, place, heading), rig = createRig(spec);
  const character = { spec, joints: spec.names, gaits: spec.gaits, channels: {}, parts: {}, places: rig.places, turns: rig.turns };
  for (const one of spec.channels) {
    character.channels[one.name] = { columns: one.trained, highest: one.highest };
    for (const [label, l] of Object.entries(one.sliders)) character.parts[label] = { channel: one.name, column: one.columns[l] };
  }
  const read = () => Object.assign(character, { contacts: [...c.contacts], phase: c.phase, root: [...c.root] });
  rig.take(c.posePosition, c.poseRotation);
  read();

  // Sets the values of a channel. values: column -> value; columns that are not named go back to 0.
  character.setChannel = (name, values = {}) => {
    const one = spec.channels.find((channel) => channel.name === name);
    if (!one) throw new RangeError(`no channel ${name}; there are: ${spec.channels.map((channel) => channel.name).join(", ") || "none"}`);
    for (const [column, much] of Object.entries(values)) {
      if (!one.trained.includes(column)) throw new RangeError(`${name}: ${column} was not trained; there are: ${one.trained.join(", ")}`);
      if (!(much >= 0 && much <= one.highest)) throw new RangeError(`${name}: ${column} is ${much}, but it must be a number from 0 to ${one.highest}`);
    }
    one.columns.forEach((column, l) => { c.channelTargets[one.first + l] = (values[column] || 0) / one.scale; });
  };
  // Runs one frame, a sixtieth of a second.
  character.step = ({ velocity = [0, 0], facing = null, gait = null, ground = FLAT } = {}) => {
    if (gait !== null && !spec.gaits.includes(gait)) throw new RangeError(`no gait ${gait}; there are: ${spec.gaits.join(", ")}`);
    c.frame(velocity, facing, gait, ground);
    rig.take(c.posePosition, c.poseRotation);
    read();
    return character;
  };
  return character;
};

// The body for three.js: {mesh, pose(character)}. THREE: the namespace of the caller's three.js.
export const createFigure = (THREE, data, material = new THREE.MeshStandardMaterial({ color: 0xd6d6d2, roughness: .8 })) => {
  const { geometry, inverses, keep } = unpackBody(THREE, data.body), bones = keep.map(() => new THREE.Bone());
  const mesh = new THREE.SkinnedMesh(geometry, material), spot = new THREE.Vector3(), turn = new THREE.Quaternion(), one = new THREE.Vector3(1, 1, 1);
  mesh.bindMode = THREE.DetachedBindMode;
  mesh.bind(new THREE.Skeleton(bones, inverses), new THREE.Matrix4());
  mesh.frustumCulled = false;
  return {
    mesh,
    pose({ places, turns }) {
      keep.forEach((j, b) => {
        spot.fromArray(places, 3 * j);
        turn.set(turns[4 * j + 1], turns[4 * j + 2], turns[4 * j + 3], turns[4 * j]);
        bones[b].matrixWorld.compose(spot, turn, one);
      });
    },
  };
};
