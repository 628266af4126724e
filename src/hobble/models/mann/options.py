"""The keys of a configuration's `network` section for the kind `mann`."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from hobble.models.options import Options


class MannOptions(Options):
    """The mode-adaptive network (`hobble.models.mann.forward`).

    experts: number of experts. hidden_layers: number of hidden layers of an expert. units: units of each of
    these layers. gate_layers, gate_units: the same for the gate. The defaults are those of Zhang et al. 2018.
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
        """Units of each layer of an expert, the input first. inputs, outputs: columns of X and Y."""
        return (inputs, *self.hidden, outputs)

    def gate_sizes(self, inputs: int) -> tuple[int, ...]:
        """Units of each layer of the gate, the input first. inputs: number of columns that the gate gets."""
        return (inputs, *[self.gate_units] * self.gate_layers, self.experts)
