"""Generates heightmaps of six kinds from a seed: fractal noise, hills, stairs, slopes, boxes and beams.

Heights are chosen so that most patches of 5 x 5 m stay within 50 cm of their mean. Others are not used.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable

import numpy as np

from hobble.core.quat import Array

CELLS = 400  # number of rows, and of columns, of a map


def generate_heights(kind: str, seed: int, cell: float) -> Array:
    """(400, 400) heights of one kind of ground, cm. Equal arguments give equal heights.

    kind: a key of KINDS. cell: width of a cell, cm.
    """
    rng = np.random.default_rng([zlib.crc32(kind.encode()), seed])
    return KINDS[kind](rng, cell)


def fractal(rng: np.random.Generator, cell: float) -> Array:
    """Noise like rough soil. Its amplitude is 1 / frequency², and constant for waves longer than 8 m."""
    frequency = np.hypot(np.fft.fftfreq(CELLS, cell)[:, None], np.fft.rfftfreq(CELLS, cell))
    amplitude = 1 / np.maximum(frequency, 1 / 800) ** 2
    amplitude[0, 0] = 0
    noise = np.fft.irfft2(amplitude * np.fft.rfft2(rng.normal(size=(CELLS, CELLS))), (CELLS, CELLS))
    return noise / noise.std() * rng.uniform(12, 18)  # standard deviation 12 to 18 cm


def hills(rng: np.random.Generator, cell: float) -> Array:
    """Round hills and hollows, 0.6 to 2 m in radius, up to 35 cm high."""
    x, z = _cell_positions(cell)
    heights = np.zeros_like(x)
    for _ in range(60):
        centre = rng.uniform(0, CELLS * cell, 2)
        radius, height = rng.uniform(60, 200), rng.uniform(-35, 35)
        heights += height * np.exp(-((x - centre[0]) ** 2 + (z - centre[1]) ** 2) / (2 * (radius / 2) ** 2))
    return heights


def stairs(rng: np.random.Generator, cell: float) -> Array:
    """Lanes side by side. In each lane, a flight of 3 to 5 steps goes up or down; the next one goes back."""
    heights = np.zeros((CELLS, CELLS))
    along = np.arange(CELLS) * cell
    lane = 0
    while lane < CELLS:
        width = int(rng.uniform(200, 400) / cell)
        # Each step begins at an edge and has a level. position: along the lane, cm.
        edges, levels, level = [], [], 0.0
        position = -rng.uniform(0, 300)
        while position < CELLS * cell:
            tread, riser = rng.uniform(28, 42), rng.uniform(8, 17) * rng.choice([-1, 1])
            for sign in (1, -1):
                for _ in range(rng.integers(3, 6)):
                    if abs(level + sign * riser) > 60:  # cm; a flight that would go further ends here
                        break
                    position, level = position + tread, level + sign * riser
                    edges.append(position)
                    levels.append(level)
                position += rng.uniform(80, 250)
        steps = np.concatenate([[0.0], levels])[np.searchsorted(edges, along)]
        heights[lane : lane + width] = steps
        lane += width
    return heights


def slope(rng: np.random.Generator, cell: float) -> Array:
    """Ramps of 2 to 12 degrees, 1 to 4 m long. The whole map is tilted sideways by up to 5 degrees."""
    along = np.arange(CELLS) * cell
    knots, levels = [0.0], [0.0]
    while knots[-1] < along[-1]:
        length, steepness = rng.uniform(100, 400), np.tan(np.radians(rng.uniform(2, 12)))
        # 1 for up, -1 for down; from beyond 30 cm, a ramp leads back.
        direction = -np.sign(levels[-1]) if abs(levels[-1]) > 30 else rng.choice([-1, 1])
        knots.append(knots[-1] + length)
        levels.append(levels[-1] + direction * steepness * length)
    across = along * np.tan(np.radians(rng.uniform(-5, 5)))
    return np.interp(along, knots, levels)[:, None] + across[None]


def boxes(rng: np.random.Generator, cell: float) -> Array:
    """Boxes 5 to 45 cm high on a flat floor, to step and jump on."""
    heights = np.zeros((CELLS, CELLS))
    for _ in range(110):
        rows, columns = (rng.uniform(40, 180, 2) / cell).astype(int)
        i, j = rng.integers(0, CELLS, 2)
        heights[i : i + rows, j : j + columns] = rng.uniform(5, 45)
    return heights


def beams(rng: np.random.Generator, cell: float) -> Array:
    """Crossing beams, 20 to 35 cm wide and 45 to 55 cm above the floor."""
    x, z = _cell_positions(cell)
    heights = np.zeros_like(x)
    for _ in range(9):
        angle, height = rng.uniform(0, np.pi), rng.uniform(45, 55)
        centre = rng.uniform(0, CELLS * cell, 2)
        distance = (x - centre[0]) * np.cos(angle) + (z - centre[1]) * np.sin(angle)
        heights[np.abs(distance) < rng.uniform(20, 35) / 2] = height
    return heights


def _cell_positions(cell: float) -> tuple[Array, Array]:
    """x and z of every cell, each (400, 400), cm."""
    along = np.arange(CELLS) * cell
    x, z = np.meshgrid(along, along, indexing="ij")
    return x, z


# name -> function of a random generator and the width of a cell, cm
KINDS: dict[str, Callable[[np.random.Generator, float], Array]] = {
    "fractal": fractal,
    "hills": hills,
    "stairs": stairs,
    "slope": slope,
    "boxes": boxes,
    "beams": beams,
}
