"""The keys of a configuration's `network` section for the kind `plain`."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from hobble.models.options import Options


class PlainOptions(Options):
    """A feed-forward network. By default its layers have the sizes of the phase-functioned network's."""

    kind: Literal["plain"] = "plain"
    hidden_layers: Annotated[int, Field(ge=1, le=8)] = 2
    units: Annotated[int, Field(gt=0, le=8192)] = 512

    @property
    def why_not_symmetric(self) -> str:
        """As in `Options`: always "", because any plain network can be trained with `training.symmetric`."""
        return ""

    @property
    def hidden(self) -> tuple[int, ...]:
        """As in `Options`."""
        return (self.units,) * self.hidden_layers

    def sizes(self, inputs: int, outputs: int) -> tuple[int, ...]:
        """Units of each layer, the columns of X first. The first layer also gets two inputs for the phase."""
        return (inputs, *self.hidden, outputs)
