"""The keys of a data set's `database` section."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from hobble.core.section import Positive, PositiveFloat, Section


class Rows(Section):
    """What a row holds: what the rule `database_clip` reads."""

    window: Annotated[int, Field(gt=0, le=3600)] = Field(
        60, description="frames to each side of the present one"
    )
    step: Positive = Field(10, description="frames between trajectory samples")
    facing_sigma: PositiveFloat = Field(20.0, description="smoothing of the facing direction, frames")

    @model_validator(mode="after")
    def _whole_steps(self) -> Rows:
        if self.window % self.step:
            raise ValueError(f"window ({self.window}) must be a multiple of step ({self.step})")
        return self


class Merging(Section):
    """How rows lie on disk, and their statistics: what the rule `database_merge` reads."""

    joint_weight: PositiveFloat = 0.1
    dtype: Literal["float32", "float16", "bfloat16"] = Field(
        "float32", description="of the rows on disk; the others take half the bytes, float16 more exactly"
    )
    seed: int = 1


class Database(Rows, Merging):
    """What a row holds, how rows lie on disk, and by how many jobs they are merged."""

    parts: Annotated[int, Field(gt=0, le=1000)] = Field(
        1, description="jobs that read and shuffle the rows side by side; the result does not depend on it"
    )

    terrain_side: PositiveFloat = Field(25.0, description="centimetres from the path to the side heights")
