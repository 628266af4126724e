"""The keys of a data set's `download` and `motion` sections."""

from __future__ import annotations

import re
from string import Formatter
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from hobble.core.section import Finite, Ground, MocapPath, Positive, PositiveFloat, Section


def _sixty(fps: float) -> float:
    """Refuse other rates than 60 Hz: windows, speeds, thresholds and the character are based on 60 Hz."""
    if fps != 60.0:
        raise ValueError("clips must have 60 frames a second, whatever the rate of their files")
    return fps


SixtyHz = Annotated[float, AfterValidator(_sixty)]


# Format that may follow a name in `url`, such as 0>3 in {subject:0>3}: fill, alignment, and a width of up to
# 99 characters, because no file name needs more.
PADDING = re.compile(r"(?:.?[<>^])?\d{0,2}")


class Download(Section):
    """Where to download clips that are not in the user's folder."""

    url: str = Field(
        description="address of a clip; {clip} is its name, {subject} the part of its name before the first _"
    )
    checksums: MocapPath = Field(
        description="file of SHA-256 sums, as sha256sum writes them, in the folder of the data set's file"
    )

    @model_validator(mode="after")
    def _url_of_a_clip(self) -> Download:
        try:
            braces = [found for found in Formatter().parse(self.url) if found[1] is not None]
            fields = {name for _, name, _, _ in braces}
            if any(conversion or not PADDING.fullmatch(spec or "") for _, _, spec, conversion in braces):
                raise ValueError("only a width of up to 99 may follow a name, as in {subject:0>3}")
            example = self.url.format(clip="02_01", subject="02")
        except (ValueError, LookupError, AttributeError) as error:
            raise ValueError(f"url: {error}") from None
        if not fields <= {"clip", "subject"} or "clip" not in fields:
            raise ValueError("url: must contain {clip}, may contain {subject}, and nothing else in braces")
        if not re.fullmatch(r"https?://[^/\s]+/\S+", example) or not example.isprintable():
            raise ValueError("url: must be an address like https://host/{subject}/{clip}.bvh")
        return self


class MotionOptions(Section):
    """How BVH files are read and checked.

    With `auto` a value is derived from the rig (the file's skeleton); another value overrides it.
    """

    fps: SixtyHz = Field(60.0, description="frames a second of the clips; must be 60")
    source_fps: PositiveFloat | None = Field(
        None, description="frames a second of the files; overrides their Frame Time"
    )
    unit: Literal["auto"] | PositiveFloat = Field("auto", description="centimetres per unit of the file")
    up: Literal["auto", "Y", "Z"] = "auto"
    handedness: Literal["auto", "right", "left"] = Field(
        "auto",
        description="handedness of the file's coordinates; x is negated in left-handed files. `auto` needs "
        "joint names that say left and right",
    )
    facing: Finite | None = Field(
        None,
        description="facing direction in the first frame, degrees from +Z towards +X; by default as in the "
        "file",
    )
    proportions: Literal["skeleton", "clip"] = Field(
        "skeleton", description="retarget onto the skeleton's bone lengths, or keep each clip's own"
    )
    defects: Literal["repair", "refuse", "leave"] = Field(
        "repair",
        description="what to do with broken frames and a floor off height 0. `repair` mends and reports "
        "them, `refuse` stops with an error, `leave` takes the clip as it is, like the code of Holden et al.",
    )
    accept_doubt: bool = Field(
        False,
        description="accept a clip even if nothing in its file shows, to within 3 cm, how high the figure "
        "stands",
    )
    loops: Positive = Field(1, description="how many times a clip of one short cycle is played in a row")
    heading: Finite | None = Field(
        None,
        description="direction in which a looped clip walks, degrees from +Z towards +X; by default as in "
        "the file",
    )


class ClipMotion(MotionOptions):
    """The options for one clip: the section `motion`, overridden by the clip's own entry in the data set."""

    ground: Ground = Field("flat", description="the clip's ground; a flat floor is moved to height 0")
