// The report's page. What a person may want in the browser's console, and the tests use, is `Hobble`.
import { colour, material } from "./base.js";
import { corners, posed } from "./body.js";
import { bvh } from "./bvh.js";
import { createCharacter } from "./character.js";
import { drawAll } from "./charts.js";
import { csv } from "./tables.js";
import "./walking.js";
import { player } from "./play.js";
import "./captured.js";
import "./fits.js";
import "./strips.js";
import "./page.js";

const surface = (body, at) => Array.from(corners(posed(body, at), []));
globalThis.Hobble = { bvh, character: createCharacter, colour, csv, drawAll, material, player, surface };
