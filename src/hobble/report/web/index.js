// Starts the parts of the page. `Hobble` gives access to them from the browser's console and from the tests.
import { bvhText } from "./actor.js";
import { colour, material, unpackParts } from "./base.js";
import { drawAll, startCharts } from "./charts.js";
import { createCharacter, createWatch } from "./character.js";
import { hero, startHero } from "./hero.js";
import { csv, startPage, startTables } from "./page.js";
import { player, startPlay } from "./play.js";
import { openClip, startCaptured } from "./recorded.js";
import { createChase } from "./view.js";

globalThis.Hobble = {
  bvh: bvhText, character: createCharacter, chase: createChase, colour, csv, material, watch: createWatch,
  ready: false,
  get drawAll() { return drawAll; },
  get hero() { return hero; },
  get openClip() { return openClip; },
  get player() { return player; },
};

const atOnce = [startPage, startTables, startCharts, startPlay], later = [startCaptured];
const startNext = () => {
  const start = later.shift();
  if (start) { setTimeout(startNext); start(); } else Hobble.ready = true;
};
const startOthers = async () => {
  // If the address is a link to Play, do not wait for the figures at the top.
  if (hero && !location.hash) await Promise.race([hero.shown, new Promise((done) => { setTimeout(done, 1000); })]);
  await unpackParts();
  setTimeout(startNext);
  atOnce.forEach((start) => start());
};

// The figures at the top walk at once, while the browser still reads the rest of the page. Then the other parts start one after
// another. Between two of them the browser has time to draw a picture.
if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", startOthers); else queueMicrotask(startOthers);
if (document.getElementById("hero")) document.documentElement.dataset.part = "play";
startHero();
hero?.shown.then(() => performance.mark("figures-walk")); // for benchmarks/report.py
