"""Blocks of X are found by name, so the order of the channels does not matter."""

from dataclasses import replace

import numpy as np
import pytest

from hobble.models.pfnn import Pfnn
from hobble.rows.layout import RowLayout
from hobble.runtime.animation import ProceduralAnimation

ORDERS = [
    ("position", "direction", "gait", "injury", "joint_position", "joint_velocity", "terrain"),
    ("injury", "terrain", "joint_velocity", "joint_position", "gait", "direction", "position"),
]


def columns(layout: RowLayout, ordered: RowLayout) -> np.ndarray:
    """The place of each column of `ordered` in `layout`."""
    blocks = layout.blocks("x")
    return np.concatenate([np.arange(layout.x_size)[blocks[name]] for name in ordered.blocks("x")])


@pytest.mark.parametrize("order", ORDERS)
def test_the_order_of_channel_columns_does_not_matter(hurtable: Pfnn, order: tuple[str, ...]) -> None:
    ordered = replace(hurtable.layout, order=order)
    at = columns(hurtable.layout, ordered)
    moved = replace(
        hurtable,
        layout=ordered,
        weights=(np.ascontiguousarray(hurtable.weights[0][:, :, at]), *hurtable.weights[1:]),
        x_mean=hurtable.x_mean[at],
        x_std=hurtable.x_std[at],
    )
    here, there = ProceduralAnimation(hurtable), ProceduralAnimation(moved)
    for frame in range(60):
        hurt = {"LeftUpLeg-LeftLeg": min(10.0, frame / 3)}
        a, b = (
            one.next_pose((0.5, 2.0), gait="walk", terrain=lambda x, z: 0.1 * x, injury=hurt)
            for one in (here, there)
        )
    # The sums of the first layer run in another order.
    np.testing.assert_allclose(b.positions, a.positions, atol=2e-3)
