// An ES module without dependencies, with which another page or a game runs and draws a character. hobble.d.ts documents it.
import { createCharacter as createMoved } from "./character.js";
import { createBones, unpackBody } from "./math.js";

const FLAT = () => 0;

// data: content of character.json. place: [x, z] in cm, and heading: yaw in radians, where the character starts. variation, seed: how much its
// steps differ, and in which way.
export const createCharacter = (data, { place = [0, 0], heading = 0, variation = 0, seed = 0 } = {}) => {
  const { spec } = data, moved = createMoved(spec, place, heading), J = spec.names.length;
  const character = { joints: spec.names, gaits: spec.gaits, channels: {}, parts: {}, places: new Float64Array(3 * J), turns: new Float64Array(4 * J) };
  for (const channel of spec.channels) {
    character.channels[channel.name] = { columns: channel.trained, highest: channel.highest };
    for (const [label, l] of Object.entries(channel.sliders)) character.parts[label] = { channel: channel.name, column: channel.columns[l] };
  }
  const copyState = () => {
    const [places, turns] = moved.skeleton;
    character.places.set(places);
    character.turns.set(turns);
    Object.assign(character, { contacts: [...moved.contacts], phase: moved.phase, root: [...moved.root] });
  };
  copyState();
  moved.vary(variation, seed);

  // Sets the values of a channel. values: column -> value. Columns that are not in `values` go back to their value at the start.
  character.setChannel = (name, values = {}) => {
    const channel = spec.channels.find((each) => each.name === name);
    if (!channel) throw new RangeError(`there is no channel ${name}; the channels are: ${spec.channels.map((channel) => channel.name).join(", ") || "none"}`);
    for (const [column, value] of Object.entries(values)) {
      if (!channel.trained.includes(column)) throw new RangeError(`${name}: ${column} was not trained; the trained columns are: ${channel.trained.join(", ")}`);
      if (!(value >= 0 && value <= channel.highest)) throw new RangeError(`${name}: the value of ${column} is ${value}, but it must be a number from 0 to ${channel.highest}`);
    }
    channel.columns.forEach((column, l) => moved.set(channel.first + l, values[column] ?? channel.start));
  };
  // Runs one frame, a sixtieth of a second. ground(x, z): height of the ground, cm.
  character.step = ({ velocity = [0, 0], facing = null, gait = null, ground = FLAT } = {}) => {
    if (gait !== null && !spec.gaits.includes(gait)) throw new RangeError(`there is no gait ${gait}; the gaits are: ${spec.gaits.join(", ")}`);
    moved.frame(velocity, facing, gait, ground);
    copyState();
    return character;
  };
  // Gives the character's memory to the next one that is made. It must not be used any more.
  character.release = moved.release;
  return character;
};

// The body for three.js: {mesh, pose(character)}. `pose` moves the mesh to the pose of the character. THREE: the caller's three.js.
export const createFigure = (THREE, data, material = new THREE.MeshStandardMaterial({ color: 0xd6d6d2, roughness: .8 })) => {
  const body = unpackBody(THREE, data.body), { add, move } = createBones(THREE, body);
  return { mesh: add(material), pose({ places, turns }) { body.keep.forEach((j, b) => move(b, places, turns, j)); } };
};
