"""The keys of a configuration's `network` section for the kind `mann`."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from hobble.models.options import Options


class MannOptions(Options):
    """The mode-adaptive network, with the sizes of Zhang et al. 2018.

    hidden_layers, units: of each expert. gate_layers, gate_units: hidden layers of the gating network, and
    units of each.
    """

    kind: Literal["mann"] = "mann"
    experts: Annotated[int, Field(ge=2, le=32)] = 8
    hidden_layers: Annotated[int, Field(ge=1, le=8)] = 2
    units: Annotated[int, Field(gt=0, le=8192)] = 512
    gate_layers: Annotated[int, Field(ge=1, le=4)] = 2
    gate_units: Annotated[int, Field(gt=0, le=1024)] = 32

    @property
    def hidden(self) -> tuple[int, ...]:
        """As in `Options`."""
        return (self.units,) * self.hidden_layers

    def sizes(self, inputs: int, outputs: int) -> tuple[int, ...]:
        """Units of each layer of an expert, the input first."""
        return (inputs, *self.hidden, outputs)

    def gate_sizes(self, inputs: int) -> tuple[int, ...]:
        """Units of each layer of the gating network, its input first."""
        return (inputs, *[self.gate_units] * self.gate_layers, self.experts)
