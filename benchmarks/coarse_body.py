"""Adds a coarse surface to the sculpted body, for browsers that draw without a graphics card.

    python benchmarks/coarse_body.py [--triangles 3000]

It writes `coarse` into src/hobble/figure/body.npz: triangles between some of the same corners. Edges are
collapsed into one of their ends, those first that change the surface least (quadrics of Garland and Heckbert,
1997). Run it after derive_body.py.
"""

import argparse
import heapq
from collections import defaultdict

import numpy as np

from hobble.core.files import load_npz
from hobble.core.quat import Array
from hobble.figure.mesh import FIGURE

FLIPPED = 0.3  # a triangle may turn until the dot product of its normals is this


def quadrics(corners: Array, faces: Array) -> Array:
    """(V, 4, 4) of each corner: the squared distances from the planes of its triangles, weighted by area."""
    a, b, c = corners[faces].swapaxes(0, 1)
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1, keepdims=True)
    plane = np.concatenate([normal, -(normal * a).sum(axis=1, keepdims=True)], axis=1) / np.maximum(
        area, 1e-12
    )
    out = np.zeros((len(corners), 4, 4))
    np.add.at(out, faces, (area[..., None] * plane[:, :, None] * plane[:, None])[:, None])
    return out


def coarse_faces(corners: Array, faces: Array, count: int) -> Array:
    """(about `count`, 3) triangles between some of the corners (V, 3) of a closed surface (T, 3)."""
    quadric, live = quadrics(corners, faces), {f: tuple(face) for f, face in enumerate(faces.tolist())}
    at: dict[int, set[int]] = defaultdict(set)  # corner -> its triangles
    for f, face in live.items():
        for corner in face:
            at[corner].add(f)
    heap: list[tuple[float, int, int]] = []

    def offer(u: int, v: int) -> None:
        """Offer to move corner u into corner v."""
        place = np.append(corners[v], 1.0)
        length = np.linalg.norm(corners[u] - corners[v])
        heapq.heappush(heap, (float(place @ (quadric[u] + quadric[v]) @ place) + 1e-3 * length**3, u, v))

    def around(u: int) -> set[int]:
        return {corner for f in at[u] for corner in live[f]} - {u}

    def normal(face: tuple[int, ...]) -> Array:
        a, b, c = corners[list(face)]
        made = np.cross(b - a, c - a)
        return made / max(float(np.linalg.norm(made)), 1e-12)

    for u in list(at):
        for v in around(u):
            offer(u, v)
    gone: set[int] = set()
    while len(live) > count and heap:
        cost, u, v = heapq.heappop(heap)
        if u in gone or v in gone or v not in around(u) or len(around(u) & around(v)) != 2:
            continue
        place = np.append(corners[v], 1.0)
        if float(place @ (quadric[u] + quadric[v]) @ place) > cost + 1e-9:
            offer(u, v)  # its surroundings have changed since
            continue
        moved = {f: tuple(v if c == u else c for c in live[f]) for f in at[u] if v not in live[f]}
        if any(normal(live[f]) @ normal(face) < FLIPPED for f, face in moved.items()):
            continue
        for f in at[u] - set(moved):
            for corner in live.pop(f):
                if corner != u:
                    at[corner].discard(f)
        live |= moved
        at[v] |= set(moved)
        quadric[v] += quadric[u]
        gone.add(u)
        del at[u]
        for w in around(v):
            offer(v, w)
            offer(w, v)
    return np.array(list(live.values()), np.uint16)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--triangles", type=int, default=3000)
    arguments = parser.parse_args()
    figure = dict(load_npz(FIGURE))
    figure["coarse"] = coarse_faces(figure["corners"].astype(float), figure["faces"], arguments.triangles)
    np.savez_compressed(FIGURE, **figure)
    print(f"{FIGURE}: {len(figure['faces'])} triangles, coarse {len(figure['coarse'])}")


if __name__ == "__main__":
    main()
