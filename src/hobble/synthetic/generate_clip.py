"""Makes one synthetic clip: motion, footsteps and gait labels.

The motion follows a plan: a list of segments, each with a gait, a speed, a turn and a length.
"""

import itertools
import math
import pathlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from hobble.core.bvh import write_bvh
from hobble.core.clip import Clip
from hobble.core.errors import HobbleError
from hobble.core.files import write_text
from hobble.core.section import Section
from hobble.core.skeleton import Skeleton
from hobble.synthetic.feet import climb_stairs, landing_frames, move_foot, phase_curve, plan_stances
from hobble.synthetic.plan import GROUND, Ground, Segment, gait_keys, make_ground, plan, plan_path, rng_of
from hobble.synthetic.pose import pose_figure
from hobble.synthetic.style import LEFT, RIGHT, healthy_style

SHORTEST = 60  # frames at 60 Hz: least length of a clip, so that a foot lands in it
WRITTEN_LABEL_SUFFIXES = ("_footsteps.txt", "_gait.txt")  # endings of the label files that each clip gets


class Synthetic(Section):
    """Synthetic clips: their length, their frame rate and their seed."""

    frames: Annotated[int, Field(ge=600, le=1_000_000_000)] = Field(
        20_000, description="length of all clips together, in frames at 60 Hz"
    )
    fps: Literal[60, 120] = Field(120, description="frame rate of the files, frames a second")
    seed: int = Field(1, description="seed of all random choices")


@dataclass(frozen=True)
class GeneratedWalk:
    """A generated clip and its labels. Frames count from 0 at the clip's rate.

    right, left: frames in which each foot lands. gait: a list of (frame, label). Between two of these frames,
    the first label fades linearly into the second. ground: a function that gives the height of the ground for
    which the clip was planned.
    """

    clip: Clip
    right: list[int]
    left: list[int]
    gait: list[tuple[int, str]]
    ground: Ground


def generate_walk(
    clip: str, skeleton: Skeleton, frames: int, recipe: str | None, fps: float, seed: int
) -> GeneratedWalk:
    """Generate a clip from a recipe. Equal arguments give equal motion.

    clip: name of the clip. frames: its length, in frames at 60 Hz. recipe: a key of
    `hobble.synthetic.plan.RECIPES`; None: "walk-straight". fps: frame rate of the clip. seed: number that
    decides all random choices.

    Raises HobbleError for an unknown recipe.
    """
    recipe = recipe or "walk-straight"
    total = round(frames * fps / 60)
    segments = plan(recipe, total, fps, seed, clip)
    return walk_from_plan(clip, skeleton, segments, total, GROUND.get(recipe, "flat"), fps, seed)


def walk_from_plan(
    clip: str, skeleton: Skeleton, segments: list[Segment], total: int, ground: str, fps: float, seed: int
) -> GeneratedWalk:
    """Generate a clip of `total` frames at `fps` from a plan, `segments`.

    clip: name of the clip. ground: kind of ground, see `hobble.synthetic.plan.make_ground`.
    """
    path = plan_path(segments, total, fps)
    style = healthy_style(path)
    rng = rng_of(seed, clip, "walk")
    terrain = make_ground(ground, rng)
    phase = climb_stairs(phase_curve(style, fps, rng_of(seed, clip, "phase")), path, terrain)
    landings = (np.ceil(landing_frames(phase, side)).astype(int) - path.first for side in (RIGHT, LEFT))
    right, left = (frames[(frames >= 0) & (frames < total)].tolist() for frames in landings)
    steps = plan_stances(path, style, phase, terrain, rng)
    left_foot, right_foot = (move_foot(steps[side], path, style, side, terrain) for side in (LEFT, RIGHT))
    rotations, root = pose_figure(skeleton, path, style, phase, (left_foot, right_foot), terrain, rng)
    in_clip = slice(path.first, path.first + total)  # the path also has frames before and after the clip
    motion = Clip(clip, skeleton, fps, rotations[in_clip], root[in_clip])
    return GeneratedWalk(motion, right, left, gait_keys(segments, total, fps), terrain)


def write_clip(
    clip: str,
    skeleton: dict[str, Any],
    frames: int,
    recipe: str | None,
    options: Synthetic,
    *,
    bvh: str | pathlib.Path,
    footsteps: str | pathlib.Path,
    gait: str | pathlib.Path,
) -> None:
    """Generate a clip and write it as BVH and label files.

    skeleton: from `Skeleton.to_dict`. frames: length of the clip, in frames at 60 Hz. recipe: see
    `generate_walk`. options: the section `synthetic` of the data set. bvh, footsteps, gait: paths of the
    three files. Raises HobbleError for an unknown recipe or too few frames.
    """
    if frames < SHORTEST:
        enough = math.ceil(options.frames * SHORTEST / max(frames, 1))
        raise HobbleError(
            f"clip {clip}: {frames} frames at 60 Hz are too short for a step. "
            f"Set synthetic.frames to {enough} or more, or give the clip a larger `share`."
        )
    rig = Skeleton.from_dict(skeleton)
    walk = generate_walk(clip, rig, frames, recipe, options.fps, options.seed)
    write_bvh(bvh, walk.clip)
    write_text(footsteps, footsteps_text(walk.right, walk.left))
    write_text(gait, gait_text(walk.gait))


# The texts of the two label files of a clip: footsteps and gaits.


def footsteps_text(right: Sequence[int], left: Sequence[int]) -> str:
    """Lines `right left`: a frame in which the right foot lands, and the frame of the next left landing.

    A landing of the right foot has no line if the left foot does not land before the right foot lands again.
    right, left: frames in which each foot lands. Frames count from 0 in the arguments, from 1 in the file.
    """
    pairs = (
        (landing, next((frame for frame in left if frame > landing), np.inf), following)
        for landing, following in itertools.pairwise([*right, np.inf])
    )
    return "".join(f"{landing + 1} {after + 1}\n" for landing, after, end in pairs if after < end)


def gait_text(keys: Sequence[tuple[int, str]]) -> str:
    """A line `frame label` for each of `keys`. Frames count from 0 in the argument, from 1 in the file."""
    return "".join(f"{frame + 1} {label}\n" for frame, label in keys)
