"""The mode-adaptive network (Zhang, Starke, Komura, Saito 2018).

Start reading at `hobble.models.mann.forward`.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hobble.core.skeleton import Skeleton
from hobble.models.model import TrainedModel
from hobble.rows.layout import RowLayout

if TYPE_CHECKING:
    from hobble.models.mann.network import Mann
    from hobble.models.mann.options import MannOptions
    from hobble.models.mann.trainable import TrainableMann


class _Mann(TrainedModel):
    def options_class(self) -> type[MannOptions]:
        from hobble.models.mann.options import MannOptions

        return MannOptions

    def parameter_count(self, options: MannOptions, inputs: int, outputs: int) -> int:
        from hobble.models.mann.forward import GATE_INPUTS

        # A layer from a to b units has a * b weights and b biases.
        expert = sum((a + 1) * b for a, b in pairwise(options.sizes(inputs, outputs)))
        gate = sum((a + 1) * b for a, b in pairwise(options.gate_sizes(GATE_INPUTS)))
        return options.experts * expert + gate

    def untrained_network(
        self, options: MannOptions, layout: RowLayout, skeleton: Skeleton, seed: int
    ) -> TrainableMann:
        from hobble.models.mann.forward import gate_columns
        from hobble.models.mann.trainable import untrained_network

        columns = gate_columns(layout, skeleton)
        return untrained_network(
            options.sizes(layout.x_size, layout.y_size), options.gate_sizes(len(columns)), columns, seed
        )

    def read(self, path: str | Path, arrays: Mapping[str, Any], shared_fields: Mapping[str, Any]) -> Mann:
        """As in `Model`. shared_fields: those that networks of all kinds have."""
        from hobble.models.mann.network import Mann

        return Mann.read(path, arrays, shared_fields)


MODEL = _Mann()
