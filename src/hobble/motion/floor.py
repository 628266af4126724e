"""Where the floor of a clip is: found from the feet, and on flat ground put at height zero."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hobble.core.clip import Clip

SOLE = 3.0  # cm that a toe joint is above the floor on which it stands
OFF = 15.0  # cm; shoes, rigs and markers put no floor further off than that
EVEN = 12.0  # cm between high and low steps; running on flat ground gives 9, gentle bumps 14
SLOW = 0.3  # cm a frame at 60 Hz: a toe that rises or falls faster is in the air
FEWEST = 10  # frames from which a floor can be told


def on_floor(clip: Clip) -> tuple[Clip, list[str], list[str]]:
    """A clip on flat ground with its floor at 0 where it was more than 15 cm off.

    Returns a sentence, too, where the clip was moved; or, second, where it was not, since its feet stand at
    so many heights that the ground is hardly flat.
    """
    toes = [clip.skeleton.role(f"{side}_toe") for side in ("left", "right")]
    lower = clip.positions[:, toes, 1].min(axis=1)
    standing = lower[:-1][np.abs(np.diff(lower)) * clip.fps / 60.0 < SLOW]
    if len(standing) < FEWEST:
        return clip, [], []
    low, usual, high = np.percentile(standing, [10, 25, 90])
    floor = float(usual) - SOLE
    if abs(floor) <= OFF:
        return clip, [], []
    if high - low > EVEN:
        heights = f"The feet stand {low:.0f} to {high:.0f} cm high, which no flat ground is"
        return clip, [], [f"{heights}: say `ground: rocky` of this clip in the data set."]
    moved = replace(clip, root=clip.root - [0.0, floor, 0.0])
    return moved, [f"The floor lies at {floor:.0f} cm; the clip was moved so that it lies at 0."], []
