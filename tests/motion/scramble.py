"""Clips rewritten as other programs would have written them: the oracle of everything that reads a rig.

A real clip of the 31 joints is written with other names, another zero pose, other bone lengths, more or fewer
joints, other axes and units, and at another rate (`rewrite.py`). The world positions of its joints are known,
so the result for it must equal the result for the clip itself.

    python -m tests.motion.scramble ../shared/mocap/cmu --count 240
"""

from __future__ import annotations

import argparse
import re
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from hobble.core.clip import Clip
from hobble.motion.options import ClipMotion

from .rewrite import Scramble, stretched, written

Array = np.ndarray
# A floor 3.1 cm off is moved to 0 and one 2.9 cm off is not. Such a difference is no error of the rig.
NEAR = 3.5  # cm
BALL = 1.2  # cm: allowed error of the height of a figure whose balls of the feet had to be guessed


@dataclass(frozen=True)
class Outcome:
    """The result for a scrambled file: `off`, (N,) cm for each of `names`, or why it was refused. said: the
    note about what is uncertain.
    """

    how: Scramble
    names: dict[str, str]
    off: Array | None
    refused: str = ""
    said: str = ""

    @property
    def right(self) -> bool:
        """Within 1 cm on average."""
        return self.off is not None and float(self.off.mean()) <= 1.0

    def __str__(self) -> str:
        if self.off is None:
            return f"refused: {self.refused[:200]} {self.how}"
        worst = sorted(zip(self.off, self.names, strict=True), reverse=True)[:4]
        parts = ", ".join(f"{name} {x:.1f}" for x, name in worst)
        return f"{self.off.mean():.2f} cm ({parts}) {'said ' if self.said else ''}{self.how}"


def outcome(file: Path, seed: int, folder: Path, frames: int | None = None) -> Outcome:
    """Scramble a file of the 31 joints, make a clip of it and of the file itself, and compare the two.

    frames: how many of the clip's first frames are taken.
    """
    from hobble.core.bvh import write_bvh
    from hobble.core.errors import HobbleError
    from hobble.motion.make import load_source, make_clip
    from hobble.motion.read import read_bvh
    from hobble.motion.skeleton_file import load_skeleton

    maps = Path(__file__).parents[2] / "config" / "skeletons"
    options, how, target = ClipMotion(), Scramble.drawn(seed), maps / "holden31.yaml"
    clip = load_source(read_bvh(file), load_skeleton(target), maps, options).clip
    part = slice(0, frames)
    clip = stretched(replace(clip, rotations=clip.rotations[part], root=clip.root[part]), how)
    plain, other = folder / "plain.bvh", folder / "other.bvh"
    write_bvh(plain, clip, decimals=6)
    rewritten, names = written(clip, how)
    write_bvh(other, rewritten, how.order, decimals=8)
    try:
        first, one = make_clip(plain, target, maps, "plain", "holden31", options)
        # Nothing but names tells a figure from its mirror image: of words, it has to be said.
        hand: Literal["auto", "right", "left"] = "left" if how.left_handed else "right"
        said = ClipMotion(handedness=hand) if how.style == "words" else options
        second, two = make_clip(other, target, maps, "other", "holden31", said)
    except HobbleError as error:
        return Outcome(how, names, None, str(error))
    lowered = floor_of(two) - floor_of(one)
    if abs(lowered) <= NEAR + (0.0 if "LeftToeBase" in names else BALL):
        second = replace(second, root=second.root + np.array([0.0, lowered, 0.0]))
    return Outcome(how, names, compare(first, second, names), said=" ".join(two["unsure"]))


def floor_of(report: Mapping[str, Any]) -> float:
    """The height at which a clip's floor was found, if it was moved to 0."""
    found = (
        re.match(r"The floor lies at (-?[\d.]+) cm; the clip was moved", text) for text in report["repairs"]
    )
    return next((float(match[1]) for match in found if match), 0.0)


def main() -> None:
    """Scramble as many clips as requested, and print the outcome of each that is not right."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("folder", type=Path, help="clips of the 31 joints")
    parser.add_argument("--count", type=int, default=240)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--frames", type=int)
    parser.add_argument("--seeds", type=int, nargs="+", help="these alone, in place of --first and --count")
    given = parser.parse_args()
    files = sorted(given.folder.glob("*.bvh"))
    all_of_them = []
    for seed in given.seeds or range(given.first, given.first + given.count):
        file = files[seed * 7 % len(files)]
        with tempfile.TemporaryDirectory() as folder:
            one = outcome(file, seed, Path(folder), given.frames)
        all_of_them.append(one)
        if not one.right:
            print(f"{seed} {file.stem} {one}", flush=True)
    done = [one for one in all_of_them if one.off is not None]
    off = np.array([one.off.mean() for one in done])
    silent = sum(not one.right and not one.said for one in done)
    print(
        f"{len(all_of_them)} scrambled: {(off <= 1).sum()} within 1 cm, {(off > 1).sum()} further off "
        f"({silent} without a word, {(off > 2).sum()} more than 2 cm), "
        f"{len(all_of_them) - len(done)} refused; median {np.median(off):.2f}, most {off.max():.2f} cm"
    )


def compare(first: Clip, second: Clip, names: dict[str, str]) -> Array:
    """(N,) mean distance in centimetres of each joint that both have.

    A rig without toes does not show how high its ankles are above the balls of its feet. So the error of the
    whole figure's height, up to BALL, is subtracted.
    """
    frames = min(len(first), len(second))
    joints = [first.skeleton.index(name) for name in names]
    apart = second.positions[:frames, joints] - first.positions[:frames, joints]
    if "LeftToeBase" not in names:
        apart[..., 1] -= np.clip(np.median(apart[..., 1]), -BALL, BALL)
    return np.linalg.norm(apart, axis=-1).mean(axis=0)


if __name__ == "__main__":
    main()
