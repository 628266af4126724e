"""Mirrors a motion: negates x and swaps left and right."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from hobble.core.clip import Clip
from hobble.core.errors import HobbleError
from hobble.core.skeleton import Skeleton, other_side

FLIP = np.array([-1.0, 1.0, 1.0])  # times a position: the position mirrored in the plane x = 0


def mirror_skeleton(skeleton: Skeleton) -> Skeleton:
    """The skeleton with left and right swapped. A symmetric skeleton is returned unchanged.

    Raises HobbleError if the parents of two counterparts (such as left and right knee) are not counterparts.
    """
    swap = skeleton.mirror_joints
    for j, p in enumerate(skeleton.parents):
        if p >= 0 and skeleton.parents[swap[j]] != swap[p]:
            a, b = skeleton.joints[j], skeleton.joints[swap[j]]
            why = f"the parents of {a} and {b} are not each other's counterparts"
            raise HobbleError(f"skeleton {skeleton.name} cannot be mirrored: {why}")
    ends = {}
    for name in skeleton.end_sites:
        x, y, z = skeleton.end_sites.get(other_side(name), skeleton.end_sites[name])
        ends[name] = (-x, y, z)
    return replace(skeleton, offsets=skeleton.offsets[swap] * FLIP, end_sites=ends)


def mirror_clip(clip: Clip, name: str) -> Clip:
    """The clip mirrored in the plane x = 0. Mirroring it twice gives the same clip."""
    swap = clip.skeleton.mirror_joints
    translations = None if clip.translations is None else clip.translations[:, swap] * FLIP
    return Clip(
        name,
        mirror_skeleton(clip.skeleton),
        clip.fps,
        clip.rotations[:, swap] * np.array([1.0, 1.0, -1.0, -1.0]),
        clip.root * FLIP,
        translations,
    )


def mirror_report(report: Mapping[str, Any], name: str) -> dict[str, Any]:
    """The report of the mirrored clip: that of the original with the facing direction mirrored."""
    return {**report, "clip": name, "mirror_of": report["clip"], "facing": 0.0 - report["facing"]}
