// Hobble in JavaScript, in a browser or in Node, by WebAssembly. engine.wasm and character.hob are bytes (Uint8Array).
//
// node hobble.mjs ../engine.wasm ../character.hob
//
// In a page: const bytes = async (url) => new Uint8Array(await (await fetch(url)).arrayBuffer());
//            const { Characters } = await import("./hobble.mjs");

const WHY = 160, TARGET = 88; // sizes of the reason for a refusal, and of a target, in bytes
const PAGE = 65536;
const BY_SPEED = -1;

export class Characters {
  // Throws an Error with the reason if the character file is refused.
  constructor(wasm, file, count = 1) {
    this.ground = null;
    const unused = new Proxy({}, { get: () => () => 0 }); // functions of WASI that nothing calls
    const instance = new WebAssembly.Instance(new WebAssembly.Module(wasm), {
      hobble: { ground: (n, points, heights) => this.lookUp(n, points, heights) }, wasi_snapshot_preview1: unused,
    });
    this.c = instance.exports;
    this.c._initialize?.();
    this.end = this.c.__heap_base.value;
    const at = this.take(file.length), why = this.take(WHY);
    new Uint8Array(this.c.memory.buffer).set(file, at);
    const size = this.c.hobble_size(at, file.length, count, why);
    if (!size) throw new Error(this.text(why));
    this.h = this.c.hobble_create(at, file.length, count, this.take(size), size, why);
    this.targets = this.take(TARGET * count);
    this.spare = this.take(1024); // for names
    this.joints = this.c.hobble_joints(this.h);
  }

  // The start of `size` unused bytes.
  take(size) {
    const at = Math.ceil(this.end / 64) * 64, missing = at + size - this.c.memory.buffer.byteLength;
    this.end = at + size;
    if (missing > 0) this.c.memory.grow(Math.ceil(missing / PAGE));
    return at;
  }

  text(at) {
    const bytes = new Uint8Array(this.c.memory.buffer, at);
    return new TextDecoder().decode(bytes.subarray(0, bytes.indexOf(0)));
  }

  name(text) {
    const bytes = new TextEncoder().encode(`${text}\0`);
    new Uint8Array(this.c.memory.buffer).set(bytes.subarray(0, 1024), this.spare);
    return this.spare;
  }

  check(code) {
    if (code < 0) throw new RangeError(this.text(this.c.hobble_error(code)));
    return code;
  }

  // Sets the value of a column, such as "left thigh" of the channel "injury".
  set(character, part, value) {
    this.check(this.c.hobble_set(this.h, character, this.check(this.c.hobble_column(this.h, 0, this.name(part))), value));
  }

  // Says what a character shall do. velocity, facing: [x, z]. gait: its name, or null: walk or jog, by the speed.
  aim(character, velocity, facing = [0, 0], gait = null) {
    const number = gait === null ? BY_SPEED : this.check(this.c.hobble_gait(this.h, this.name(gait)));
    const at = this.targets + TARGET * character;
    new Float64Array(this.c.memory.buffer, at, 4).set([...velocity, ...facing]);
    new Int32Array(this.c.memory.buffer, at + 80, 1)[0] = number;
  }

  // Runs one frame. ground(x, z): the height in cm; null: flat.
  frame(ground = null) {
    this.ground = ground;
    this.check(this.c.hobble_web_frame(this.h, this.targets, ground ? 1 : 0));
  }

  lookUp(count, points, heights) {
    const at = new Float64Array(this.c.memory.buffer, points, 2 * count), out = new Float64Array(this.c.memory.buffer, heights, count);
    for (let i = 0; i < count; i++) out[i] = this.ground(at[2 * i], at[2 * i + 1]);
  }

  // A view of the pose: (joints, 3) positions, (joints, 4) rotations, (3) root. It is valid until more memory is taken.
  positions(character = 0) { return new Float64Array(this.c.memory.buffer, this.c.hobble_positions(this.h, character), 3 * this.joints); }
  rotations(character = 0) { return new Float64Array(this.c.memory.buffer, this.c.hobble_rotations(this.h, character), 4 * this.joints); }
  root(character = 0) { return new Float64Array(this.c.memory.buffer, this.c.hobble_root(this.h, character), 3); }
}

if (globalThis.process?.argv[1]?.endsWith("hobble.mjs")) {
  const { readFileSync } = await import("node:fs");
  const [wasm, file] = process.argv.slice(2).map((path) => new Uint8Array(readFileSync(path)));
  const characters = new Characters(wasm, file);
  characters.aim(0, [0, 2.5]);
  for (let frame = 1; frame <= 120; frame++) {
    characters.frame((x, z) => .05 * z);
    if (frame % 30 === 0) console.log(`after ${frame} frames the root is at ${Array.from(characters.root(), (v) => v.toFixed(1)).join(", ")} cm`);
  }
}
