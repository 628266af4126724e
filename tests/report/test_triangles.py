"""Compiled drawing: which pixels a triangle covers, which is in front, and how pixels are averaged."""

from __future__ import annotations

import numpy as np

from hobble.report.raster import draw_triangles, finish_picture

FACE = np.array([[0, 1, 2]])
# Screen coordinates: y points down, and a front face has a negative area.
CORNER = np.array([[0.5, 0.5, 5.0], [0.5, 6.3, 5.0], [6.3, 0.5, 5.0]])


def inside() -> np.ndarray:
    """Pixels (9, 8) whose coordinates are inside the triangle of CORNER."""
    y, x = np.mgrid[:9, :8]
    return (x >= 1) & (y >= 1) & (x + y <= 6)


def test_the_nearer_triangle_is_seen_and_back_faces_are_not() -> None:
    picture, depth = np.zeros((9, 8, 3), np.float32), np.full((9, 8), np.inf, np.float32)
    near, far = np.tile([1.0, 0.0, 0.0], (3, 1)), np.tile([0.0, 1.0, 0.0], (3, 1))
    draw_triangles(CORNER[[0, 2, 1]], near, FACE, picture, depth)
    assert np.isinf(depth).all()
    for moved, colour in (([0, 0, 2], far), ([0, 0, 0], near), ([0, 0, 1], far)):
        draw_triangles(CORNER + moved, colour, FACE, picture, depth)
    assert np.allclose(depth[inside()], 5)
    assert np.allclose(picture[inside()], [1, 0, 0], atol=1e-6)
    assert np.isinf(depth[~inside()]).all()
    assert not picture[~inside()].any()


def test_a_pixel_is_the_mean_of_its_square_with_the_background_where_nothing_is() -> None:
    picture, depth = np.zeros((2, 4, 3), np.float32), np.full((2, 4), np.inf, np.float32)
    picture[0, 0], depth[0, 0] = [1.0, 0.0, 0.5], 3.0
    background = np.full((1, 2, 3), 0.4)
    assert finish_picture(picture, depth, background, 2).tolist() == [[[140, 77, 108], [102, 102, 102]]]
