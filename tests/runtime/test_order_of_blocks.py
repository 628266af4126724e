"""Blocks of X are found by name, so the order of the channels does not matter."""

from dataclasses import replace

import numpy as np
import pytest

from hobble.models.pfnn import Pfnn
from hobble.rows.layout import RowLayout, compose, frame_inputs
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
def test_blocks_of_columns_may_be_in_any_order(order: tuple[str, ...]) -> None:
    layout = RowLayout(3, channels=(("injury", 4),))
    ordered = replace(layout, order=order)
    rng = np.random.default_rng(2)
    x, y = np.zeros((2, layout.x_size)), np.zeros((2, layout.y_size))
    other_x, other_y = np.zeros_like(x), np.zeros_like(y)
    body = rng.normal(size=(2, layout.x_size - 3 * layout.samples - 4))
    values = {"injury": rng.uniform(0, 10, (2, 4))}
    ground, lift = rng.normal(size=(2, 3 * layout.samples)), rng.normal(size=(2, 1))
    compose(layout, frame_inputs(layout, body, values), ground, lift, x, y)
    compose(ordered, frame_inputs(ordered, body, values), ground, lift, other_x, other_y)
    np.testing.assert_array_equal(other_x, x[:, columns(layout, ordered)])
    np.testing.assert_array_equal(other_y, y)


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
