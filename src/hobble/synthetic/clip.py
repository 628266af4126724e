"""One clip of the embedded data set: from its plan to motion, footsteps, gait keys and status."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from hobble.core.bvh import write_bvh
from hobble.core.clip import Clip
from hobble.core.files import write_text
from hobble.core.skeleton import Skeleton
from hobble.synthetic import files, injury
from hobble.synthetic.feet import move_foot
from hobble.synthetic.footsteps import landings, phase_curve, stances
from hobble.synthetic.gait import LEFT, RIGHT, healthy_style
from hobble.synthetic.ground import make_ground
from hobble.synthetic.path import gait_keys, margin, walk_path
from hobble.synthetic.pose import pose
from hobble.synthetic.recipes import GROUND, generator, plan


@dataclass(frozen=True)
class Walk:
    """A generated clip and its labels; frames count from 0 at the clip's rate.

    right, left: frames in which a foot lands. gait: (frame, label) keys. status: (first frame, severity) of each
    stretch of the hurt `link`, which is None in a healthy clip.
    """

    clip: Clip
    right: list[int]
    left: list[int]
    gait: list[tuple[int, str]]
    link: str | None
    status: list[tuple[int, int]]


def generate(
    clip: str,
    skeleton: Skeleton,
    frames: int,
    recipe: str | None,
    injured: str | None,
    ground: str,
    fps: float,
    seed: int,
) -> Walk:
    """Walk a recipe for `frames` frames at 60 Hz, written at `fps`; the same arguments give the same motion.

    Raises HobbleError for an unknown recipe or a link that cannot be hurt.
    """
    total = round(frames * fps / 60)
    first = margin(fps)
    recipe = recipe or ("injured" if injured else "walk-straight")
    segments = plan(recipe, total, fps, seed, clip)
    severity = slowing = None
    status = [(0, 0)]
    if injured:
        injury.check_link(injured, clip)
        status = injury.schedule(total)
        severity = injury.smoothed(status, total, first, fps)
        slowing = injury.slowing(severity, injured)
    path = walk_path(segments, total, fps, slowing, severity)
    style = healthy_style(path)
    if injured:
        style = injury.hurt(style, path.severity, injured)
    rng = generator(seed, clip, "walk")
    terrain = make_ground(GROUND.get(recipe, "flat"), rng)
    phase = phase_curve(style, fps, rng.random())
    steps = stances(path, style, phase, terrain, rng)
    feet = tuple(move_foot(steps[side], style, side, terrain) for side in (LEFT, RIGHT))
    rotations, root = pose(skeleton, path, style, phase, feet, terrain, rng)
    part = slice(first, first + total)
    motion = Clip(clip, skeleton, fps, rotations[part], root[part])
    right, left = (_frames(landings(phase, style, side), first, total) for side in (RIGHT, LEFT))
    return Walk(motion, right, left, gait_keys(segments, total, fps), injured, status)


def _frames(at: np.ndarray, first: int, total: int) -> list[int]:
    frames = np.ceil(at).astype(int) - first
    return [int(f) for f in frames if 0 <= f < total]


def write_clip(
    clip: str,
    skeleton: dict[str, Any],
    frames: int,
    recipe: str | None,
    injured: str | None,
    ground: str,
    options: dict[str, Any],
    *,
    bvh: str | FilePath,
    footsteps: str | FilePath,
    gait: str | FilePath,
    status: str | FilePath,
) -> None:
    """Generate a clip and write it as a user's folder would hold it. skeleton: as `Skeleton.to_dict`.

    options: `fps` of the files and `seed`. Raises HobbleError for what cannot be walked.
    """
    rig = Skeleton.from_dict(skeleton)
    walk = generate(clip, rig, frames, recipe, injured, ground, options["fps"], options["seed"])
    write_bvh(bvh, walk.clip)
    write_text(footsteps, files.footsteps_text(walk.right, walk.left))
    write_text(gait, files.gait_text(walk.gait))
    write_text(status, files.status_text(len(walk.clip), walk.link, walk.status))
