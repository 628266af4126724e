"""The keys of a data set's `download` and `motion` sections."""

from __future__ import annotations

import re
from string import Formatter
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from hobble.core.section import Finite, Ground, MocapPath, Positive, PositiveFloat, Section


def _sixty(fps: float) -> float:
    """Refuse other rates than 60 Hz: windows, speeds, thresholds and the character are based on it."""
    if fps != 60.0:
        raise ValueError("clips must have 60 frames a second, whatever the rate of their files")
    return fps


SixtyHz = Annotated[float, AfterValidator(_sixty)]


PADDING = re.compile(r"(?:.?[<>^])?\d{0,2}")  # wider names are no file names


class Download(Section):
    """Where to download clips that are not in the user's folder."""

    url: str = Field(
        description="address of a clip; {clip} is its name, {subject} the part before the first _"
    )
    checksums: MocapPath = Field(
        description="file of SHA-256 sums, as sha256sum writes them, in the folder of the data set's file"
    )

    @model_validator(mode="after")
    def _url_of_a_clip(self) -> Download:
        try:
            parts = [part for part in Formatter().parse(self.url) if part[1] is not None]
            fields = {name for _, name, _, _ in parts}
            if any(how or not PADDING.fullmatch(spec or "") for _, _, spec, how in parts):
                raise ValueError("only a width of up to 99 may follow a name, as in {subject:0>3}")
            made = self.url.format(clip="02_01", subject="02")
        except (ValueError, LookupError, AttributeError) as error:
            raise ValueError(f"url: {error}") from None
        if not fields <= {"clip", "subject"} or "clip" not in fields:
            raise ValueError("url: must contain {clip}, may contain {subject}, and nothing else in braces")
        if not re.fullmatch(r"https?://[^/\s]+/\S+", made) or not made.isprintable():
            raise ValueError("url: must be an address like https://host/{subject}/{clip}.bvh")
        return self


class MotionOptions(Section):
    """How BVH files are read and checked.

    With `auto` a value is derived from the rig (the file's skeleton); another value overrides it.
    """

    fps: SixtyHz = Field(60.0, description="frames a second of the clips; must be 60")
    source_fps: PositiveFloat | None = Field(None, description="overrides the files' Frame Time")
    unit: Literal["auto"] | PositiveFloat = Field("auto", description="centimetres per unit of the file")
    up: Literal["auto", "Y", "Z"] = "auto"
    handedness: Literal["auto", "right", "left"] = Field(
        "auto",
        description="handedness of the file's coordinates; x is negated in left-handed files. `auto` needs "
        "joint names that say left and right",
    )
    facing: Finite | None = Field(
        None,
        description="first facing direction, degrees from +Z towards +X; by default as in the file",
    )
    proportions: Literal["skeleton", "clip"] = Field(
        "skeleton", description="retarget onto the skeleton's bone lengths, or keep each clip's own"
    )
    defects: Literal["repair", "refuse", "leave"] = Field(
        "repair",
        description="what to do with broken frames and a floor off height 0. `repair` mends and reports "
        "them, `refuse` ends the run, `leave` takes the clip as it is, like the original code",
    )
    accept_doubt: bool = Field(
        False,
        description="accept a clip even if nothing in its file shows the height of the figure to 3 cm",
    )
    loops: Positive = Field(1, description="how often a clip of one short cycle is repeated")
    heading: Finite | None = Field(
        None, description="direction of a looped clip, degrees from +Z towards +X; by default as in the file"
    )


class ClipMotion(MotionOptions):
    """The section for one clip. Values of the clip's entry in the data set override the section."""

    ground: Ground = Field("flat", description="the clip's ground; a flat floor is moved to height 0")
