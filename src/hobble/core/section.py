"""What every section of a YAML file is made of: a model that refuses unknown keys, and types of values."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field


def _inside(path: str) -> str:
    """A path that stays in the folder that it is relative to."""
    if Path(path).is_absolute() or ".." in Path(path).parts or not path.isprintable():
        raise ValueError("must be relative to the mocap folder and stay in it")
    return path


# Upper bounds keep a mistyped or a stranger's configuration from asking for more memory than machines have.
Positive = Annotated[int, Field(gt=0, le=1_000_000)]
PositiveFloat = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Share = Annotated[float, Field(ge=0, lt=1)]
Inside = Annotated[str, AfterValidator(_inside)]
Ground = Literal["flat", "rocky", "jumpy", "beam"]
Gait = Literal["stand", "walk", "jog", "crouch", "jump", "bump"]
PhaseMode = Literal["constant", "linear", "cubic"]


class Section(BaseModel):
    """A part of a YAML file; unknown keys are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, str_strip_whitespace=True)
