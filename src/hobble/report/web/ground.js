// The grounds in Play. height(x, z): height in cm. tile: only for grounds of level tiles, which are drawn with vertical edges. It is the size
// [x, z] of a tile in cm, with 0 for an unlimited size.
import {
  BufferAttribute, BufferGeometry, Color, DoubleSide, DynamicDrawUsage, Mesh, MeshBasicMaterial,
  MeshLambertMaterial, Vector4,
} from "three";
import { linear } from "./base.js";
import { minus } from "./math.js";

const randomOfTile = (i, k) => { // a random number from 0 to 1, always the same for the tile (i, k)
  const n = Math.sin(12.9898 * i + 78.233 * k) * 43758.5453;
  return n - Math.floor(n);
};
// About a quarter of the tiles are boxes, 6 to 28 cm high. There are none where the character starts.
const boxHeight = (x, z) => {
  const i = Math.round(x / 80), k = Math.round(z / 80);
  if (Math.abs(i) <= 1 && Math.abs(k) <= 1) return 0;
  const random = randomOfTile(i, k);
  return random > .72 ? 6 + 22 * (random - .72) / .28 : 0;
};

export const GROUNDS = new Map(Object.entries({
  flat: { height: () => 0 },
  rolling: { height: (x, z) => 14 * Math.sin(x / 170) * Math.cos(z / 140) + 8 * Math.sin((x + z) / 260) },
  slope: { height: (x, z) => .14 * z },
  steps: { height: (x, z) => 12 * Math.round(z / 110), tile: [0, 110] },
  boxes: { height: boxHeight, tile: [80, 80] },
}));

// The ground around the point that the camera looks at. It has grid lines one metre apart, and fainter ones 25 cm apart. It is darker under
// bodies and fades out far away.

const REACH = 1100; // cm from the middle to the edge
const STEP = 12.5; // cm between two heights of uneven ground
const BALLS = 24; // largest number of spheres (for round parts of bodies) that darken the ground

const geometryOf = (place, index) => {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(place, 3));
  geometry.setIndex(index);
  return geometry;
};
// The triangles of a grid of n by m corners.
const gridIndex = (n, m) => Array.from({ length: (n - 1) * (m - 1) }, (_, t) => {
  const a = Math.floor(t / (m - 1)) * m + t % (m - 1);
  return [a, a + 1, a + m, a + m, a + 1, a + m + 1];
}).flat();
// A grid of n by n corners. All coordinates are 0 until `fill` sets them.
const flatGrid = (n) => geometryOf(new Float32Array(3 * n * n), gridIndex(n, n));
// Level tiles between lines at `xs` and `zs`, with vertical faces where the heights of neighbours differ. height(x, z): cm. Each inner line
// is in the grid twice: as the end of one tile and the start of the next.
const tileGeometry = (xs, zs, height) => {
  const ends = (lines) => lines.slice(1).flatMap((end, i) => [lines[i], end].map((at) => ({ at, middle: (lines[i] + end) / 2 })));
  const [across, along] = [ends(xs), ends(zs)], place = across.flatMap((x) => along.flatMap((z) => [x.at, height(x.middle, z.middle), z.at]));
  const geometry = geometryOf(Float32Array.from(place), gridIndex(across.length, along.length)).toNonIndexed();
  geometry.computeVertexNormals();
  return geometry;
};

// simple: whether a processor draws without a graphics card. Then the fainter lines are left out, and bodies darken less of the ground.
export const createLand = (scene, simple) => {
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
        diffuseColor.rgb = mix(diffuseColor.rgb, ink, .2 * lines(vPlace.xz / 100., .004)${simple ? "" : " + .045 * lines(vPlace.xz / 25., .008)"});
        if (distance(vPlace.xz, focus) < ${simple ? "150." : "260."}) diffuseColor.rgb *= exp(-.85 * hidden());
        diffuseColor.a *= 1. - smoothstep(.25, 1., distance(vPlace.xz, focus) / reach);`);
  };
  material.customProgramCacheKey = () => `land ${simple}`;
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
    // Draws the ground around a point [x, y, z]. height, tile: see GROUNDS. name: each ground has its own.
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
  };
};

// Marks: strips, dots and footprints on the ground. For every picture, they are cleared and added again.

// most: the largest number of quads (faces with four corners).
export const createMarks = (scene, most) => {
  const geometry = new BufferGeometry(), colour = new Color(), index = [];
  const place = new BufferAttribute(new Float32Array(12 * most), 3), shade = new BufferAttribute(new Float32Array(16 * most), 4);
  for (const attribute of [place, shade]) attribute.setUsage(DynamicDrawUsage);
  for (let q = 0; q < most; q++) index.push(4 * q, 4 * q + 1, 4 * q + 2, 4 * q, 4 * q + 2, 4 * q + 3);
  geometry.setAttribute("position", place);
  geometry.setAttribute("color", shade);
  geometry.setIndex(index);
  const material = new MeshBasicMaterial({
    vertexColors: true, transparent: true, depthWrite: false, side: DoubleSide, polygonOffset: true, polygonOffsetFactor: -2, polygonOffsetUnits: -4,
  });
  const mesh = new Mesh(geometry, material);
  mesh.frustumCulled = false;
  scene.add(mesh);
  let used = 0;

  const marks = {
    clear() { used = 0; },
    // Adds a quad. points: its corners. rgb: its colour, 0 to 255. alpha: its opacity.
    addQuad(points, rgb, alpha) {
      if (used === most || alpha < .02) return;
      linear(rgb, colour);
      points.forEach((p, i) => {
        place.array.set(p, 12 * used + 3 * i);
        shade.array.set([colour.r, colour.g, colour.b, alpha], 16 * used + 4 * i);
      });
      used++;
    },
    // A strip on the ground from a to b, `width` cm wide, a little above it.
    addStrip(a, b, width, rgb, alpha) {
      const [x, z] = [b[0] - a[0], b[2] - a[2]], n = Math.hypot(x, z) || 1, [sx, sz] = [width / 2 * z / n, -width / 2 * x / n], up = .35;
      marks.addQuad([
        [a[0] - sx, a[1] + up, a[2] - sz], [a[0] + sx, a[1] + up, a[2] + sz],
        [b[0] + sx, b[1] + up, b[2] + sz], [b[0] - sx, b[1] + up, b[2] - sz],
      ], rgb, alpha);
    },
    // A footprint. heel, toe: the points on the ground where they stood. outline: cm ahead of the heel, and half the width there in cm.
    addPrint(heel, toe, rgb, alpha) {
      const way = minus(toe, heel), size = Math.hypot(...way) || 1, at = (cm) => heel.map((v, i) => v + way[i] * cm / size);
      const [sx, sz] = [way[2] / size, -way[0] / size];
      const across = ([cm, half]) => { const [x, y, z] = at(cm); return [[x - half * sx, y + .3, z - half * sz], [x + half * sx, y + .3, z + half * sz]]; };
      const outline = [[-5, 1.6], [-3.5, 3.1], [2, 3], [size, 4.6], [size + 5, 3.9], [size + 8, 1.6]].map(across);
      for (let i = 1; i < outline.length; i++) marks.addQuad([...outline[i - 1], outline[i][1], outline[i][0]], rgb, alpha);
    },
    // Passes the marks to the graphics card, before a picture is drawn.
    upload() {
      geometry.setDrawRange(0, 6 * used);
      place.needsUpdate = shade.needsUpdate = true;
      mesh.visible = used > 0;
    },
  };
  return marks;
};
