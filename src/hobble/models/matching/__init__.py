"""Motion matching: plays recorded poses instead of predicting them (Clavet 2016; Holden et al. 2020)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from hobble.core.section import Positive, PositiveFloat
from hobble.core.skeleton import Skeleton
from hobble.models.model import BuiltOptions, FinishedNetwork
from hobble.rows.layout import RowLayout

Weight = Annotated[float, Field(ge=0, le=1000, allow_inf_nan=False)]


class MatchingOptions(BuiltOptions):
    """Motion matching. A weight says how much a feature counts when a search compares frames.

    Holden et al. 2020 use weights of .75 for feet, 1 for path and 1.5 for facing, and search every 10 frames.
    With their values, on the data set `synthetic`, feet slide 4.8 cm a step and the character leaves the path
    by up to 2.3 m. With the defaults here, feet slide 1.3 cm a step and the character leaves the path by up
    to 1.4 m.
    """

    network: ClassVar[str] = "hobble.models.matching.network:Matching"

    kind: Literal["matching"] = "matching"
    every: Positive = Field(5, description="frames between two searches")
    halflife: PositiveFloat = Field(
        4.0, description="frames in which the offset that smooths a transition falls to about half"
    )
    path: Weight = Field(6.0, description="weight of the positions on the path ahead")
    facing: Weight = Field(4.0, description="weight of the facing directions on the path ahead")
    foot_position: Weight = 5.0
    foot_velocity: Weight = 1.0
    hip_velocity: Weight = 2.0
    gait: Weight = Field(2.0, description="weight of the present gait")
    ground: Weight = Field(0.5, description="weight of the ground heights on the path ahead")
    channels: Weight = Field(
        50.0,
        description="weight of the channel values. It is high, because the chosen frame has to match them",
    )

    def build(self, clips: Sequence[str | Path], layout: RowLayout, skeleton: Skeleton) -> FinishedNetwork:
        """As in `BuiltOptions`."""
        from hobble.models.matching.build import build

        return build(self, clips, layout, skeleton)


OPTIONS = MatchingOptions
