"""The texts of the two label files of a clip: footsteps and gaits."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np


def footsteps_text(right: Sequence[int], left: Sequence[int]) -> str:
    """Lines `right left`: a frame in which the right foot lands, and the frame of the next left landing.

    A landing of the right foot has no line if the left foot does not land before the right foot lands again.
    right, left: frames in which each foot lands. Frames count from 0 in the arguments, from 1 in the file.
    """
    lines = []
    lefts = np.asarray(left)
    for landing, next_landing in itertools.pairwise([*right, np.inf]):
        later_lefts = lefts[lefts > landing]
        if len(later_lefts) and later_lefts[0] < next_landing:
            lines.append(f"{landing + 1} {later_lefts[0] + 1}")
    return "".join(f"{line}\n" for line in lines)


def gait_text(keys: Sequence[tuple[int, str]]) -> str:
    """A line `frame label` for each of `keys`. Frames count from 0 in the argument, from 1 in the file."""
    return "".join(f"{frame + 1} {label}\n" for frame, label in keys)
