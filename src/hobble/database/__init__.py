"""The `database` stage: rows of X, Y and P from clips, labels, channels and terrain fits.

This file has the keys of the section `database` of a data set's configuration.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from hobble.core.section import Positive, PositiveFloat, Section


class RowOptions(Section):
    """What a row (the network's input and output for a frame) contains. Read by the rule `database_clips`."""

    window: Annotated[int, Field(gt=0, le=3600)] = Field(
        60, description="frames that the trajectory spans before and after the present one"
    )
    step: Positive = Field(10, description="frames between trajectory samples")
    facing_sigma: PositiveFloat = Field(20.0, description="smoothing of the facing direction, frames")
    local_phases: Literal["contacts", "autoencoder"] = Field(
        "contacts",
        description="what the phases of feet and hands, which networks of the kind `local` read, come from. "
        "contacts: contacts of the feet and swings of the hands. autoencoder: a periodic autoencoder that is "
        "trained on the motion",
    )

    @model_validator(mode="after")
    def _whole_steps(self) -> RowOptions:
        if self.window % self.step:
            raise ValueError(f"window ({self.window}) must be a multiple of step ({self.step})")
        return self


class Merging(Section):
    """How rows are standardised and stored. Read by the rule `database_merge`."""

    joint_weight: PositiveFloat = Field(
        0.1, description="factor of the standardised joints in the network's input"
    )
    dtype: Literal["float32", "float16"] = Field(
        "float32", description="type of the rows on disk; float16 takes half the bytes"
    )
    seed: int = Field(1, description="seed of the order in which rows are stored")
    every: Positive = Field(
        1,
        description="training uses every n-th frame of its clips; 4 as Segerstedt (2021) did for AVA. "
        "Measurements use all frames",
    )


class DatabaseOptions(RowOptions, Merging):
    """The whole section: the content of rows, and how they are standardised and stored."""

    terrain_side: PositiveFloat = Field(
        25.0, description="distance from the path to the ground heights on its left and right, cm"
    )
