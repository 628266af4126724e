"""Keeps a network symmetric during its training: mirrored inputs then give exactly the mirrored outputs.

A data set with `mirror: true` has every clip and its mirror image, so the network that fits it best is
symmetric. But the first weights and the order of the samples are not symmetric, and the difference between
left and right grows during the training. A symmetric network also learns more: a clip with a hurt right thigh
shows it how a hurt left thigh moves, too.
"""

from __future__ import annotations

from hobble.core.skeleton import Skeleton
from hobble.database.reader import Database
from hobble.models.layer_mirror import LayerSymmetry
from hobble.models.trainable import Trainable
from hobble.rows.mirror_columns import mirror_of_x, mirror_of_y

# The network is made symmetric after every 16 steps. To do so after each step would take longer and would not
# improve the weights.
STEPS_BETWEEN = 16


class Symmetry:
    """Keeps a network symmetric while it trains on a database.

    The property `why_not_symmetric` of the network's options must be empty; else it says why the network
    cannot be symmetric. Raises HobbleError if the skeleton has no mirror image, or if left and right columns
    are standardised differently.
    """

    def __init__(self, network: Trainable, database: Database) -> None:
        layout, statistics = database.layout, database.statistics
        skeleton = Skeleton.from_dict(database.skeleton)
        inputs = mirror_of_x(layout, skeleton).for_standardised_rows(statistics.x_mean, statistics.x_std)
        outputs = mirror_of_y(layout, skeleton).for_standardised_rows(statistics.y_mean, statistics.y_std)
        mirrors = network.mirrors(inputs, outputs)
        self.layers = [
            LayerSymmetry(layer, mirror) for layer, mirror in zip(network.layers, mirrors, strict=True)
        ]

    def make_new_network_symmetric(self) -> None:
        """Make the random weights of a new network symmetric.

        Each weight becomes the mean of two independent random weights, which halves the variance. So the
        weights, but not the biases, are then multiplied by sqrt(2).
        """
        self.enforce()
        for symmetry in self.layers:
            symmetry.layer[:, :, :-1].mul_(2**0.5)
        self.enforce()  # again, because the symmetric biases depend on the weights

    def after_step(self, steps: int) -> None:
        """Make the network symmetric after some of the steps. Call this after each step.

        steps: number of steps of the whole training so far.
        """
        if steps % STEPS_BETWEEN == 0:
            self.enforce()

    def enforce(self) -> None:
        """Make the network symmetric."""
        for symmetry in self.layers:
            symmetry.enforce()
