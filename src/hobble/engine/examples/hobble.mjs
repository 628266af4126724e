// Hobble in JavaScript, in a browser or in Node, by WebAssembly. hobble.h explains units, axes and errors.
// walk.mjs shows how to use it in Node.
//
// In a page: const bytes = async (url) => new Uint8Array(await (await fetch(url)).arrayBuffer());
//            const { Engine } = await import("./hobble.mjs");

const TARGET = 88; // bytes of a target
const PAGE = 65536;
const BY_SPEED = -1;

// The runtime with one character file. All characters that it makes share its memory, and the network in it.
export class Engine {
  // wasm: bytes of engine.wasm, or a WebAssembly.Module. file: bytes of character.hob. Throws an Error with the reason if the file is refused.
  constructor(wasm, file) {
    const unused = new Proxy({}, { get: () => () => 0 }); // functions of WASI that nothing calls
    const instance = new WebAssembly.Instance(wasm instanceof WebAssembly.Module ? wasm : new WebAssembly.Module(wasm), {
      hobble: { ground: (n, points, heights) => this.lookUp(n, points, heights) }, wasi_snapshot_preview1: unused,
    });
    this.c = instance.exports;
    this.c._initialize?.();
    this.end = this.c.__heap_base.value;
    this.ground = null;
    this.unused = []; // crowds that nobody needs any more
    this.file = this.take(file.length);
    this.size = file.length;
    new Uint8Array(this.c.memory.buffer).set(file, this.file);
    this.spare = this.take(1024); // for names
    this.sizes = new Map(); // number of characters -> the memory that they need
  }

  // The start of `size` unused bytes.
  take(size) {
    const at = Math.ceil(this.end / 64) * 64, missing = at + size - this.c.memory.buffer.byteLength;
    this.end = at + size;
    if (missing > 0) this.c.memory.grow(Math.ceil(missing / PAGE));
    return at;
  }

  // Views of memory. They are valid until more memory is taken.
  doubles(at, count) { return new Float64Array(this.c.memory.buffer, at, count); }
  integers(at, count) { return new Int32Array(this.c.memory.buffer, at, count); }

  text(at) {
    const bytes = new Uint8Array(this.c.memory.buffer, at);
    return new TextDecoder().decode(bytes.subarray(0, bytes.indexOf(0)));
  }

  name(text) {
    const bytes = new TextEncoder().encode(`${text}\0`);
    if (bytes.length > 1024) throw new RangeError("the name is too long");
    new Uint8Array(this.c.memory.buffer).set(bytes, this.spare);
    return this.spare;
  }

  check(code) {
    if (code < 0) throw new RangeError(this.text(this.c.hobble_error(code)));
    return code;
  }

  lookUp(count, points, heights) {
    const at = this.doubles(points, 2 * count), out = this.doubles(heights, count);
    for (let i = 0; i < count; i++) out[i] = this.ground(at[2 * i], at[2 * i + 1]);
  }

  // Characters at the origin, which run their frames together.
  characters(count = 1) {
    const same = this.unused.findIndex((crowd) => crowd.count === count);
    return same < 0 ? new Characters(this, count) : this.unused.splice(same, 1)[0];
  }
}

export class Characters {
  constructor(engine, count = 1) {
    const { c } = engine, why = engine.spare;
    if (!engine.sizes.has(count)) engine.sizes.set(count, c.hobble_size(engine.file, engine.size, count, why));
    const size = engine.sizes.get(count);
    if (!size) throw new Error(engine.text(why));
    Object.assign(this, { engine, c, count });
    this.h = c.hobble_create(engine.file, engine.size, count, engine.take(size), size, why);
    this.targets = engine.take(TARGET * count);
    this.joints = c.hobble_joints(this.h);
    this.columns = c.hobble_columns(this.h);
    this.bones = engine.take(7 * this.joints * 8);
  }

  // Gives the memory back to the engine. The characters must not be used any more.
  release() { this.engine.unused.push(this); }

  // Starts a character again. x, z: cm. yaw: radians.
  reset(character, x = 0, z = 0, yaw = 0) { this.engine.check(this.c.hobble_reset(this.h, character, x, z, yaw)); }

  // Sets the value of a column: its number, or the name of a part such as "left thigh".
  set(character, column, value) {
    const number = typeof column === "number" ? column : this.engine.check(this.c.hobble_column(this.h, 0, this.engine.name(column)));
    this.engine.check(this.c.hobble_set(this.h, character, number, value));
  }

  // How much the steps of a character differ from each other: 0 not at all, 1 as those of people do. The same seed gives the same walk.
  vary(character, amount, seed = character) { this.engine.check(this.c.hobble_vary(this.h, character, amount, seed)); }

  // Says what a character shall do. velocity, facing: [x, z]. gait: its name, or null: walk or jog, by the speed.
  aim(character, velocity, facing = null, gait = null) {
    const number = gait === null ? BY_SPEED : this.engine.check(this.c.hobble_gait(this.h, this.engine.name(gait)));
    const at = this.targets + TARGET * character;
    this.engine.doubles(at, 4).set([...velocity, ...(facing ?? [0, 0])]);
    this.engine.integers(at + 80, 1)[0] = number;
  }

  // Runs one frame. ground(x, z): the height in cm; null: flat.
  frame(ground = null) {
    this.engine.ground = ground;
    this.engine.check(this.c.hobble_web_frame(this.h, this.targets, ground ? 1 : 0));
  }

  // Views of what a function of hobble.h returns, such as ("positions", 3 * joints). They are valid until more memory is taken.
  view(name, count, character = 0) { return this.engine.doubles(this.c[`hobble_${name}`](this.h, character), count); }
  positions(character = 0) { return this.view("positions", 3 * this.joints, character); }
  rotations(character = 0) { return this.view("rotations", 4 * this.joints, character); }
  root(character = 0) { return this.view("root", 3, character); }

  // The pose with bones of constant length: [positions, rotations]. The next call overwrites them.
  skeleton(character = 0) {
    const turns = this.bones + 3 * this.joints * 8;
    this.c.hobble_bones(this.h, character, this.bones, turns);
    return [this.engine.doubles(this.bones, 3 * this.joints), this.engine.doubles(turns, 4 * this.joints)];
  }
}
