"""Finds the height of a clip's floor from the feet, and moves the clip so that its floor lies at 0."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.motion.rig import leg_length

SOLE = 3.0  # cm: height of the toe joint of a standing foot above the floor
# A clip is moved if its floor is further than this from height 0, cm. The second limit holds for figures that
# are not upright: the toes of a crawling figure hardly show where the floor is.
MOST_OFF, MOST_OFF_CRAWLING = 3.0, 15.0
UPRIGHT = 0.8  # leg lengths: in an upright figure, the hips are at least this high above the toes
# cm: on flat ground, the heights of standing feet (10th and 90th percentile) differ by at most this. In
# running they differ by 9, on gentle bumps by 14.
EVEN = 12.0
SLOW = 0.3  # cm a frame at 60 Hz: a toe that rises or falls faster is in the air
# If the feet stand in fewer frames, or for fewer seconds, they do not show where the floor is.
FEWEST_FRAMES, SHORTEST = 4, 1 / 12


def put_on_floor(clip: Clip) -> tuple[Clip, list[str], list[str]]:
    """Move a clip on flat ground up or down so that its floor lies at height 0, if it is too far off.

    Too far is more than MOST_OFF, or more than MOST_OFF_CRAWLING for a figure that is not upright.

    Returns the clip and two lists. If the clip was moved, the first list holds a sentence that says so. If it
    was not moved because the heights of its standing feet differ too much for flat ground, the second list
    holds a sentence that says so.
    """
    toes = [clip.skeleton.role(f"{side}_toe") for side in ("left", "right")]
    lower_toe = clip.positions[:, toes, 1].min(axis=1)
    standing = lower_toe[:-1][np.abs(np.diff(lower_toe)) * clip.fps / 60.0 < SLOW]
    if len(standing) < max(FEWEST_FRAMES, round(SHORTEST * clip.fps)):
        return clip, [], []
    low, usual, high = np.percentile(standing, [10, 25, 90])
    floor = float(usual) - SOLE
    if abs(floor) <= (MOST_OFF if _is_upright(clip, lower_toe) else MOST_OFF_CRAWLING):
        return clip, [], []
    if high - low > EVEN:
        heights = f"The feet stand {low:.0f} to {high:.0f} cm high, too uneven for flat ground"
        return clip, [], [f"{heights}: set `ground: rocky` for this clip in the data set."]
    moved = replace(clip, root=clip.root - [0.0, floor, 0.0])
    return moved, [f"The floor lies at {floor:.1f} cm; the clip was moved so that it lies at 0."], []


def _is_upright(clip: Clip, lower_toe: Array) -> bool:
    """Whether the figure is upright. lower_toe: (F,) height of the lower of the two toe joints, cm."""
    hips = clip.positions[:, clip.skeleton.role("hips"), 1]
    return bool(np.median(hips - lower_toe) > UPRIGHT * leg_length(clip.skeleton))
