"""The formula in the network's file describes the layers."""

from __future__ import annotations

from hobble.models.pfnn.trainable import untrained_network


def test_the_formula_shows_each_hidden_layer() -> None:
    three = untrained_network((9, 8, 7, 6, 5), 4, 1).file_metadata["network"]
    assert three.startswith("y = W3 elu(W2 elu(W1 elu(W0 x + b0) + b1) + b2) + b3 on standardised x and y")
    assert (
        untrained_network((9, 8, 5), 4, 1)
        .file_metadata["network"]
        .startswith("y = W1 elu(W0 x + b0) + b1 on")
    )
