"""Converts BVH files of any rig and frame rate to checked clips on the target skeleton.

This file has the keys of a data set's `download` and `motion` sections.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from typing import ClassVar, Literal, NamedTuple

from pydantic import Field, model_validator

from hobble.core.errors import InputError
from hobble.core.section import FrameRange, Ground, Positive, PositiveFloat, RelativePath, Section

# A name in braces in `url`, perhaps with a width of up to 99, as in {subject:0>3}: no file name needs more.
PLACEHOLDER = re.compile(r"\{(clip|subject)(?::(?:[^{}]?[<>^])?\d{0,2})?\}")


class Download(Section):
    """Where to download clips that are not in the user's folder."""

    url: str = Field(
        description="address of a clip; {clip} is the clip's name, {subject} is the name up to the first _"
    )
    checksums: RelativePath | None = Field(
        None, description="file of SHA-256 sums beside the data set's file; without it no clip is checked"
    )

    @model_validator(mode="after")
    def _check_url(self) -> Download:
        example, names = PLACEHOLDER.sub("02", self.url), PLACEHOLDER.findall(self.url)
        if "clip" not in names or set("{}") & set(example):
            rule = "only {clip} and {subject} may be in braces, with padding to a width of up to 99"
            raise ValueError(f"url: must contain {{clip}}; {rule}, as in {{subject:0>3}}")
        if not re.fullmatch(r"https?://[^/\s]+/\S+", example) or not example.isprintable():
            raise ValueError("url: must be an address like https://host/{subject}/{clip}.bvh")
        return self


class MotionOptions(Section):
    """How BVH files are read and checked.

    `auto` derives a value from the file's rig (its skeleton) and motion. Any other value overrides this.
    """

    # Of the finished clips. Window lengths, speeds and thresholds in other modules assume 60 Hz.
    fps: ClassVar[float] = 60.0
    source_fps: PositiveFloat | None = Field(
        None, description="frames a second of the BVH files; overrides their Frame Time"
    )
    unit: Literal["auto"] | PositiveFloat = Field("auto", description="centimetres per unit of the file")
    up: Literal["auto", "Y", "Z"] = Field("auto", description="axis of the file that points up")
    handedness: Literal["auto", "right", "left"] = Field(
        "auto", description="of the file's coordinates; `auto` needs joint names that say left and right"
    )
    proportions: Literal["skeleton", "clip"] = Field(
        "skeleton", description="retarget onto the skeleton's bone lengths, or keep each clip's own"
    )
    defects: Literal["repair", "leave"] = Field(
        "repair", description="mend and report broken frames and a floor off height 0, or leave both"
    )
    accept_doubt: bool = Field(
        False, description="use clips that would be refused for a doubt (tilt, knees, sliding feet, height)"
    )
    loops: Positive = Field(1, description="how many times a clip of one cycle is played in a row")


class ClipMotion(MotionOptions):
    """The options for one clip: those of the section `motion`, except where the clip's entry has its own."""

    ground: Ground = Field("flat", description="the clip's ground; a flat floor is moved to height 0")
    frames: FrameRange | None = Field(
        None, description="first and last frame of the file that are used, counted from 1"
    )
    animation: str | None = Field(
        None, description="name of the animation that is read from a glTF or FBX file; by default the longest"
    )


ACCEPT = "To use the clip as it is, set motion.accept_doubt: true (option --accept-doubt)."


class Problem(NamedTuple):
    """What speaks against a clip. text: what was seen, without a final dot. fix: what to do about it.

    A problem without a fix is a doubt: the clip is used, and its report tells the doubt.
    """

    text: str
    fix: str = ""


def accept(path: Path, problems: Iterable[Problem | None], options: MotionOptions) -> list[str]:
    """The problems as sentences. Raises InputError for the first one that `options` do not accept."""
    out = []
    for problem in problems:
        if problem is not None and problem.fix and not options.accept_doubt:
            raise InputError(path, problem.text, fix=f"{problem.fix} {ACCEPT}")
        if problem is not None:
            out.append(f"{problem.text[0].upper()}{problem.text[1:]}.")
    return out
