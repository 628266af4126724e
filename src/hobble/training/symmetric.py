"""Keep a network in training symmetric: mirrored inputs give exactly the mirrored outputs.

A data set with `mirror: true` has every clip and its mirror image, so its best network is symmetric. But the
first weights and the order of the samples are not, and the difference between left and right grows with the
training. A symmetric network also learns from each sample for both sides: how a hurt left thigh moves, from
clips with a hurt right one.
"""

from __future__ import annotations

from hobble.core.skeleton import Skeleton
from hobble.database.reader import Database
from hobble.models.layer_mirror import LayerSymmetry
from hobble.models.trainable import Trainable
from hobble.rows.mirror_columns import mirror_of_x, mirror_of_y

EVERY = 16  # steps between enforcements; one after each step would take longer and not improve the weights


class Symmetry:
    """Keeps a network symmetric while it trains on a database.

    The property `why_asymmetric` of the network's options must be empty. Raises HobbleError if the skeleton
    has no mirror image, or if left and right columns are standardised differently.
    """

    def __init__(self, network: Trainable, database: Database) -> None:
        layout, statistics = database.layout, database.statistics
        skeleton = Skeleton.from_dict(database.skeleton)
        inputs = mirror_of_x(layout, skeleton).standardised(statistics.x_mean, statistics.x_std)
        outputs = mirror_of_y(layout, skeleton).standardised(statistics.y_mean, statistics.y_std)
        mirrors = network.mirrors(inputs, outputs)
        self.layers = [
            LayerSymmetry(layer, mirror) for layer, mirror in zip(network.layers, mirrors, strict=True)
        ]

    def start(self) -> None:
        """Make new weights symmetric.

        This makes a weight the mean of two independent ones. It is multiplied by sqrt(2) to restore the
        variance.
        """
        self.enforce()
        for symmetry in self.layers:
            symmetry.layer[:, :, :-1].mul_(2**0.5)
        self.enforce()  # the biases depend on the weights

    def after(self, steps: int) -> None:
        """Call after each step. steps: number of all steps so far."""
        if steps % EVERY == 0:
            self.enforce()

    def enforce(self) -> None:
        """Make the network symmetric."""
        for symmetry in self.layers:
            symmetry.enforce()
