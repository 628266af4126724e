"""Clips whose footfalls are known because they were made here."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.skeleton import Skeleton
from hobble.labels import LabelOptions


@pytest.fixture
def options() -> LabelOptions:
    """The original's margins and contacts; all else by default."""
    return LabelOptions(margins="drop", contacts="original")


def feet_only(skeleton: Skeleton, right: np.ndarray, left: np.ndarray, hips: np.ndarray, name: str) -> Clip:
    """A clip whose ankles are at given places (F, 3), by joint translations and without rotations."""
    frames = len(hips)
    rotations = np.tile(quat.IDENTITY, (frames, len(skeleton.joints), 1))
    translations = np.tile(skeleton.offsets, (frames, 1, 1))
    for role, place in (("right_heel", right), ("left_heel", left)):
        joint = skeleton.role(role)
        above = skeleton.path_up(skeleton.parents[joint])[:-1]  # without the root
        translations[:, joint] = place - hips - skeleton.offsets[above].sum(axis=0)
    return Clip(name, skeleton, 60.0, rotations, hips, translations)


def stepping(landings: np.ndarray, swing: int, stride: float, frames: int, side: float) -> np.ndarray:
    """(F, 3) an ankle that lands at the frames given after swings of `swing` frames and `stride` cm."""
    t = np.arange(frames, dtype=float)
    place = np.zeros((frames, 3))
    place[:, 0], place[:, 1] = side, 7.0
    for landing in landings:
        s = np.clip((t - (landing - swing)) / swing, 0.0, 1.0)
        place[:, 2] += stride * (s - np.sin(2 * np.pi * s) / (2 * np.pi))
        place[:, 1] += 12.0 * np.sin(np.pi * s) ** 2
    return place


@pytest.fixture
def walker(holden31: Skeleton) -> Callable[..., Clip]:
    """Makes a walk: the right foot lands every 2 `half` frames from `start`, the left at `limp` of that."""

    def make(frames=600, half=30, limp=0.5, start=40, swing=24, stride=120.0) -> Clip:
        right = np.arange(start, frames - 10, 2 * half, dtype=float)
        left = right + 2 * half * limp
        left = left[left < frames - 10]
        hips = np.zeros((frames, 3))
        hips[:, 1] = 93.0
        hips[:, 2] = np.clip(np.arange(frames) - start, 0, None) * stride / (2 * half)
        feet = (stepping(x, swing, stride, frames, s) for x, s in ((right, -9.0), (left, 9.0)))
        return feet_only(holden31, *feet, hips, "walker")

    return make


@pytest.fixture
def write(tmp_path: Path) -> Callable[[str, str], Path]:
    def to_file(name: str, text: str) -> Path:
        path = tmp_path / name
        path.write_text(text)
        return path

    return to_file
