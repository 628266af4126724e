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
from hobble.motion.root import facing_directions

# Roles of the joints along a leg and along an arm.
LIMBS = (("hips", "hip", "knee", "heel", "toe"), ("chest", "shoulder", "elbow", "wrist"))
POSES = 6  # poses of the clip in each row of the picture
WIDE, HIGH, EDGE = 150, 260, 46  # pixels: width and height of one figure, and the margin for captions
COLOURS = {"left": "#2b6cb0", "right": "#8a8a8a", "": "#333333"}  # of the limbs' bones; "": trunk and head
WRONG = "#d62828"  # colour of the bones that differ most


def picture_of_file(bvh: Path, skeleton: Path, skeleton_folder: Path, options: ClipMotion) -> str:
    """The picture (SVG) of a BVH file's motion and of the result of retargeting.

    It is drawn even if the workflow refuses the result because it differs too much from the source.

    skeleton: the file of the skeleton that gets the motion. skeleton_folder: the folder with all skeleton
    files, with which the rig of the BVH file is recognised. Raises InputError for a BVH file that cannot be
    read or that has this skeleton's bones already.
    """
    target = load_skeleton(skeleton, skeleton.stem)
    source = load_source(read_bvh(bvh), target, skeleton_folder, options)
    before = resample(source.clip, options.fps)
    before = replace(before, skeleton=replace(before.skeleton, roles=source.match.roles))
    fitted = fit_skeleton(before, source, target.skeleton, options.proportions)
    if fitted.difference is None:
        raise InputError(
            bvh, f"already has the bones of {target.skeleton.name}, so there is no retargeting to draw"
        )
    return retarget_picture(before, fitted.clip, *most_different(fitted.difference))


def retarget_picture(source: Clip, result: Clip, part: str, degrees: float) -> str:
    """An SVG of four rows of POSES figures: source and result from the side, then both from the front.

    source, result: the clip before and after retargeting, both with roles and at the same frame rate. part:
    the joint or limb that differs most, such as "left knee"; its bones are drawn in red. degrees: by how much
    it differs on average.
    """
    frames = np.linspace(0, min(len(source), len(result)) - 1, POSES).round().astype(int)
    rows = [
        (f"{name}, from the {view}", _draw_figures(clip, frames, part, view))
        for view in ("side", "front")
        for name, clip in (("source", source), ("result", result))
    ]
    width, height = POSES * WIDE + 2 * EDGE, len(rows) * HIGH + 2 * EDGE
    title = f"{source.name}: the {part} is {degrees:.0f} degrees off its source on average (red)"
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" '
        f'font-family="sans-serif" font-size="14"><rect width="100%" height="100%" fill="white"/>',
        f'<text x="{EDGE}" y="28" font-size="18">{html.escape(title)}</text>',
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


def _draw_figures(clip: Clip, frames: Array, part: str, view: str) -> list[str]:
    """For each of the `frames`, the SVG elements of the figure in that frame.

    A figure's lowest point is at y = 0, and its hips are at x = 0. part: the joint or limb in red. view:
    "side" or "front".
    """
    at = {role: clip.positions[frames, clip.skeleton.role(role)] for role in clip.skeleton.roles}
    ahead = facing_directions(clip.skeleton, clip.positions[frames], 0.0)
    across = np.cross([0.0, 1.0, 0.0], ahead)
    rightward = ahead if view == "side" else across  # what points to the right in the picture
    places = {  # role -> (POSES, 2) distance to the right of the hips, and height; cm
        role: np.stack([np.sum((p - at["hips"]) * rightward, axis=-1), p[:, 1]], axis=-1)
        for role, p in at.items()
    }
    heights = np.stack(list(places.values()))[..., 1]
    lowest = heights.min(axis=0)
    scale = (HIGH - 50) / max(float(np.median(np.ptp(heights, axis=0))), 1e-9)  # pixels a cm
    return [
        "".join(
            _draw_bone(places[a][k], places[b][k], lowest[k], scale, WRONG if wrong else COLOURS[side])
            for a, b, side, wrong in _bones_to_draw(places, part)
        )
        for k in range(len(frames))
    ]


def _bones_to_draw(places: Mapping[str, Array], part: str) -> list[tuple[str, str, str, bool]]:
    """For each bone to draw: the roles of its start and end, its side, and whether it belongs to `part`.

    The side of trunk and head is "". places: its keys are the roles that the figure has.
    """
    side, _, name = part.partition(" ")
    roles = ANGLES.get(name) or BONES.get(name) or ()
    in_part = set(pairwise(role if role == "head" else f"{side}_{role}" for role in roles))
    chains: list[tuple[str, tuple[str, ...]]] = [("", TRUNK)]
    for limb_side in SIDES:
        for first, *rest in LIMBS:
            chains.append((limb_side, (first, *(f"{limb_side}_{role}" for role in rest))))
    return [
        (a, b, bone_side, (a, b) in in_part)
        for bone_side, chain in chains
        for a, b in pairwise(role for role in chain if role in places)
    ]


def _draw_bone(a: Array, b: Array, lowest: float, scale: float, colour: str) -> str:
    """The SVG line from `a` to `b`, each (2,) x and height in cm. In an SVG, y points down.

    lowest: the height in cm at y = 0. scale: pixels a cm.
    """
    x1, y1, x2, y2 = a[0] * scale, (lowest - a[1]) * scale, b[0] * scale, (lowest - b[1]) * scale
    thick = 6 if colour == WRONG else 3
    return (
        f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" stroke="{colour}" '
        f'stroke-width="{thick}" stroke-linecap="round"/>'
    )
