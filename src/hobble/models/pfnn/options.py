"""The keys of a configuration's `network` section for the kind `pfnn`."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from hobble.models.options import Options


class PfnnOptions(Options):
    """The phase-functioned network.

    hidden_layers: number of hidden layers, two in the weights released by Holden et al. (2017). units: units
    of each of these layers. control_points: number of weight sets, evenly spaced over a cycle, between which
    the phase interpolates.
    """

    kind: Literal["pfnn"] = "pfnn"
    hidden_layers: Annotated[int, Field(ge=1, le=8)] = 2
    units: Annotated[int, Field(gt=0, le=8192)] = 512
    control_points: Annotated[int, Field(ge=4, le=16)] = 4

    @property
    def why_not_symmetric(self) -> str:
        """As in `Options`: "" if the network can be symmetric.

        A symmetric network treats left and right alike, so each control point needs a partner half a cycle
        later.
        """
        why = f"it needs an even number of network.control_points, not {self.control_points}"
        return why if self.control_points % 2 else ""

    @property
    def hidden(self) -> tuple[int, ...]:
        """As in `Options`."""
        return (self.units,) * self.hidden_layers

    def sizes(self, inputs: int, outputs: int) -> tuple[int, ...]:
        """Units of each layer, the input first. inputs, outputs: columns of X and Y."""
        return (inputs, *self.hidden, outputs)
