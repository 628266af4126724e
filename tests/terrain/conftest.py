"""A figure with feet at exactly given positions, and patches of every generated kind."""

from collections.abc import Callable

import numpy as np
import pytest

from hobble.core.clip import Clip
from hobble.core.skeleton import Skeleton
from hobble.database import DatabaseOptions
from hobble.terrain import HeightmapOptions, HeightSampling, Terrain
from hobble.terrain.heightmaps import heightmaps
from hobble.terrain.patches import Patches, draw_patches

CELL = 3.937007874
HEEL, TOE = 7.0, 2.5
KINDS = ("fractal", "hills", "stairs", "slope", "boxes", "beams")
PLACES = {  # positions of the joints relative to the root, and their roles
    "hips": (0, 0, 0),
    "left_hip": (9, -8, 0),
    "right_hip": (-9, -8, 0),
    "left_shoulder": (18, 45, 0),
    "right_shoulder": (-18, 45, 0),
    "left_heel": (9, -86, 0),
    "left_toe": (9, -90.5, 13),
    "right_heel": (-9, -86, 0),
    "right_toe": (-9, -90.5, 13),
}
Labelled = tuple[Clip, dict[str, np.ndarray]]
Height = Callable[[np.ndarray, np.ndarray], np.ndarray]


def options(**changed: object) -> Terrain:
    return Terrain(heel_height=HEEL, toe_height=TOE).model_copy(update=changed)


def database() -> HeightSampling:
    return HeightSampling(**DatabaseOptions().model_dump(include=set(HeightSampling.model_fields)))


def figure(feet: np.ndarray, root: np.ndarray) -> Clip:
    """A clip whose four contact joints are at `feet` (F, 4, 3) and whose hips are at `root` (F, 3)."""
    names = tuple(PLACES)
    offsets = np.array(list(PLACES.values()), float)
    skeleton = Skeleton("figure", names, (-1, *[0] * (len(names) - 1)), offsets, {n: n for n in names})
    rotations = np.zeros((len(feet), len(names), 4))
    rotations[..., 0] = 1
    translations = np.tile(offsets, (len(feet), 1, 1))
    translations[:, -4:] = feet - root[:, None]
    return Clip("figure", skeleton, 60.0, rotations, root, translations)


def walk(ground: Height, frames: int = 420, speed: float = 2.2, period: int = 64, seed: int = 0) -> Labelled:
    """A figure that walks along +Z over `ground`. Feet are exactly on it in stance and above it in swing."""
    rng = np.random.default_rng(seed)
    stride, feet = speed * period, np.zeros((frames, 4, 3))
    contacts = np.zeros((frames, 4), bool)
    for side, (x, shift) in enumerate(((9.0, 0.0), (-9.0, 0.5))):
        cycle, part = np.divmod(np.arange(frames) / period + shift, 1.0)
        swing = np.clip((part - 0.6) / 0.4, 0, 1)
        placed = rng.uniform(-3, 3, int(cycle.max()) + 2)
        here, there = placed[cycle.astype(int)], placed[cycle.astype(int) + 1]
        ease = swing * swing * (3 - 2 * swing)
        z = (cycle - shift) * stride + here + ease * (stride + there - here)
        for joint, (forward, height) in enumerate(((0.0, HEEL), (13.0, TOE))):
            across = np.full(frames, x)
            level = ground(across, z + forward)
            start = ground(across, (cycle - shift) * stride + here + forward)
            end = ground(across, (cycle + 1 - shift) * stride + there + forward)
            arc = np.maximum(level, start + ease * (end - start)) + 9 * np.sin(np.pi * swing)
            feet[:, 2 * side + joint] = np.stack([across, arc + height, z + forward], axis=-1)
            contacts[:, 2 * side + joint] = swing == 0
    z = np.arange(frames) * speed
    root = np.stack([np.zeros(frames), 93 + ground(np.zeros(frames), z), z], axis=-1)
    cycles = np.array([[s, s + period] for s in range(64, frames - 61 - period, period)])
    return figure(feet, root), {"contacts": contacts, "cycles": cycles}


def some_patches(count: int = 300, kinds: tuple[str, ...] = KINDS, seed: int = 1) -> Patches:
    entries = [HeightmapOptions(kind=kind, seed=i) for i, kind in enumerate(kinds)]
    maps = heightmaps(entries, [], cell=CELL)
    return draw_patches(maps, count=count, cell=CELL, size=128, highest=50.0, seed=seed)


@pytest.fixture(scope="session")
def patches() -> Patches:
    return some_patches()
