"""A feed-forward network that gets the phase as input. It is the baseline for the kind `pfnn`."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hobble.core.skeleton import Skeleton
from hobble.models.model import TrainedModel
from hobble.rows.layout import RowLayout

if TYPE_CHECKING:
    from hobble.models.plain.network import Plain
    from hobble.models.plain.options import PlainOptions
    from hobble.models.plain.trainable import TrainablePlain


class _Plain(TrainedModel):
    def options_class(self) -> type[PlainOptions]:
        from hobble.models.plain.options import PlainOptions

        return PlainOptions

    def parameter_count(self, options: PlainOptions, inputs: int, outputs: int) -> int:
        weights_of_phase = 2 * options.units  # the first layer also gets sine and cosine of the phase
        sizes = options.sizes(inputs, outputs)
        return sum((size + 1) * out for size, out in pairwise(sizes)) + weights_of_phase

    def untrained_network(
        self, options: PlainOptions, layout: RowLayout, skeleton: Skeleton, seed: int
    ) -> TrainablePlain:
        from hobble.models.plain.trainable import untrained_network

        return untrained_network(options.sizes(layout.x_size, layout.y_size), seed)

    def read(self, path: str | Path, arrays: Mapping[str, Any], shared_fields: Mapping[str, Any]) -> Plain:
        """As in `Model`. shared_fields: those that networks of all kinds have."""
        from hobble.models.plain.network import Plain

        return Plain.read(path, arrays, shared_fields)


MODEL = _Plain()
