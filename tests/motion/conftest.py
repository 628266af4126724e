"""A small made-up walk, exact enough to measure sliding feet, and functions that write it to files."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hobble.core import quat
from hobble.core.bvh import write_bvh
from hobble.core.clip import Clip
from hobble.core.skeleton import Skeleton, aim_bone, local_rotations, rest_positions, two_bone_knee
from hobble.motion import ClipMotion
from hobble.motion.make import make_clip


def make_walk(skeleton: Skeleton, frames: int, fps: float, name: str = "walk") -> Clip:
    """A walk along +Z at 1 m/s on any rig with a T-pose. Feet on the ground do not slide."""
    time = np.arange(frames) / fps
    height = -0.93 * rest_positions(skeleton)[skeleton.role("left_toe"), 1]
    hips = np.stack([2 * np.sin(2 * np.pi * time), height + np.cos(4 * np.pi * time), 100 * time], axis=1)
    world = np.zeros((frames, len(skeleton.joints), 4))
    body = quat.mul(
        quat.yaw(0.1 * np.sin(2 * np.pi * time)), quat.from_euler(np.full((frames, 1), 0.05), "X")
    )
    world[:] = body[:, None]
    for side, sign in (("left", 1), ("right", -1)):
        swing = quat.from_axis_angle(np.array([1.0, 0, 0]), -0.4 * sign * np.sin(2 * np.pi * time))
        lowered = quat.from_axis_angle(np.array([0, 0, 1.0]), np.full(frames, -1.3 * sign))
        world[:, _below(skeleton, skeleton.role(f"{side}_shoulder"))] = quat.mul(swing, lowered)[:, None]
        _walk_leg(skeleton, world, hips, side, sign, time)
    return Clip(name, skeleton, fps, quat.continuous(local_rotations(skeleton, world)), hips)


def _below(skeleton: Skeleton, joint: int) -> list[int]:
    return [j for j in range(len(skeleton.joints)) if joint in skeleton.path_up(j)]


def _walk_leg(skeleton, world, hips, side, sign, time):
    hip, knee, heel, toe = (skeleton.role(f"{side}_{part}") for part in ("hip", "knee", "heel", "toe"))
    begin = 0.25 if sign > 0 else 0.75
    cycle = time + begin
    step, part = np.floor(cycle), cycle - np.floor(cycle)
    swing = np.clip((part - 0.6) / 0.4, 0, 1)
    eased = swing * swing * (3 - 2 * swing)
    ball = np.stack(
        [np.full_like(time, 8.0 * sign), 2 + 8 * np.sin(np.pi * swing), 100 * (step + 0.3 - begin + eased)],
        axis=1,
    )
    foot = quat.from_axis_angle(np.array([1.0, 0, 0]), 0.5 * np.sin(np.pi * swing))
    world[:, _below(skeleton, heel)] = foot[:, None]
    ankle = ball - quat.rotate(foot, skeleton.offsets[toe])
    start = hips.copy()
    for j in reversed(skeleton.path_up(hip, 0)):
        start = start + quat.rotate(world[:, skeleton.parents[j]], skeleton.offsets[j])
    thigh, shank = skeleton.offsets[knee], skeleton.offsets[heel]
    middle, ankle = two_bone_knee(
        start, ankle, np.array([0, 0, 1.0]), float(np.linalg.norm(thigh)), float(np.linalg.norm(shank))
    )
    world[:, hip] = aim_bone(np.broadcast_to(quat.IDENTITY, world[:, hip].shape), thigh, middle - start)
    world[:, knee] = aim_bone(np.broadcast_to(quat.IDENTITY, world[:, hip].shape), shank, ankle - middle)


@pytest.fixture(scope="session")
def walk(holden31: Skeleton) -> Clip:
    """Two seconds of walking at 120 Hz on the 31 joints."""
    return make_walk(holden31, 241, 120.0)


@pytest.fixture
def bvh(tmp_path: Path) -> Callable[..., Path]:
    """Write a clip as BVH; `edit` changes its text before it is written again."""

    def write(clip: Clip, name: str = "walk", edit: Callable[[str], str] | None = None, **how: Any) -> Path:
        path = tmp_path / f"{name}.bvh"
        write_bvh(path, clip, **({"decimals": 8} | how))
        if edit:
            path.write_bytes(edit(path.read_text()).encode())
        return path

    return write


@pytest.fixture
def make(root: Path):
    """`make_clip` onto a skeleton of config/skeletons, with options by keyword."""
    folder = root / "config" / "skeletons"

    def run(path: Path, skeleton: str = "holden31", **options: Any):
        file = folder / f"{skeleton}.yaml"
        return make_clip(path, file, folder, path.stem, skeleton, ClipMotion(**options))

    return run


@pytest.fixture(scope="session")
def walker() -> Callable[..., Clip]:
    """`make_walk`."""
    return make_walk
