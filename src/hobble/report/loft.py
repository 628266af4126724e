"""The surface of a body in a pose: rings around the sections of its tubes, as in the page's `body.js`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hobble.core.quat import Array

RING = 16  # corners of a ring
UP = np.array([0.0, 1.0, 0.0])


def vertices(body: Mapping[str, Any], points: Array) -> Array:
    """World positions (V, 3) of the corners, tube after tube: its rings, then the tips of its two ends.

    body: of `body.body`; points (joints kept, 3): where its joints are, cm.
    """
    points = np.asarray(points, float)
    axes = {name: _unit(points[a] - points[b]) for name, (a, b) in body["axes"].items()}
    out = []
    for tube in body["tubes"]:
        foot = tube["kind"] == "foot"
        rings = _foot(tube, points, body["sole"]) if foot else _rings(tube, points, axes)
        out += [*rings.reshape(-1, 3), *_tips(rings)]
    return np.array(out)


def triangles(body: Mapping[str, Any]) -> NDArray[np.int64]:
    """Corners (T, 3) of the triangles, counter-clockwise seen from outside."""
    faces, start = [], 0
    k = np.arange(RING)
    after = (k + 1) % RING
    for tube in body["tubes"]:
        count = len(tube["sections"])
        for s in range(count - 1):
            a, b = start + s * RING, start + (s + 1) * RING
            faces += [np.stack([a + k, b + k, a + after], 1), np.stack([a + after, b + k, b + after], 1)]
        first, last, tips = start, start + (count - 1) * RING, start + count * RING
        faces.append(np.stack([first + k, first + after, np.full(RING, tips)], 1))
        faces.append(np.stack([last + after, last + k, np.full(RING, tips + 1)], 1))
        start = tips + 2
    return np.concatenate(faces) if faces else np.zeros((0, 3), np.int64)


def part_of_vertex(body: Mapping[str, Any]) -> NDArray[np.int64]:
    """Which of the body's parts each corner (V,) belongs to."""
    out: list[int] = []
    for tube in body["tubes"]:
        parts = [section[-1] for section in tube["sections"]]
        out += [*np.repeat(parts, RING), parts[0], parts[-1]]
    return np.array(out, np.int64)


def _rings(tube: Mapping[str, Any], points: Array, axes: Mapping[str, Array]) -> Array:
    """Corners (S, RING, 3) of the sections across the way from joint to joint."""
    rows = tube["sections"]
    a, b = (points[[row[i] for row in rows]] for i in (0, 1))
    t, cm, front, width, depth, turn = np.array([row[2:8] for row in rows], float).T[..., None]
    centre = a + (b - a) * t + _unit(b - a) * cm
    along = _unit(
        np.concatenate([centre[1:2] - centre[:1], centre[2:] - centre[:-2], centre[-1:] - centre[-2:-1]])
    )
    if tube["kind"] == "lateral":
        across = axes["hips"] * (1 - turn) + axes["shoulders"] * turn
    elif tube["kind"] == "front":
        across = np.cross(axes["shoulders"], axes["up"])[None]
    else:
        across = np.where(np.abs(along[:, 1:2]) > 0.7, [[1.0, 0.0, 0.0]], UP[None])
    u = _unit(across - along * (across * along).sum(-1, keepdims=True))
    v = np.cross(u, along)
    return _ellipses(centre + front * v, width * u, depth * v)


def _foot(tube: Mapping[str, Any], points: Array, sole: Array) -> Array:
    """Corners (S, RING, 3) of a foot, upright on its sole, from behind the ankle to before the toe."""
    ankle, toe = points[tube["ends"]]
    t, cm, width, height = np.array([row[:4] for row in tube["sections"]], float).T[..., None]
    length = np.linalg.norm(toe - ankle)
    ahead = (toe - ankle) / max(length, 1e-9)
    left = _unit(np.cross(UP, ahead))
    sine = min(max((sole[0] - sole[1]) / max(length, 1e-9), -0.9), 0.9)
    cosine = np.sqrt(1 - sine * sine)
    above = np.cross(ahead, left)
    along, up = ahead * cosine + above * sine, above * cosine - ahead * sine
    centre = ankle + along * (t * length * cosine + cm) + up * (height / 2 - sole[0])
    return _ellipses(centre, width * left, -height / 2 * up)


def _ellipses(centre: Array, u: Array, v: Array) -> Array:
    angle = 2 * np.pi * np.arange(RING) / RING
    return centre[:, None] + np.cos(angle)[:, None] * u[:, None] + np.sin(angle)[:, None] * v[:, None]


def _tips(rings: Array) -> Array:
    """The points (2, 3) in which a tube's ends close, a little beyond its first and last section."""
    out = []
    for ring, inner in ((rings[0], rings[1]), (rings[-1], rings[-2])):
        centre, depth = ring.mean(axis=0), np.linalg.norm(ring[RING // 4] - ring[3 * RING // 4]) / 2
        out.append(centre + 0.25 * depth * _unit(centre - inner.mean(axis=0)))
    return np.array(out)


def _unit(v: Array) -> Array:
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-9)
