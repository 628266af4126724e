"""The README's picture: both walks repeat without a seam."""

from __future__ import annotations

import numpy as np
import pytest

from hobble.measures.films import put_side_by_side


def loop(length: int, shade: int) -> list[np.ndarray]:
    """Pictures with their number in the first pixel."""
    out = []
    for number in range(length):
        picture = np.full((40, 40, 3), shade, np.uint8)
        picture[-1, 0] = number
        out.append(picture)
    return out


@pytest.mark.parametrize(("healthy", "hurt"), [(10, 10), (7, 10), (10, 7), (4, 12), (12, 4)])
def test_two_loops_of_different_length_end_together(healthy, hurt):
    images = put_side_by_side(loop(healthy, 200), loop(hurt, 100))
    assert len(images) == hurt
    lefts = [image.getpixel((0, 39))[0] for image in images]
    assert [image.getpixel((40, 39))[0] for image in images] == list(range(hurt))
    steps = np.diff([*lefts, lefts[0]]) % healthy  # from the last picture on to the first again
    assert steps.sum() % healthy == 0
    assert steps.max() - steps.min() <= 1
