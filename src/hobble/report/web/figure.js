// The figure: the surface of a body, moved to a pose and coloured frame by frame.
import { BufferAttribute, BufferGeometry, Color, Mesh, MeshStandardMaterial } from "three";
import { corners, partOfCorner, posed, surface } from "./body.js";
import { linear } from "./paint.js";

export const createFigure = (view, body, { opacity = 1, casts = true } = {}) => {
  const geometry = new BufferGeometry(), { corners: count, faces } = surface(body), parts = partOfCorner(body);
  const place = new BufferAttribute(new Float32Array(3 * count), 3), shade = new BufferAttribute(new Float32Array(3 * count), 3);
  geometry.setAttribute("position", place);
  geometry.setAttribute("color", shade);
  geometry.setIndex(faces);
  const solid = opacity === 1;
  const material = new MeshStandardMaterial({ vertexColors: true, roughness: .62, metalness: 0, transparent: !solid, opacity });
  const mesh = new Mesh(geometry, material), colours = body.parts.map(() => new Color());
  mesh.frustumCulled = false;
  mesh.castShadow = casts;
  mesh.receiveShadow = solid;
  view.scene.add(mesh);

  const figure = { mesh, tubes: [] };
  // at(j): place [x, y, z] of a kept joint. colour(links): [r, g, b] of a part, 0 to 255.
  figure.pose = (at, colour) => {
    figure.tubes = posed(body, at);
    corners(figure.tubes, place.array);
    body.parts.forEach((links, i) => linear(colour(links), colours[i]));
    for (let v = 0; v < count; v++) {
      const { r, g, b } = colours[parts[v]];
      shade.array[3 * v] = r;
      shade.array[3 * v + 1] = g;
      shade.array[3 * v + 2] = b;
    }
    place.needsUpdate = shade.needsUpdate = true;
    geometry.computeVertexNormals();
  };
  // The links of the part under a point of the screen, the nearest one; null where there is none.
  figure.under = (x, y) => {
    let best = null;
    figure.tubes.forEach((sections, tube) => sections.slice(1).forEach((section, s) => {
      const [p, q] = [view.project(sections[s].centre), view.project(section.centre)];
      const way = [q[0] - p[0], q[1] - p[1]];
      const t = Math.min(1, Math.max(0, ((x - p[0]) * way[0] + (y - p[1]) * way[1]) / (way[0] ** 2 + way[1] ** 2 || 1)));
      const off = Math.hypot(x - p[0] - t * way[0], y - p[1] - t * way[1]), deep = p[2] + t * (q[2] - p[2]);
      const half = Math.max(Math.hypot(...section.u), Math.hypot(...section.v));
      if (off > view.zoom * half / deep) return;
      const score = deep + 8 * off * deep / view.zoom / half; // where two overlap, the one whose middle is nearer
      if (!best || score < best.score) best = { score, part: body.tubes[tube].sections[s + (t > .5 ? 1 : 0)].at(-1) };
    }));
    return best && body.parts[best.part];
  };
  return figure;
};
