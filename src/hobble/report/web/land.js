// The ground around the point that the camera looks at. It has grid lines one metre apart, and fainter ones 25 cm apart. It is darker under
// bodies and fades out far away.
import { BufferAttribute, BufferGeometry, Color, Mesh, MeshLambertMaterial, Vector4 } from "three";
import { linear } from "./paint.js";

const REACH = 1100; // cm from the middle to the edge
const STEP = 12.5; // cm between two heights of uneven ground
const BALLS = 24; // largest number of spheres (for round parts of bodies) that darken the ground

const geometryOf = (place, index) => {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(place, 3));
  geometry.setIndex(index);
  return geometry;
};
// A grid of n by n corners. All coordinates are 0 until `fill` sets them.
const flatGrid = (n) => {
  const index = [];
  for (let i = 0; i + 1 < n; i++) {
    for (let k = 0; k + 1 < n; k++) {
      const a = i * n + k;
      index.push(a, a + 1, a + n, a + n, a + 1, a + n + 1);
    }
  }
  return geometryOf(new Float32Array(3 * n * n), index);
};
// Level tiles between lines at `xs` and `zs`, with vertical faces where the heights of neighbours differ. height(x, z): cm.
const tileGeometry = (xs, zs, height) => {
  const place = [], index = [];
  const quad = (...corners) => {
    const a = place.length / 3;
    corners.forEach((corner) => place.push(...corner));
    index.push(a, a + 1, a + 2, a, a + 2, a + 3);
  };
  const level = xs.slice(1).map((x, i) => zs.slice(1).map((z, k) => height((x + xs[i]) / 2, (z + zs[k]) / 2)));
  for (let i = 0; i + 1 < xs.length; i++) {
    for (let k = 0; k + 1 < zs.length; k++) {
      const [x0, x1, z0, z1, y] = [xs[i], xs[i + 1], zs[k], zs[k + 1], level[i][k]];
      quad([x0, y, z0], [x0, y, z1], [x1, y, z1], [x1, y, z0]);
      const ahead = level[i][k + 1], aside = level[i + 1]?.[k];
      if (ahead !== undefined && ahead !== y) {
        const [a, b] = ahead > y ? [x1, x0] : [x0, x1], [low, high] = [Math.min(y, ahead), Math.max(y, ahead)];
        quad([a, low, z1], [b, low, z1], [b, high, z1], [a, high, z1]);
      }
      if (aside !== undefined && aside !== y) {
        const [a, b] = aside > y ? [z0, z1] : [z1, z0], [low, high] = [Math.min(y, aside), Math.max(y, aside)];
        quad([x1, low, a], [x1, low, b], [x1, high, b], [x1, high, a]);
      }
    }
  }
  const geometry = geometryOf(new Float32Array(place), index);
  geometry.computeVertexNormals();
  return geometry;
};

