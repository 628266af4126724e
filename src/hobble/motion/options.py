"""The keys of a data set's `download` and `motion` sections."""

from __future__ import annotations

import re
from string import Formatter
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from hobble.core.section import Finite, Ground, Inside, Positive, PositiveFloat, Section


def _sixty(fps: float) -> float:
    """The rate in which all that follows counts: windows, speeds, thresholds, the character's own frames."""
    if fps != 60.0:
        raise ValueError("clips are made at 60 frames a second, whatever the rate of their files")
    return fps


SixtyHz = Annotated[float, AfterValidator(_sixty)]


PADDING = re.compile(r"(?:.?[<>^])?\d{0,2}")  # a longer text than that is no name of a file


class Download(Section):
    """Where clips come from that the user's folder lacks."""

    url: str = Field(
        description="of a clip's file: {clip} its name, {subject} what stands before its first _"
    )
    checksums: Inside = Field(
        description="SHA-256 of each file, as sha256sum writes them; beside the data set's own file"
    )

    @model_validator(mode="after")
    def _url_of_a_clip(self) -> Download:
        try:
            parts = [part for part in Formatter().parse(self.url) if part[1] is not None]
            fields = {name for _, name, _, _ in parts}
            if any(how or not PADDING.fullmatch(spec or "") for _, _, spec, how in parts):
                raise ValueError("only a width of up to 99 may stand behind a name, as in {subject:0>3}")
            made = self.url.format(clip="02_01", subject="02")
        except (ValueError, LookupError, AttributeError) as error:
            raise ValueError(f"url: {error}") from None
        if not fields <= {"clip", "subject"} or "clip" not in fields:
            raise ValueError("url: {clip} must stand in it, {subject} may, and nothing else in braces")
        if not re.fullmatch(r"https?://[^/\s]+/\S+", made) or not made.isprintable():
            raise ValueError("url: must be an address like https://host/{subject}/{clip}.bvh")
        return self


class Motion(Section):
    """How BVH files are read and checked. `auto` is found from the rig; anything else overrules it."""

    fps: SixtyHz = Field(60.0, description="frames a second of the clips made: what follows counts in 60ths")
    source_fps: PositiveFloat | None = Field(None, description="overrules the files' Frame Time")
    unit: Literal["auto"] | PositiveFloat = Field("auto", description="centimetres per unit of the file")
    up: Literal["auto", "Y", "Z"] = "auto"
    handedness: Literal["auto", "right", "left"] = Field(
        "auto",
        description="of the file's coordinates; a left-handed file has x negated. Names of joints tell; of a "
        "rig whose names do not, it has to be said",
    )
    facing: Finite | None = Field(
        None, description="where the figure faces first, degrees from +Z towards +X; else as in the file"
    )
    proportions: Literal["skeleton", "clip"] = Field(
        "skeleton", description="retarget onto the skeleton's bone lengths, or keep each clip's own"
    )
    defects: Literal["repair", "refuse", "leave"] = Field(
        "repair",
        description="what to do with frames that are plainly broken, and a floor off height 0: repairs are "
        "reported; leave takes a clip as it is, as the original did",
    )
    loops: Positive = Field(1, description="how often a clip that is one short cycle is repeated")
    heading: Finite | None = Field(
        None, description="where a looped clip leads, degrees from +Z towards +X; as in the file by default"
    )


class ClipMotion(Motion):
    """The section for one clip: what its entry in the data set says overrules the section."""

    ground: Ground = Field("flat", description="what the clip walks on; a flat floor is put at height 0")
