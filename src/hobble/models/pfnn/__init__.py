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
from hobble.models.model import Trained
from hobble.rows.layout import RowLayout

if TYPE_CHECKING:
    import numpy as np

    from hobble.models.pfnn.network import Pfnn
    from hobble.models.pfnn.options import PfnnOptions
    from hobble.models.pfnn.trainable import TrainablePfnn


class _Pfnn(Trained):
    modes: ClassVar[tuple[str, ...]] = get_args(PhaseMode)

    def options(self) -> type[PfnnOptions]:
        from hobble.models.pfnn.options import PfnnOptions

        return PfnnOptions

    def parameters(self, options: PfnnOptions, inputs: int, outputs: int) -> int:
        sizes = options.sizes(inputs, outputs)
        return options.control_points * sum((inputs + 1) * outputs for inputs, outputs in pairwise(sizes))

    def trainable(
        self, options: PfnnOptions, layout: RowLayout, skeleton: Skeleton, seed: int
    ) -> TrainablePfnn:
        from hobble.models.pfnn.trainable import initialise

        return initialise(options.sizes(layout.x_size, layout.y_size), options.control_points, seed)

    def read(self, path: str | Path, arrays: Mapping[str, Any], common: Mapping[str, Any]) -> Pfnn:
        from hobble.models.pfnn.network import Pfnn

        return Pfnn.read(path, arrays, common)

    def read_folder(self, folder: Path) -> Mapping[str, np.ndarray] | None:
        from hobble.models.pfnn.release import read_release

        return read_release(folder) if any(folder.glob("*.bin")) else None


MODEL = _Pfnn()
