"""The text of the label files of a clip: footsteps and gaits."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np


def footsteps_text(right: Sequence[int], left: Sequence[int]) -> str:
    """Lines `right left`: the frame in which the right foot lands, then the next landing of the left foot.

    right, left: frames in which each foot lands. Frames count from 0 in the arguments, from 1 in the file.
    """
    lines = []
    lefts = np.asarray(left)
    for a, following in itertools.pairwise([*right, np.inf]):
        between = lefts[lefts > a]
        if len(between) and between[0] < following:
            lines.append(f"{a + 1} {between[0] + 1}")
    return "".join(f"{line}\n" for line in lines)


def gait_text(keys: Sequence[tuple[int, str]]) -> str:
    """Lines `frame label`. keys: (frame, label). Frames count from 0 in the argument, from 1 in the file."""
    return "".join(f"{frame + 1} {label}\n" for frame, label in keys)
