"""Reads clips for measurement. Each clip keeps its own rig and bone lengths."""

from __future__ import annotations

from pathlib import Path

from hobble.core.clip import Clip
from hobble.motion.edit import resample
from hobble.motion.make import load_source
from hobble.motion.options import ClipMotion
from hobble.motion.read import read_bvh
from hobble.motion.rig import load_skeleton

SKELETONS = "config/skeletons"  # folder of the skeleton files


def read_clip(path: str | Path, skeletons: str | Path = SKELETONS) -> Clip:
    """Read a BVH file and resample it to 60 Hz.

    skeletons: folder of the skeleton files, which name the joints of known rigs. On other rigs the parts of
    the body are found. Raises InputError for a file that cannot be read, and if the parts cannot be found.
    """
    options = ClipMotion()
    # The motion stays on its own rig. `load_source` uses the target only to recognise the rig and its joints.
    target = load_skeleton(Path(skeletons) / "holden31.yaml")
    return resample(load_source(read_bvh(path), target, skeletons, options).clip, options.fps)
