"""Finds the floor of a clip from the feet, and moves a flat floor to height 0."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.motion.rig import leg_length

SOLE = 3.0  # cm: height of the toe joint of a standing foot above the floor
OFF = 3.0  # cm: a clip is moved if its floor is further from height 0
CRAWLS = 15.0  # cm: takes the place of OFF if the figure is not upright, whose toes hardly show the floor
UPRIGHT = 0.8  # least height of the hips above the toes of an upright figure, in leg lengths
EVEN = 12.0  # cm between high and low steps on flat ground; running has 9, gentle bumps have 14
SLOW = 0.3  # cm a frame at 60 Hz: a toe that rises or falls faster is in the air
FEWEST, SHORTEST = 4, 1 / 12  # a floor is found only if a foot stands for so many frames and so many seconds


def on_floor(clip: Clip) -> tuple[Clip, list[str], list[str]]:
    """A clip on flat ground, moved so that its floor is at height 0 if it was more than 3 cm off.

    Also returns two lists. The first holds a sentence if the clip was moved. The second holds one if it was
    not moved because its feet stand at so many heights that the ground cannot be flat.
    """
    toes = [clip.skeleton.role(f"{side}_toe") for side in ("left", "right")]
    lower = clip.positions[:, toes, 1].min(axis=1)
    standing = lower[:-1][np.abs(np.diff(lower)) * clip.fps / 60.0 < SLOW]
    if len(standing) < max(FEWEST, round(SHORTEST * clip.fps)):
        return clip, [], []
    low, usual, high = np.percentile(standing, [10, 25, 90])
    floor = float(usual) - SOLE
    if abs(floor) <= (OFF if _stands(clip, lower) else CRAWLS):
        return clip, [], []
    if high - low > EVEN:
        heights = f"The feet stand {low:.0f} to {high:.0f} cm high, too uneven for flat ground"
        return clip, [], [f"{heights}: set `ground: rocky` for this clip in the data set."]
    moved = replace(clip, root=clip.root - [0.0, floor, 0.0])
    return moved, [f"The floor lies at {floor:.1f} cm; the clip was moved so that it lies at 0."], []


def _stands(clip: Clip, toes: Array) -> bool:
    """Whether the figure is upright. toes: (F,) height of the lower toe joint."""
    hips = clip.positions[:, clip.skeleton.role("hips"), 1]
    return bool(np.median(hips - toes) > UPRIGHT * leg_length(clip.skeleton))
