"""Small networks that need no data: one with random weights, one with a constant prediction."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from hobble.channels import channel as channel_named
from hobble.core.skeleton import Skeleton, forward_kinematics
from hobble.models.pfnn import Pfnn
from hobble.rows.layout import RowLayout
from tests.engine.networks import layers

MakeNetwork = Callable[..., Pfnn]


def mean_output(skeleton: Skeleton, layout: RowLayout, speed: float, turn: float) -> np.ndarray:
    """Y of a figure in its rest pose that glides ahead at `speed` and turns by `turn` (the sign of Y) a
    frame."""
    y = np.zeros(layout.y_size, np.float32)
    rest = np.tile([1.0, 0, 0, 0], (1, layout.joints, 1))
    positions = forward_kinematics(skeleton, rest, np.array([[0.0, 93.0, 0.0]]))[1][0]
    velocity = np.zeros((layout.joints, 3))
    velocity[:, 2] = speed
    y[layout.y_root_velocity] = 0, speed
    y[layout.y_turn] = turn
    y[layout.y_phase_change] = 0.017
    y[layout.y_position][layout.future :] = speed * layout.step * np.arange(layout.future)
    y[layout.y_direction][layout.future :] = 1
    y[layout.y_joint_position] = positions.ravel()
    y[layout.y_joint_velocity] = velocity.ravel()
    return y


@pytest.fixture
def make_network(holden31: Skeleton) -> MakeNetwork:
    """make(links=0, scale=1.0, speed=1.5, turn=0.0, control_points=4); scale 0 predicts the mean output."""

    def make(
        links: int = 0,
        channel: str = "injury",
        scale: float = 1.0,
        speed: float = 1.5,
        turn: float = 0.0,
        control_points: int = 4,
        skeleton: Skeleton = holden31,
    ) -> Pfnn:
        layout = RowLayout(len(skeleton.joints), channels=((channel, links),) if links else ())
        weights, biases = layers(
            np.random.default_rng(5), control_points, (layout.x_size, 23, 17, layout.y_size)
        )
        return Pfnn(
            weights=(*weights[:-1], np.float32(scale) * weights[-1]),
            biases=(*biases[:-1], np.float32(scale) * biases[-1]),
            x_mean=np.zeros(layout.x_size, np.float32),
            x_std=np.full(layout.x_size, 20, np.float32),
            y_mean=mean_output(skeleton, layout, speed, turn),
            y_std=np.full(layout.y_size, 0.05, np.float32),
            layout=layout,
            skeleton=skeleton,
            channels={channel: channel_named(channel).columns(skeleton)[:links]} if links else {},
        )

    return make


@pytest.fixture
def network(make_network: MakeNetwork) -> Pfnn:
    """A network with random weights whose figure glides, without severities."""
    return make_network()


@pytest.fixture
def steady(make_network: MakeNetwork) -> Pfnn:
    """A network that predicts a figure gliding straight ahead at 1.5 cm a frame, for any input."""
    return make_network(scale=0.0)


@pytest.fixture
def hurtable(make_network: MakeNetwork) -> Pfnn:
    """A network with random weights and 30 severities, all of which were above 0 in training."""
    made = make_network(links=30)
    mean = made.x_mean.copy()
    mean[made.layout.x_channel("injury")] = 0.5
    return replace(made, x_mean=mean)
