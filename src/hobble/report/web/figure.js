// The bodies that the page contains. Each is unpacked when it is first used.
import {
  Bone, BufferAttribute, BufferGeometry, Color, DetachedBindMode, Matrix4, MeshBasicMaterial, MeshLambertMaterial,
  MeshStandardMaterial, Quaternion, Skeleton, SkinnedMesh, Sphere, Vector3,
} from "three";
import { linear, material } from "./base.js";
import { createBones, unpackBody } from "./math.js";

const THREE = { Bone, BufferAttribute, BufferGeometry, DetachedBindMode, Matrix4, Quaternion, Skeleton, SkinnedMesh, Sphere, Vector3 };

const unpacked = new Map();

// The unpacked body with a name, see `unpackBody`.
const bodyOf = (name, coarse) => {
  if (!unpacked.has(name)) unpacked.set(name, unpackBody(THREE, material.bodies[name], coarse));
  return unpacked.get(name);
};

// A figure: a body in a view. It is one surface. In each frame, its bones move it, and each bone gives its part of the body a colour.

// The material of the surface: solid, or a ghost that is transparent except at its outline. tints: the colour of each bone. The colour of a
// corner is the mean of the colours of its bones, with the weights of the skin. The attribute `shade` is 0 for a corner that the body hides
// from the light and 1 for a free one.
// simple: whether the shading is that of matt paper, for a processor that draws without a graphics card.
const createMaterial = (tints, ghost, simple) => {
  const look = { transparent: ghost, depthWrite: !ghost };
  const material = simple ? new MeshLambertMaterial(look) : new MeshStandardMaterial({ roughness: .78, metalness: 0, ...look });
  material.onBeforeCompile = (shader) => {
    shader.uniforms.tints = tints;
    shader.vertexShader = `attribute float shade; uniform vec3 tints[${tints.value.length}]; varying vec3 vTint; varying float vShade;
      ${shader.vertexShader}`.replace("#include <skinning_vertex>", `#include <skinning_vertex>
      vShade = shade;
      vTint = tints[int(skinIndex.x)] * skinWeight.x + tints[int(skinIndex.y)] * skinWeight.y
        + tints[int(skinIndex.z)] * skinWeight.z + tints[int(skinIndex.w)] * skinWeight.w;`);
    shader.fragmentShader = `varying vec3 vTint; varying float vShade;
${shader.fragmentShader}`
      .replace("#include <color_fragment>", "#include <color_fragment>\ndiffuseColor.rgb *= vTint;")
      .replace("#include <aomap_fragment>", `#include <aomap_fragment>
        reflectedLight.indirectDiffuse *= mix(.25, 1., vShade);
        reflectedLight.directDiffuse *= mix(.7, 1., vShade);`);
    if (ghost) {
      shader.fragmentShader = shader.fragmentShader.replace("#include <opaque_fragment>", `
        diffuseColor.a *= mix(.34, .9, pow(1. - abs(dot(normalize(vViewPosition), normal)), 1.7));
        #include <opaque_fragment>`);
    }
  };
  material.customProgramCacheKey = () => `figure ${tints.value.length} ${ghost} ${simple}`;
  return material;
};

// view: where it is drawn, see view.js. body: name of a body in the page. regions: for each bone, the channel columns that colour it. ghost:
// whether it is transparent.
export const createFigure = (view, body, regions = [], { ghost = false } = {}) => {
  const { geometry, keep, balls } = bodyOf(body, view.simple), boneCount = keep.length, skin = createBones(THREE, bodyOf(body));
  const tints = { value: keep.map(() => new Color()) }, meshes = [];
  const add = (material) => {
    const mesh = skin.add(material);
    mesh.boundingSphere = new Sphere(); // not used, but without it three.js computes one from all corners
    view.scene.add(mesh);
    meshes.push(mesh);
    return mesh;
  };
  if (ghost) { // draw only the depth first, so that no part of the ghost shows through another
    const depthMesh = add(new MeshBasicMaterial({ colorWrite: false }));
    depthMesh.renderOrder = 1;
  }
  const mesh = add(createMaterial(tints, ghost, view.simple));
  mesh.renderOrder = ghost ? 2 : 0;
  mesh.castShadow = !ghost;
  mesh.receiveShadow = !ghost;

  const figure = { mesh, keep, places: new Float64Array(3 * boneCount), turns: new Float64Array(4 * boneCount) };
  const spot = new Vector3();
  // Moves the bones to `figure.places` and `figure.turns`. colour(columns): the colour [r, g, b], 0 to 255, of a bone with these channel columns.
  figure.pose = (colour) => {
    for (let b = 0; b < boneCount; b++) {
      skin.move(b, figure.places, figure.turns, b);
      linear(colour(regions[b] || []), tints.value[b]);
    }
  };
  // Copies the places and rotations of the bones from arrays of all joints. They are drawn after the next `pose`,
  // moved by [x, z], cm.
  figure.copyPose = ({ places, turns }, [x, z] = [0, 0]) => {
    keep.forEach((j, b) => {
      for (let i = 0; i < 3; i++) figure.places[3 * b + i] = places[3 * j + i] + [x, 0, z][i];
      for (let i = 0; i < 4; i++) figure.turns[4 * b + i] = turns[4 * j + i];
    });
  };
  // The lowest `count` of the spheres [x, y, z, radius], cm, that stand for parts of the body. They darken the ground.
  figure.balls = (count = 10) => {
    const out = balls.map(([x, y, z, r], b) => {
      spot.set(x, y, z).applyMatrix4(skin.bones[b].matrixWorld);
      return [spot.x, spot.y, spot.z, r];
    });
    return out.sort((a, b) => a[1] - b[1]).slice(0, count);
  };
  figure.remove = () => { for (const each of meshes) { view.scene.remove(each); each.material.dispose(); } };

  // What is at the point (x, y) of the canvas, in pixels; null if it is not on the body. links: the channel columns of the bone that has most
  // weight there. deep: the distance from the camera, cm.
  figure.under = (x, y) => {
    mesh.boundingSphere = mesh.boundingBox = null; // of an earlier pose; three.js computes them again
    const [hit] = view.rayThrough(x, y).intersectObject(mesh);
    if (!hit) return null;
    const { skinIndex, skinWeight } = geometry.attributes, corner = hit.face.a, weight = (k) => skinWeight.getComponent(corner, k);
    const most = [0, 1, 2, 3].reduce((best, k) => (weight(k) > weight(best) ? k : best));
    return { links: regions[skinIndex.getComponent(corner, most)] || [], deep: hit.distance };
  };
  return figure;
};
