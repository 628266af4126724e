"""Base class and value types of the sections of a YAML file. Unknown keys are refused."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

LONGEST_FILE_NAME = 255  # bytes of a file's or folder's name; the limit of Linux and other systems
LONGEST_PATH = 1000  # characters of a path in the mocap folder


def _inside(path: str) -> str:
    """Check that a path is relative to the mocap folder, does not leave it, is printable and not too long."""
    if Path(path).is_absolute() or ".." in Path(path).parts or not path.isprintable():
        raise ValueError("must be relative to the mocap folder and stay in it")
    if any(len(part.encode()) > LONGEST_FILE_NAME for part in Path(path).parts) or len(path) > LONGEST_PATH:
        raise ValueError(
            f"must have at most {LONGEST_PATH} characters, and each name in it {LONGEST_FILE_NAME} bytes"
        )
    return path


# The upper bound stops a mistyped or hostile configuration from using up the memory.
Positive = Annotated[int, Field(gt=0, le=1_000_000)]
PositiveFloat = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Share = Annotated[float, Field(ge=0, lt=1)]
MocapPath = Annotated[str, AfterValidator(_inside)]
Ground = Literal["flat", "rocky", "jumpy", "beam"]
Gait = Literal["stand", "walk", "jog", "crouch", "jump", "bump"]
PhaseMode = Literal["constant", "linear", "cubic"]


class Section(BaseModel):
    """A part of a YAML file. Unknown keys are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, str_strip_whitespace=True)
