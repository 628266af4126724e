// The ground: a sheet around where the camera looks, lit, with a grid a metre wide, fading out far away.
import { BufferAttribute, BufferGeometry, Color, Mesh, MeshLambertMaterial } from "three";
import { linear } from "./paint.js";

const REACH = 1100; // cm from the middle to the edge
const STEP = 12.5;

const sheet = (n) => {
  const geometry = new BufferGeometry(), index = [];
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(3 * n * n), 3));
  for (let i = 0; i + 1 < n; i++) {
    for (let k = 0; k + 1 < n; k++) {
      const a = i * n + k;
      index.push(a, a + 1, a + n, a + n, a + 1, a + n + 1);
    }
  }
  geometry.setIndex(index);
  return geometry;
};

export const createLand = (scene) => {
  const focus = { value: [0, 0] }, reach = { value: REACH }, ink = { value: new Color() };
  const material = new MeshLambertMaterial({ transparent: true });
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, { focus, reach, ink });
    shader.vertexShader = `varying vec3 vPlace;\n${shader.vertexShader}`
      .replace("#include <begin_vertex>", "#include <begin_vertex>\nvPlace = position;");
    shader.fragmentShader = `varying vec3 vPlace; uniform vec2 focus; uniform float reach; uniform vec3 ink;
      float lines(vec2 at, float width) {
        vec2 pixel = fwidth(at) + 1e-6, off = abs(fract(at - .5) - .5);
        vec2 drawn = (1. - smoothstep(vec2(width), vec2(width) + 1.5 * pixel, off)) * clamp(width / pixel + .35, 0., 1.);
        return max(drawn.x, drawn.y);
      }\n${shader.fragmentShader}`
      .replace("#include <color_fragment>", `#include <color_fragment>
        diffuseColor.rgb = mix(diffuseColor.rgb, ink, .32 * lines(vPlace.xz / 100., .004) + .08 * lines(vPlace.xz / 25., .008));
        diffuseColor.a *= 1. - smoothstep(.35, 1., distance(vPlace.xz, focus) / reach);`);
  };
  const mesh = new Mesh(sheet(2), material);
  mesh.frustumCulled = false;
  mesh.receiveShadow = true;
  mesh.renderOrder = -1;
  scene.add(mesh);

  let drawn = null;
  // A grid n by n of heights over x in [x0, x1] and z in [z0, z1]; at(i, k) gives the height in cm.
  const fill = (n, [x0, x1], [z0, z1], at) => {
    if (mesh.geometry.attributes.position.count !== n * n) {
      mesh.geometry.dispose();
      mesh.geometry = sheet(n);
    }
    const place = mesh.geometry.attributes.position;
    for (let i = 0, v = 0; i < n; i++) {
      for (let k = 0; k < n; k++) {
        const x = x0 + (x1 - x0) * i / (n - 1), z = z0 + (z1 - z0) * k / (n - 1);
        place.array[v++] = x;
        place.array[v++] = at(i, k, x, z);
        place.array[v++] = z;
      }
    }
    place.needsUpdate = true;
    mesh.geometry.computeVertexNormals();
  };
  return {
    colour(paint) {
      const tone = paint.floor.map((v, i) => v + (paint.dark ? .5 : .45) * (paint.ground[i] - v));
      linear(tone, material.color);
      linear(paint.line, ink.value);
    },
    // The ground that height(x, z) tells, around a point [x, y, z]; name: what tells one ground from another.
    around([x, , z], height, name = "flat") {
      focus.value = [x, z];
      const flat = name === "flat", key = `${name} ${Math.round(x / 200)} ${Math.round(z / 200)}`;
      if (key === drawn) return;
      drawn = key;
      const [cx, cz] = [200 * Math.round(x / 200), 200 * Math.round(z / 200)], far = REACH + 200;
      const n = flat ? 2 : 2 * Math.round(far / STEP) + 1;
      fill(n, [cx - far, cx + far], [cz - far, cz + far], (i, k, u, w) => height(u, w));
    },
    // A piece of ground of its own, all of it shown: n by n heights in rows of x.
    piece(n, x, z, heights) {
      focus.value = [(x[0] + x[1]) / 2, (z[0] + z[1]) / 2];
      reach.value = 4 * Math.max(x[1] - x[0], z[1] - z[0]);
      fill(n, x, z, (i, k) => heights[i * n + k]);
    },
  };
};