export const createLand = (scene) => {
  const focus = { value: [0, 0] }, reach = { value: REACH }, ink = { value: new Color() }, used = { value: 0 };
  const balls = { value: Array.from({ length: BALLS }, () => new Vector4()) };
  const material = new MeshLambertMaterial({ transparent: true });
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, { focus, reach, ink, balls, used });
    shader.vertexShader = `varying vec3 vPlace; varying vec3 vUp;\n${shader.vertexShader}`
      .replace("#include <begin_vertex>", "#include <begin_vertex>\nvPlace = position; vUp = normal;");
    shader.fragmentShader = `varying vec3 vPlace; varying vec3 vUp; uniform vec2 focus; uniform float reach; uniform vec3 ink;
      uniform vec4 balls[${BALLS}]; uniform int used;
      float lines(vec2 at, float width) {
        vec2 pixel = fwidth(at) + 1e-6, off = abs(fract(at - .5) - .5);
        vec2 drawn = (1. - smoothstep(vec2(width), vec2(width) + 1.5 * pixel, off)) * clamp(width / pixel + .35, 0., 1.);
        return max(drawn.x, drawn.y);
      }
      // About the share of the sky that the spheres hide from a point of the ground: for each, cosine of its direction * (radius / distance)^2.
      float hidden() {
        float sum = 0.;
        for (int i = 0; i < ${BALLS}; i++) {
          if (i >= used) break;
          vec3 way = balls[i].xyz - vPlace;
          float far = max(length(way), balls[i].w);
          sum += max(dot(vUp, way), 0.) * balls[i].w * balls[i].w / (far * far * far);
        }
        return sum;
      }\n${shader.fragmentShader}`
      .replace("#include <color_fragment>", `#include <color_fragment>
        diffuseColor.rgb = mix(diffuseColor.rgb, ink, .2 * lines(vPlace.xz / 100., .004) + .045 * lines(vPlace.xz / 25., .008));
        if (distance(vPlace.xz, focus) < 260.) diffuseColor.rgb *= exp(-.85 * hidden());
        diffuseColor.a *= 1. - smoothstep(.25, 1., distance(vPlace.xz, focus) / reach);`);
  };
  const mesh = new Mesh(flatGrid(2), material);
  mesh.frustumCulled = false;
  mesh.receiveShadow = true;
  mesh.renderOrder = -1;
  scene.add(mesh);

  let drawn = null; // which ground was drawn, and where
  const replaceGeometry = (geometry) => { mesh.geometry.dispose(); mesh.geometry = geometry; };
  // Fills the grid with n by n heights over x in [x0, x1] and z in [z0, z1]. at(i, k, x, z): the height in cm.
  const fill = (n, [x0, x1], [z0, z1], at) => {
    if (mesh.geometry.attributes.position.count !== n * n) replaceGeometry(flatGrid(n));
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
  // The edges of tiles along one axis, from `middle` - far to `middle` + far. The centres of tiles are at multiples of `size`.
  const tileEdges = (size, middle, far) => {
    if (!size) return [middle - far, middle + far];
    const from = Math.floor((middle - far) / size), to = Math.ceil((middle + far) / size);
    return Array.from({ length: to - from + 1 }, (_, i) => (from + i - .5) * size);
  };
  return {
    setColours(paint) {
      linear(paint.sky.map((v, i) => v + (paint.dark ? .75 : .55) * (paint.ground[i] - v)), material.color);
      linear(paint.line, ink.value);
    },
    // Sets the spheres [x, y, z, radius], cm, that darken the ground.
    darkenUnder(parts) {
      used.value = Math.min(BALLS, parts.length);
      for (let i = 0; i < used.value; i++) balls.value[i].set(...parts[i]);
    },
    // Draws the ground around a point [x, y, z]. height, tile: see grounds.js. name: each ground has its own.
    drawAround([x, , z], { height, tile } = { height: () => 0 }, name = "flat") {
      focus.value = [x, z];
      const key = `${name} ${Math.round(x / 200)} ${Math.round(z / 200)}`;
      if (key === drawn) return;
      drawn = key;
      const [cx, cz] = [200 * Math.round(x / 200), 200 * Math.round(z / 200)], far = REACH + 200;
      if (tile) { replaceGeometry(tileGeometry(tileEdges(tile[0], cx, far), tileEdges(tile[1], cz, far), height)); return; }
      const n = name === "flat" ? 2 : 2 * Math.round(far / STEP) + 1;
      fill(n, [cx - far, cx + far], [cz - far, cz + far], (i, k, u, w) => height(u, w));
    },
    // Draws a whole piece of ground. heights: n by n, flat, row i at the i-th x. x, z: the ranges [from, to], cm.
    drawPiece(n, x, z, heights) {
      focus.value = [(x[0] + x[1]) / 2, (z[0] + z[1]) / 2];
      reach.value = 4 * Math.max(x[1] - x[0], z[1] - z[0]);
      fill(n, x, z, (i, k) => heights[i * n + k]);
    },
  };
};
