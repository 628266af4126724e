"""Keep a network in training symmetric: mirrored inputs give exactly the mirrored outputs.

A data set with `mirror: true` has every clip and its mirror image, so its best network is symmetric. But the
first weights and the order of the samples are not, and the difference between left and right grows with the
training. A symmetric network also learns from each sample for both sides: a left thigh from the clips of a
right one.
"""

from __future__ import annotations

from hobble.core.skeleton import Skeleton
from hobble.database.reader import Database
from hobble.models.layer_mirror import LayerSymmetry
from hobble.models.trainable import Trainable
from hobble.rows.mirror_columns import mirror_of_x, mirror_of_y

EVERY = 16  # steps; after each step it would take longer and the weights would not be better


class Symmetry:
    """The symmetry of a network that trains on a database, for options whose `why_asymmetric` is empty.

    Raises HobbleError if the skeleton has no mirror image, or if the rows are scaled differently on both
    sides.
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

        A weight becomes the mean of two independent ones, so it is multiplied by sqrt(2): the variance stays.
        """
        self.enforce()
        for one in self.layers:
            one.layer[:, :, :-1].mul_(2**0.5)
        self.enforce()  # the biases depend on the weights

    def after(self, steps: int) -> None:
        """Call after each step. steps: number of all steps so far."""
        if steps % EVERY == 0:
            self.enforce()

    def enforce(self) -> None:
        """Make the network symmetric."""
        for one in self.layers:
            one.enforce()
