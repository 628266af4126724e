"""Where the floor of a clip is: found from the feet, and on flat ground put at height zero."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.motion.rig import leg_length

SOLE = 3.0  # cm that a toe joint is above the floor on which it stands
OFF = 3.0  # cm from which on a floor is off
CRAWLS = 15.0  # and from which on, where a figure does not stand on its toes: how they lie there is not told
UPRIGHT = 0.8  # height of the hips above the toes of a figure that stands, to the length of its legs
EVEN = 12.0  # cm between high and low steps; running on flat ground gives 9, gentle bumps 14
SLOW = 0.3  # cm a frame at 60 Hz: a toe that rises or falls faster is in the air
FEWEST, SHORTEST = 4, 1 / 12  # frames, and seconds, of standing from which on a floor can be told


def on_floor(clip: Clip) -> tuple[Clip, list[str], list[str]]:
    """A clip on flat ground with its floor at 0 where it was more than 3 cm off.

    Returns a sentence, too, where the clip was moved; or, second, where it was not, since its feet stand at
    so many heights that the ground is hardly flat.
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
        heights = f"The feet stand {low:.0f} to {high:.0f} cm high, which no flat ground is"
        return clip, [], [f"{heights}: say `ground: rocky` of this clip in the data set."]
    moved = replace(clip, root=clip.root - [0.0, floor, 0.0])
    return moved, [f"The floor lies at {floor:.0f} cm; the clip was moved so that it lies at 0."], []


def _stands(clip: Clip, toes: Array) -> bool:
    hips = clip.positions[:, clip.skeleton.role("hips"), 1]
    return bool(np.median(hips - toes) > UPRIGHT * leg_length(clip.skeleton))
