"""Healthy clips, generated and captured, with their labels."""

import functools
from collections.abc import Callable

import numpy as np
import pytest

from hobble.core.clip import Clip
from hobble.core.skeleton import Skeleton
from hobble.labels import LabelOptions
from hobble.labels.clip_labels import Labels
from hobble.labels.label import label_clip
from hobble.motion import ClipMotion
from hobble.motion.make import make_clip
from hobble.motion.skeleton_file import find_skeleton, skeleton_folder
from hobble.synthetic.generate_clip import walk_from_plan
from hobble.synthetic.plan import Segment

Healthy = tuple[Clip, Labels, bool]  # the bool: on flat ground
SEGMENTS = {
    "straight": ([Segment("walk", 130, seconds=20)], "flat"),
    "turning": ([Segment("walk", 120, 60, 4), Segment("walk", 110, -90, 4)], "flat"),
    "jog": ([Segment("jog", 280, seconds=8)], "flat"),
    "starting": ([Segment("stand", seconds=2), Segment("walk", 120, seconds=5)], "flat"),
    "uneven": ([Segment("walk", 105, 20, 8)], "uneven"),
}
CAPTURED = {
    "cmu/07_01": ("walk", "flat"),
    "cmu/105_29": ("walk", "flat"),
    "cmu/09_01": ("jog", "flat"),
    "cmu/03_01": ("walk", "rocky"),
    "ferre/Injured_Walk_LLL_extended_converted": (None, "rocky"),
    "ferre/Injured_Jog_LLA": (None, "rocky"),
}


def labelled(clip: Clip, gait: str | None, flat: bool) -> Healthy:
    report = {"source_frames": len(clip), "source_fps": clip.fps}
    labels, _ = label_clip(clip, [], report, gait, "flat" if flat else "rocky", LabelOptions())
    return clip, labels, flat


@pytest.fixture(scope="session")
def made(holden31: Skeleton, request: pytest.FixtureRequest) -> Callable[[str], Healthy]:
    """Generates a clip of SEGMENTS, or retargets one of CAPTURED."""

    @functools.cache
    def make(name: str) -> Healthy:
        if name in CAPTURED:
            gait, ground = CAPTURED[name]
            file = request.getfixturevalue("shared") / "mocap" / f"{name}.bvh"
            options, folder = ClipMotion(ground=ground), skeleton_folder()
            clip, _ = make_clip(file, find_skeleton("holden31"), folder, file.stem, "holden31", options)
        else:
            segments, ground = SEGMENTS[name]
            frames, gait = round(60 * sum(s.seconds for s in segments)), segments[-1].gait
            clip = walk_from_plan(name, holden31, segments, frames, ground, 60, 1).clip
        return labelled(clip, gait, ground == "flat")

    return make


@pytest.fixture(scope="session")
def hurting(holden31: Skeleton) -> Callable[..., np.ndarray]:
    """`hurting(frames, {link: severity})`: severities (frames, 30)."""

    def severities(frames: int, links: dict[str, float]) -> np.ndarray:
        out = np.zeros((frames, len(holden31.links)))
        for link, severity in links.items():
            out[:, holden31.link_names.index(link)] = severity
        return out

    return severities
