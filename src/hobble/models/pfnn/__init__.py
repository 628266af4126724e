"""The phase-functioned network: its weights depend on the phase (Holden, Komura, Saito 2017).

Start reading at `forward`.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, get_args

from hobble.core.section import PhaseMode
from hobble.core.skeleton import Skeleton
from hobble.models.model import TrainedModel
from hobble.rows.layout import RowLayout

if TYPE_CHECKING:
    import numpy as np

    from hobble.models.pfnn.network import Pfnn
    from hobble.models.pfnn.options import PfnnOptions
    from hobble.models.pfnn.trainable import TrainablePfnn


class _Pfnn(TrainedModel):
    modes: ClassVar[tuple[str, ...]] = get_args(PhaseMode)

    def options_class(self) -> type[PfnnOptions]:
        from hobble.models.pfnn.options import PfnnOptions

        return PfnnOptions

    def parameter_count(self, options: PfnnOptions, inputs: int, outputs: int) -> int:
        sizes = options.sizes(inputs, outputs)
        return options.control_points * sum((inputs + 1) * outputs for inputs, outputs in pairwise(sizes))

    def untrained_network(
        self, options: PfnnOptions, layout: RowLayout, skeleton: Skeleton, seed: int
    ) -> TrainablePfnn:
        from hobble.models.pfnn.trainable import untrained_network

        return untrained_network(options.sizes(layout.x_size, layout.y_size), options.control_points, seed)

    def read(self, path: str | Path, arrays: Mapping[str, Any], shared_fields: Mapping[str, Any]) -> Pfnn:
        """As in `Model`. shared_fields: those that networks of all kinds have."""
        from hobble.models.pfnn.network import Pfnn

        return Pfnn.read(path, arrays, shared_fields)

    def read_folder(self, folder: Path) -> Mapping[str, np.ndarray] | None:
        from hobble.models.pfnn.release import read_release

        return read_release(folder) if any(folder.glob("*.bin")) else None


MODEL = _Pfnn()
