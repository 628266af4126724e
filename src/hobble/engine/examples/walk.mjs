// A walk on a slope, in Node: node walk.mjs ../engine.wasm ../character.hob
import { readFileSync } from "node:fs";
import { Engine } from "./hobble.mjs";

const [wasm, file] = process.argv.slice(2).map((path) => new Uint8Array(readFileSync(path)));
const walker = new Engine(wasm, file).characters();
walker.aim(0, [0, 2.5]);
for (let frame = 1; frame <= 120; frame++) {
  walker.frame((x, z) => .05 * z);
  if (frame % 30 === 0) console.log(`after ${frame} frames the root is at ${Array.from(walker.root(), (v) => v.toFixed(1)).join(", ")} cm`);
}
