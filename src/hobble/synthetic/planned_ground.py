"""The ground for which a walk is planned: flat, slopes, steps (stairs) or uneven."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hobble.core.quat import Array

Ground = Callable[[Array, Array], Array]  # a function from x and z to the height of the ground, all in cm


def make_ground(kind: str, rng: np.random.Generator) -> Ground:
    """The ground of one clip. kind: "flat", "slopes", "steps" or "uneven".

    Slopes and steps go up and down along Z, which the figure faces at the start of the clip.
    """
    makers = {"flat": lambda _: flat, "slopes": _make_slopes, "steps": _make_steps, "uneven": _make_uneven}
    return makers[kind](rng)


def flat(x: Array, z: Array) -> Array:
    """Height 0 everywhere."""
    return np.zeros(np.broadcast_shapes(np.shape(x), np.shape(z)))


def _make_slopes(rng: np.random.Generator) -> Ground:
    """Long hills, up to about 12 degrees steep along Z and less steep along X."""
    return _make_waves(rng, lengths=(480, 640, 900), steepness=(0.07, 0.07, 0.07), across=0.35)


def _make_uneven(rng: np.random.Generator) -> Ground:
    """Bumps and hollows of a few centimetres, in all directions."""
    return _make_waves(
        rng,
        lengths=(110, 150, 190, 260, 340, 600),
        steepness=(0.05, 0.06, 0.06, 0.06, 0.06, 0.05),
        across=1.5,
    )


def _make_waves(
    rng: np.random.Generator, lengths: tuple[float, ...], steepness: tuple[float, ...], across: float
) -> Ground:
    """A sum of sine waves, each with a random start.

    lengths: wavelengths, cm, varied by up to 10 %. steepness: greatest slope of each wave, cm per cm. across:
    greatest angle between the Z axis and the direction of a wave, radians.
    """
    angles = rng.uniform(-across, across, len(lengths))
    wave_numbers = 2 * np.pi / (np.array(lengths) * rng.uniform(0.9, 1.1, len(lengths)))
    starts = rng.uniform(0, 2 * np.pi, len(lengths))
    heights = np.array(steepness) / wave_numbers

    def ground(x: Array, z: Array) -> Array:
        along = np.multiply.outer(np.asarray(x), np.sin(angles)) + np.multiply.outer(
            np.asarray(z), np.cos(angles)
        )
        return np.sin(along * wave_numbers + starts) @ heights

    return ground


def _make_steps(rng: np.random.Generator) -> Ground:
    """Stairs along Z. Flights of one to four steps go up and down in turn.

    Each step is 7 to 16 cm high and 62 to 130 cm deep.
    """
    count = 400  # steps; they reach more than 100 m in front of the start and behind it
    edges = np.cumsum(rng.uniform(62, 130, count))
    edges -= edges[count // 2]
    # 1 for a step up, -1 for a step down.
    directions = np.repeat(np.where(np.arange(count) % 2 == 0, 1.0, -1.0), rng.integers(1, 5, count))[:count]
    levels = np.concatenate([[0.0], np.cumsum(directions * rng.uniform(7, 16, count))])
    levels -= levels[count // 2]  # height 0 at the start

    def ground(x: Array, z: Array) -> Array:
        z = np.asarray(z) + 0 * np.asarray(x)  # in the common shape of x and z
        return levels[np.searchsorted(edges, z)]

    return ground
