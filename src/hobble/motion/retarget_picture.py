"""Draws a clip beside the retargeted motion, as stick figures from the side and from the front."""

from __future__ import annotations

import html
from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.core.quat import Array
from hobble.motion.body import SIDES, TRUNK
from hobble.motion.check_retarget import ANGLES, BONES, most_different
from hobble.motion.file_motion import load_source
from hobble.motion.make import fit_skeleton, resample
from hobble.motion.options import ClipMotion
from hobble.motion.read import read_bvh
from hobble.motion.rig import load_skeleton
from hobble.motion.root import facing

# Roles of the joints along a leg and along an arm.
LIMBS = (("hips", "hip", "knee", "heel", "toe"), ("chest", "shoulder", "elbow", "wrist"))
POSES = 6  # poses of the clip in each row of the picture
WIDE, HIGH, EDGE = 150, 260, 46  # pixels: width and height of one figure, and the margin for captions
COLOURS = {"left": "#2b6cb0", "right": "#8a8a8a", "": "#333333"}  # of each side, and of trunk and head
WRONG = "#d62828"  # colour of the part that differs most


def picture_of_file(bvh: Path, skeleton: Path, maps: Path, options: ClipMotion) -> str:
    """The picture (SVG) of a BVH file's motion and of the result of retargeting.

    It is drawn even if the workflow refuses the result because it differs too much from the source.

    skeleton: the file of the skeleton that gets the motion. maps: the folder with all skeleton
    files, whose joint maps are used to recognise the source. Raises
    InputError for a BVH file that cannot be read or has this skeleton's bones already.
    """
    target = load_skeleton(skeleton, skeleton.stem)
    source = load_source(read_bvh(bvh), target, maps, options)
    before = resample(source.clip, options.fps)
    before = replace(before, skeleton=replace(before.skeleton, roles=source.match.roles))
    fitted = fit_skeleton(before, source, target.skeleton, options.proportions)
    if fitted.difference is None:
        raise InputError(bvh, f"already has the bones of {target.skeleton.name}, so nothing is compared")
    return retarget_picture(before, fitted.clip, *most_different(fitted.difference))


def retarget_picture(source: Clip, result: Clip, part: str, degrees: float) -> str:
    """An SVG of four rows of POSES figures: source and result from the side, then both from the front.

    source, result: clips with roles, at the same times. part: the joint or limb that differs most, such as
    "left knee"; it is drawn in red. degrees: by how much it differs on average.
    """
    frames = np.linspace(0, min(len(source), len(result)) - 1, POSES).round().astype(int)
    rows = [
        (f"{name}, from the {view}", _figures(clip, frames, part, view))
        for view in ("side", "front")
        for name, clip in (("source", source), ("result", result))
    ]
    width, height = POSES * WIDE + 2 * EDGE, len(rows) * HIGH + 2 * EDGE
    text = f"{source.name}: the {part} is {degrees:.0f} degrees off its source on average (red)"
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" '
        f'font-family="sans-serif" font-size="14"><rect width="100%" height="100%" fill="white"/>',
        f'<text x="{EDGE}" y="28" font-size="18">{html.escape(text)}</text>',
    ]
    for number, (name, figures) in enumerate(rows):
        top = EDGE + number * HIGH
        out.append(f'<text x="{EDGE}" y="{top + 16}">{html.escape(name)}</text>')
        out += [
            f'<g transform="translate({EDGE + WIDE * (k + 0.5):g},{top + HIGH - 14})">{figure}</g>'
            for k, figure in enumerate(figures)
        ]
    captions = [
        f'<text x="{EDGE + WIDE * (k + 0.5):g}" y="{height - 14}" text-anchor="middle">'
        f"{frame / result.fps:.2f} s</text>"
        for k, frame in enumerate(frames)
    ]
    return "\n".join([*out, *captions, "</svg>\n"])


def _figures(clip: Clip, frames: Array, part: str, view: str) -> list[str]:
    """The SVG elements of each figure. A figure's lowest point is at y = 0, and its hips are at x = 0."""
    at = {role: clip.positions[frames, clip.skeleton.role(role)] for role in clip.skeleton.roles}
    ahead = facing(clip.skeleton, clip.positions[frames], 0.0)
    across = np.cross([0.0, 1.0, 0.0], ahead)
    level = ahead if view == "side" else across
    places = {
        role: np.stack([np.sum((p - at["hips"]) * level, axis=-1), p[:, 1]], axis=-1)
        for role, p in at.items()
    }
    every = np.stack(list(places.values()))
    low = every[..., 1].min(axis=0)
    size = (HIGH - 50) / max(float(np.median(np.ptp(every[..., 1], axis=0))), 1e-9)
    return [
        "".join(
            _line(places[a][k], places[b][k], low[k], size, COLOURS[side] if not wrong else WRONG)
            for a, b, side, wrong in _bones(places, part)
        )
        for k in range(len(frames))
    ]


def _bones(places: Mapping[str, Array], part: str) -> list[tuple[str, str, str, bool]]:
    """(start, end, side, whether it belongs to `part`) of each bone, by roles. Trunk and head: side ""."""
    side, _, name = part.partition(" ")
    roles = ANGLES.get(name) or BONES.get(name) or ()
    wrong = set(pairwise(role if role == "head" else f"{side}_{role}" for role in roles))
    chains: list[tuple[str, tuple[str, ...]]] = [("", TRUNK)]
    for limb_side in SIDES:
        for first, *rest in LIMBS:
            chains.append((limb_side, (first, *(f"{limb_side}_{role}" for role in rest))))
    return [
        (a, b, bone_side, (a, b) in wrong)
        for bone_side, chain in chains
        for a, b in pairwise(role for role in chain if role in places)
    ]


def _line(a: Array, b: Array, low: float, size: float, colour: str) -> str:
    x1, y1, x2, y2 = a[0] * size, (low - a[1]) * size, b[0] * size, (low - b[1]) * size
    thick = 6 if colour == WRONG else 3
    return (
        f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" stroke="{colour}" '
        f'stroke-width="{thick}" stroke-linecap="round"/>'
    )
