"""Learned motion matching (Holden, Kanoun, Perepichka, Popa 2020): three networks instead of the frames.

The decompressor computes a pose from the features of its frame and a latent vector, the stepper computes the
features and the latent vector of the next frame, and the projector replaces the search of `matching`.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from hobble.core.section import Positive
from hobble.core.skeleton import Skeleton
from hobble.models.matching import MatchingOptions
from hobble.models.model import FinishedNetwork
from hobble.rows.layout import RowLayout

Units = Annotated[int, Field(gt=0, le=4096)]


class LearnedOptions(MatchingOptions):
    """Learned motion matching. The features and their weights are those of `matching`.

    Holden et al. 2020 have 512 units in each layer. With fewer, the networks of `synthetic` take less than a
    tenth of the memory of its frames.
    """

    network: ClassVar[str] = "hobble.models.learned.network:Learned"

    kind: Literal["learned"] = "learned"  # type: ignore[assignment]
    latent: Annotated[int, Field(gt=0, le=1024)] = Field(
        32, description="numbers that the decompressor gets beside the features"
    )
    decompressor_units: Units = Field(512, description="units of the decompressor's hidden layer")
    units: Units = Field(256, description="units of the hidden layers of stepper and projector")
    steps: Positive = Field(1500, description="optimiser steps of each of the three trainings")
    seed: int = Field(1, description="seed of the first weights and of the order of the frames")

    def build(self, clips: Sequence[str | Path], layout: RowLayout, skeleton: Skeleton) -> FinishedNetwork:
        """As in `BuiltOptions`; trains the three networks."""
        from hobble.models.learned.train import train
        from hobble.models.matching.build import read_tables

        return train(self, read_tables(self, clips, layout, skeleton), layout, skeleton)


OPTIONS = LearnedOptions
