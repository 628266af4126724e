"""Writes BVH files. The module that reads them is `hobble.motion.read`."""

from pathlib import Path

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.files import write_text
from hobble.core.skeleton import Skeleton


def write_bvh(path: str | Path, clip: Clip, order: str = "ZYX", decimals: int = 5) -> None:
    """Write a clip, in centimetres and degrees.

    The root has six channels: three positions and three rotations. Every other joint has three rotations. But
    if the clip has joint translations, every joint has six channels. order: order of the rotation channels,
    such as ZYX. decimals: number of decimals of positions and angles.
    """
    translated = clip.translations is not None
    lines = ["HIERARCHY", *_hierarchy(clip.skeleton, 0, order, translated, 0)]
    lines += ["MOTION", f"Frames: {len(clip)}", f"Frame Time: {1 / clip.fps:.8f}"]
    angles = np.degrees(quat.to_euler(clip.rotations, order))
    columns = []
    for j in _depth_first(clip.skeleton, 0):
        if j == 0:
            columns.append(clip.root)
        elif clip.translations is not None:
            columns.append(clip.translations[:, j])
        columns.append(angles[:, j])
    table = np.concatenate(columns, axis=1)
    row = " ".join([f"%.{decimals}f"] * table.shape[1])
    lines += [row % tuple(values) for values in table]
    write_text(path, "\n".join(lines) + "\n")


def _depth_first(skeleton: Skeleton, joint: int) -> list[int]:
    """A joint and all joints below it, in the order in which a BVH file lists them."""
    return [joint] + [j for child in skeleton.children(joint) for j in _depth_first(skeleton, child)]


def _hierarchy(skeleton: Skeleton, joint: int, order: str, translated: bool, depth: int) -> list[str]:
    """The lines of a joint and all joints below it.

    translated: whether every joint has position channels. depth: how many joints are above the joint.
    """
    pad = "\t" * depth
    kind = "ROOT" if joint == 0 else "JOINT"
    offset = skeleton.offsets[joint] if joint else np.zeros(3)
    has_positions = joint == 0 or translated
    channels = ["Xposition", "Yposition", "Zposition"] * has_positions + [f"{axis}rotation" for axis in order]
    lines = [
        f"{pad}{kind} {skeleton.joints[joint]}",
        f"{pad}{{",
        f"{pad}\tOFFSET " + " ".join(f"{x:.6f}" for x in offset),
        f"{pad}\tCHANNELS {len(channels)} " + " ".join(channels),
    ]
    for child in skeleton.children(joint):
        lines += _hierarchy(skeleton, child, order, translated, depth + 1)
    if not skeleton.children(joint):
        end = skeleton.end_sites.get(skeleton.joints[joint], (0.0, 0.0, 0.0))
        end_text = " ".join(f"{x:.6f}" for x in end)
        lines += [f"{pad}\tEnd Site", f"{pad}\t{{", f"{pad}\t\tOFFSET {end_text}", f"{pad}\t}}"]
    return [*lines, f"{pad}}}"]
