"""The keys of a configuration's `network` section where its kind is matching."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from hobble.core.section import Positive, PositiveFloat
from hobble.models.options import Options

Weight = Annotated[float, Field(ge=0, le=1000, allow_inf_nan=False)]


class MatchingOptions(Options):
    """Motion matching.

    Holden et al. 2020 weigh feet .75, the path 1 and the facing 1.5, and search every ten frames. With that,
    feet slide 4.8 cm a step here and the figure comes 2.3 m off the path: docs/controllers.md.
    """

    kind: Literal["matching"] = "matching"
    every: Positive = Field(5, description="frames between two searches")
    halflife: PositiveFloat = Field(
        4.0, description="frames after which half of the step at a transition is gone"
    )
    path: Weight = Field(6.0, description="weight of where the path leads")
    facing: Weight = Field(4.0, description="weight of where the figure will look")
    foot_position: Weight = 5.0
    foot_velocity: Weight = 1.0
    hip_velocity: Weight = 2.0
    gait: Weight = Field(2.0, description="weight of the gait now")
    ground: Weight = Field(0.5, description="weight of the heights ahead")
    channels: Weight = Field(50.0, description="weight of what the body is told; high, since it has to agree")
