"""Finds the floor of a clip from the feet, and moves a flat floor to height 0."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.motion.rig import leg_length

SOLE = 3.0  # cm: height of the toe joint of a standing foot above the floor
OFF = 3.0  # cm: a clip is moved if its floor is further than this from height 0
CRAWLS = 15.0  # cm: used instead of OFF if the figure is not upright, since its toes hardly show the floor
UPRIGHT = 0.8  # least height of the hips above the toes of an upright figure, in leg lengths
# cm: on flat ground, the heights of high and low steps differ by at most this. In running they differ by 9,
# on gentle bumps by 14.
EVEN = 12.0
SLOW = 0.3  # cm a frame at 60 Hz: a toe that rises or falls faster is in the air
FEWEST, SHORTEST = 4, 1 / 12  # least number of frames, and of seconds, in which feet have to show the floor


def on_floor(clip: Clip) -> tuple[Clip, list[str], list[str]]:
    """A clip on flat ground, moved to height 0 if its floor was further off than OFF (crawling: CRAWLS).

    Also returns two lists. The first holds a sentence if the clip was moved. The second holds one if it was
    not moved because its feet stand at heights too different for flat ground.
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
