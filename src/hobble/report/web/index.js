// The report's page. `Hobble` gives access to its parts from the browser's console and from the tests.
import { colour, material } from "./base.js";
import { bvh } from "./bvh.js";
import { createCharacter } from "./character.js";
import { createChase } from "./chase.js";
import { hero } from "./hero.js";
import { createRig } from "./rig.js";
import { groundSamples, jointVelocities } from "./inputs.js";
import { drawAll } from "./charts.js";
import { csv } from "./tables.js";
import "./walking.js";
import { player } from "./play.js";
import { createLab } from "./lab.js";
import { openClip } from "./captured.js";
import { measureWalk, profile } from "./cycles.js";
import { createGrader, createWatch } from "./recogniser.js";
import "./fits.js";
import "./strips.js";
import "./page.js";

globalThis.Hobble = { bvh, character: createCharacter, chase: createChase, colour, csv, drawAll, grader: createGrader, groundSamples, hero, jointVelocities, lab: createLab, material, measureWalk, openClip, player, profile, rig: createRig, watch: createWatch };
