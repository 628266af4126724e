// The script of index.html. `npm install three` and any bundler make a page of it.
import * as THREE from "three";
import { createCharacter, createFigure } from "./hobble.js";
import data from "./character.json";

const character = createCharacter(data), figure = createFigure(THREE, data), scene = new THREE.Scene();
const camera = new THREE.PerspectiveCamera(35, innerWidth / innerHeight, 1, 5000), renderer = new THREE.WebGLRenderer({ antialias: true });
renderer.setSize(innerWidth, innerHeight);
document.body.append(renderer.domElement);
scene.background = new THREE.Color(0xeceae4);
scene.add(figure.mesh, new THREE.HemisphereLight(0xffffff, 0x998877, 2), new THREE.GridHelper(20000, 200, 0xbbbbbb, 0xd5d2ca));

const keys = new Set(), slider = document.getElementById("much"), part = Object.values(character.parts)[0];
document.getElementById("part").textContent = `${Object.keys(character.parts)[0] ?? "nothing"}, 0 to 10`;
addEventListener("keydown", (event) => keys.add(event.code));
addEventListener("keyup", (event) => keys.delete(event.code));
let heading = 0, last = performance.now(), due = 0;
renderer.setAnimationLoop((now) => {
  due = Math.min(4, due + (now - last) * .06); // frames to run: the character always runs at 60 frames a second, also on a faster or slower screen
  last = now;
  for (; due >= 1; due--) {
    heading += .03 * (keys.has("ArrowLeft") - keys.has("ArrowRight")); // radians
    const speed = keys.has("ArrowDown") ? 0 : keys.has("ShiftLeft") ? 7 : 2.5; // cm a frame
    if (part) character.setChannel(part.channel, { [part.column]: Number(slider.value) / 10 * character.channels[part.channel].highest });
    character.step({ velocity: [speed * Math.sin(heading), speed * Math.cos(heading)] });
  }
  figure.pose(character);
  const [x, , z] = character.root;
  camera.position.set(x + 260, 150, z + 330);
  camera.lookAt(x, 85, z);
  renderer.render(scene, camera);
});
