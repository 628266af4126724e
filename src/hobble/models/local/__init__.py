"""A mixture of experts gated by local phases (Starke, Zhao, Komura, Zaman 2020).

Each foot and hand has a phase of its own (`hobble.labels.local_phase`), so that motion without a gait cycle
can be learned. The network predicts the phases of the next frame with the pose. The gate gets the phases
alone, and where the character is to go. As in the publication, the inputs have the joints' rotations, too.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.labels.local_phase import PARTS
from hobble.models.mann import GOAL_INPUTS, Mann, MannOptions, goal_columns
from hobble.rows.layout import RowLayout

if TYPE_CHECKING:
    from hobble.models.local.predictor import LocalPredictor


class LocalOptions(MannOptions):
    """Experts gated by local phases, see `local_phases` in a data set's section `database`.

    experts, gate_layers, gate_units: as for `mann`.
    """

    network: ClassVar[str] = "hobble.models.local:Local"

    kind: Literal["local"] = "local"  # type: ignore[assignment]
    gate_inputs: ClassVar[int] = 2 * len(PARTS) + GOAL_INPUTS
    uses_local_phases: ClassVar[bool] = True

    def gate_columns(self, layout: RowLayout, skeleton: Skeleton) -> tuple[int, ...]:
        """The local phases, the gait now and at the end of the trajectory, and the trajectory's end."""
        phases = range(layout.x_local_phase.start, layout.x_local_phase.stop)
        return *phases, *goal_columns(layout)


OPTIONS = LocalOptions


@dataclass(frozen=True)
class Local(Mann):
    """A network of K experts, gated by local phases.

    At run time a character remembers its local phases and the predicted rotations of its joints. The
    network's inputs of them are taken from there, and not from X.
    """

    kind: ClassVar[str] = "local"
    description: ClassVar[str] = "network of experts that are gated by local phases"

    @property
    def memory_size(self) -> int:
        """As in `Network`: see `hobble.models.local.predictor`."""
        return 1 + self.remembered.stop - self.remembered.start

    @cached_property
    def remembered(self) -> slice:
        """The columns of X that a character remembers: the local phases, then the rotations of its joints."""
        return slice(self.layout.x_local_phase.start, self.layout.x_joint_rotation.stop)

    @property
    def start(self) -> Array:
        """What a character remembers when it starts."""
        facts = self.training_facts
        return (self.x_mean if facts is None else facts.start_x)[self.remembered].astype(float)

    def memory_of(self, x: Array) -> Array:
        """As in `Network`."""
        return np.hstack([np.ones((len(x), 1)), x[:, self.remembered]])

    def prepared(self, mode: str, storage: str) -> LocalPredictor:
        """As in `Network`."""
        from hobble.models.local.predictor import LocalPredictor

        return LocalPredictor(self, mode, storage)

    def engine_data(
        self, mode: str, storage: str, inputs: NDArray[np.int64]
    ) -> tuple[dict[str, int], dict[str, np.ndarray]]:
        """As in `Network`."""
        sizes, sections = super().engine_data(mode, storage, inputs)
        return sizes | {"latent": self.layout.local_phases}, sections | {"remembered": self.start}
