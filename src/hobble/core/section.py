"""Base class and value types of the sections of a YAML configuration file."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

LONGEST_FILE_NAME = 255  # bytes of a file's or folder's name; the limit of Linux and other systems
LONGEST_PATH = 1000  # characters of a path in a configuration


def _check_relative_path(path: str) -> str:
    """Return `path` if it is relative, without "..", printable and not too long; else raise ValueError."""
    if Path(path).is_absolute() or ".." in Path(path).parts or not path.isprintable():
        raise ValueError("must be a relative path without .. and without control characters")
    if any(len(part.encode()) > LONGEST_FILE_NAME for part in Path(path).parts) or len(path) > LONGEST_PATH:
        raise ValueError(
            f"must have at most {LONGEST_PATH} characters, and each name in it at most "
            f"{LONGEST_FILE_NAME} bytes"
        )
    return path


def _check_frame_range(frames: tuple[int, int]) -> tuple[int, int]:
    """Return (first, last) if the last frame comes after the first; else raise ValueError."""
    if frames[0] >= frames[1]:
        raise ValueError("the last frame must come after the first")
    return frames


# The upper bound keeps a mistyped or hostile configuration from using up the memory.
Positive = Annotated[int, Field(gt=0, le=1_000_000)]
PositiveFloat = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
FrameRange = Annotated[tuple[Positive, Positive], AfterValidator(_check_frame_range)]
Share = Annotated[float, Field(ge=0, lt=1)]
# A path that cannot leave the folder to which it is relative, such as the mocap folder (all motion files).
RelativePath = Annotated[str, AfterValidator(_check_relative_path)]
# The ground on which a clip was captured. "jumpy": uneven, with jumps. "beam": a narrow beam above the floor.
Ground = Literal["flat", "rocky", "jumpy", "beam"]
Gait = Literal["stand", "walk", "jog", "crouch", "jump", "bump"]
# How a phase-functioned network gets its weights for a phase. "constant": those of the last one of 50 stored
# phases. "linear": a blend of two of 10 stored phases. "cubic": computed exactly.
PhaseMode = Literal["constant", "linear", "cubic"]


def _check_printable(text: str) -> str:
    if not text.isprintable():
        raise ValueError("must not hold control characters")
    return text


# The name of a joint or of a column.
ShortName = Annotated[str, Field(min_length=1, max_length=200), AfterValidator(_check_printable)]


class Section(BaseModel):
    """A part of a YAML file. An unknown key is an error."""

    model_config = ConfigDict(extra="forbid", frozen=True, str_strip_whitespace=True)
