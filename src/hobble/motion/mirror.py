"""Mirrors a motion in the plane x = 0: negates x, and swaps the joints of the left and right side."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from hobble.core.clip import Clip
from hobble.core.errors import HobbleError
from hobble.core.skeleton import Skeleton, other_side

# A position, or a rotation (w, x, y, z), is mirrored in the plane x = 0 if it is multiplied by this.
FLIP, FLIP_ROTATION = np.array([-1.0, 1.0, 1.0]), np.array([1.0, 1.0, -1.0, -1.0])


def mirror_skeleton(skeleton: Skeleton) -> Skeleton:
    """The skeleton with left and right swapped: a symmetric skeleton stays the same.

    Raises HobbleError if two joints are counterparts (such as left and right knee), but their parents are
    not.
    """
    swap = skeleton.mirror_joints
    for j, p in enumerate(skeleton.parents):
        if p >= 0 and skeleton.parents[swap[j]] != swap[p]:
            a, b = skeleton.joints[j], skeleton.joints[swap[j]]
            why = f"the parents of {a} and {b} are not counterparts on the left and on the right"
            raise HobbleError(f"skeleton {skeleton.name} cannot be mirrored: {why}")
    ends = {}
    for name in skeleton.end_sites:
        # A joint without a counterpart keeps its own end site, mirrored.
        x, y, z = skeleton.end_sites.get(other_side(name), skeleton.end_sites[name])
        ends[name] = (-x, y, z)
    return replace(skeleton, offsets=skeleton.offsets[swap] * FLIP, end_sites=ends)


def mirror_clip(clip: Clip, name: str) -> Clip:
    """The clip mirrored in the plane x = 0. name: of the mirrored clip."""
    swap = clip.skeleton.mirror_joints
    translations = None if clip.translations is None else clip.translations[:, swap] * FLIP
    return Clip(
        name,
        mirror_skeleton(clip.skeleton),
        clip.fps,
        clip.rotations[:, swap] * FLIP_ROTATION,
        clip.root * FLIP,
        translations,
    )


def mirror_report(report: Mapping[str, Any], name: str) -> dict[str, Any]:
    """The report of a mirrored clip. report: the report of the original clip. name: of the mirrored clip."""
    return {**report, "clip": name, "mirror_of": report["clip"], "facing": 0.0 - report["facing"]}
