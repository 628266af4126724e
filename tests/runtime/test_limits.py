"""Speed limits: a target speed above the limit is lowered to it, and a body that cannot jog walks."""

from dataclasses import replace

import numpy as np
import pytest

from hobble.channels.speed_limits import UNLIMITED, Limits
from hobble.models.network import Network
from hobble.runtime.animation import ProceduralAnimation

KNEE, ARM = "LeftUpLeg-LeftLeg", "LeftArm-LeftForeArm"
WALK, JOG = 1, 2


@pytest.fixture
def limited(make_network) -> Network:
    """A gliding network. An injury of the knee at 10 halves the speed of the walk, one at 9 makes a jog
    impossible; an arm takes a tenth of the speed.
    """
    network = make_network(links=30, scale=0.0)
    speeds = np.full((6, 30, 2), UNLIMITED)
    speeds[WALK], speeds[JOG] = 2.0, 7.0
    knee, arm = (network.channels["injury"].index(link) for link in (KNEE, ARM))
    speeds[WALK, knee, 1], speeds[JOG, knee, 1] = 1.0, 1.0
    speeds[WALK, arm, 1], speeds[JOG, arm, 1] = 1.8, 6.3
    return replace(network, limits={"injury": Limits(np.array([0.0, 10.0]), speeds, speeds.max(axis=(1, 2)))})


def speed_and_gait(
    network: Network, velocity, hurt, gait=None, frames: int = 90, **options
) -> tuple[float, np.ndarray]:
    """The target speed after some seconds, and the shares of the gaits."""
    animation = ProceduralAnimation(network, **{"steering": 0.0, **options})
    for _ in range(frames):
        animation.next_pose(velocity, gait=gait, injury=hurt)
    middle = network.layout.window
    return float(np.hypot(*animation.state.smoothed_velocity[0])), animation.state.gait[0, middle]


@pytest.mark.parametrize(
    ("hurt", "speed"),
    [({}, 2.5), ({KNEE: 10}, 1.0), ({KNEE: 5}, 1.5), ({ARM: 10}, 1.8), ({KNEE: 5, ARM: 10}, 1.48955)],
)
def test_the_target_speed_is_limited_by_all_injuries(limited: Network, hurt, speed: float) -> None:
    for velocity in ((0, 2.5), (2.5, 0)):
        assert speed_and_gait(limited, velocity, hurt)[0] == pytest.approx(speed, abs=1e-5)
    assert speed_and_gait(limited, (0, 2.5), hurt, limits=False)[0] == pytest.approx(2.5, abs=1e-6)


def test_a_body_that_cannot_jog_walks_a_little_faster_instead(limited: Network) -> None:
    speed, gait = speed_and_gait(limited, (0, 7.0), {KNEE: 9})
    assert speed == pytest.approx(1.25 * 1.1, abs=1e-6)
    assert gait[WALK] > 0.98
    speed, gait = speed_and_gait(limited, (0, 7.0), {KNEE: 6})  # 3.4 is a jog still
    assert speed == pytest.approx(3.4, abs=1e-6)
    assert gait[JOG] > 0.99
    assert speed_and_gait(limited, (0, 7.0), {KNEE: 8}, limits=False)[1][JOG] > 0.99
