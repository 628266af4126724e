"""A body with a badly hurt leg comes to a step as the right leg swings."""

import numpy as np
import pytest

from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.stairs import FIRST_DOWN_CM, LANDS, OVER_CM, joins, leg_of_columns, time_steps
from tests.runtime.conftest import MakeNetwork

EDGE = 200.0  # cm ahead of the start


def landing_phases(join: float, rise: float) -> Array:
    """(16,) phases of bodies that begin at 16 phases, as the edge of the ground is as near as it should."""
    over = FIRST_DOWN_CM if rise < 0 else OVER_CM
    place, phase, at_edge = np.zeros((16, 2)), np.arange(16) / 16, np.full(16, np.nan)
    for _ in range(600):
        velocity = np.tile([0.0, 1.0], (16, 1))
        speed, each = np.ones(16), np.full(16, join)
        pace, slower = time_steps(lambda x, z: rise * (z > EDGE), place, velocity, speed, phase % 1, each)
        before, phase = place[:, 1], phase + pace / 80
        place = place + velocity * slower[:, None]
        passed = (before < EDGE - over) & (place[:, 1] >= EDGE - over)
        at_edge = np.where(passed, phase % 1, at_edge)
    return at_edge


@pytest.mark.parametrize(
    ("join", "rise", "first"), [(1, 15, "left"), (1, -15, "right"), (-1, 15, "right"), (-1, -15, "left")]
)
def test_the_good_leg_goes_first_up_and_the_bad_one_down(join: float, rise: float, first: str) -> None:
    away = landing_phases(join, rise) - LANDS[("left", "right").index(first)]
    assert np.abs((away + 0.5) % 1 - 0.5).max() < 0.06


@pytest.mark.parametrize(("join", "rise"), [(0, 15), (1, 3)])
def test_a_mild_injury_or_a_low_edge_changes_nothing(join: float, rise: float) -> None:
    reached = np.sort(landing_phases(join, rise))
    assert np.ptp(np.diff(reached)) < 0.02, "bodies reach the edge at all phases"


@pytest.mark.parametrize(("join", "cycles"), [(1, 1.0), (0, 0.4)])
def test_on_stairs_a_body_takes_a_tread_with_each_cycle(join: float, cycles: float) -> None:
    place, phase, speed = np.zeros((8, 2)), np.arange(8) / 8, np.ones(8)
    for frame in range(800):
        velocity, stairs = np.tile([0.0, 1.0], (8, 1)), lambda x, z: 17.0 * np.floor(np.maximum(z, 100) / 29)
        pace, slower = time_steps(stairs, place, velocity, speed, phase % 1, np.full(8, join))
        place, phase, speed = place + velocity * slower[:, None], phase + pace / 72, slower
        if frame == 300:
            start = place[:, 1] / 29 - phase / cycles
    # Neither a fixed speed nor a fixed pace stays in step for 500 frames.
    assert np.abs(place[:, 1] / 29 - phase / cycles - start).max() < 0.5


def test_only_legs_count_and_the_worse_one_goes_last_up(holden31: Skeleton) -> None:
    links = ["LeftUpLeg-LeftLeg", "RightFoot-RightToeBase", "Spine-Spine1", "RightArm-RightForeArm", "other"]
    leg = leg_of_columns(holden31, links)
    assert leg.tolist() == [1, 2, 0, 0, 0]
    severity = np.array(
        [[10, 0, 0, 0, 0], [0, 7, 10, 10, 10], [0, 6, 0, 0, 0], [10, 10, 0, 0, 0], [5, 0, 9, 9, 9]]
    )
    assert joins(severity.astype(float), leg).tolist() == [-1, 1, 0.5, 0, 0]


def test_the_character_changes_its_speed_and_pace_before_a_step_only_if_a_leg_hurts(
    make_network: MakeNetwork, holden31: Skeleton
) -> None:
    network = make_network(links=len(holden31.links))
    character = ProceduralAnimation(network, characters=2)
    severity = np.zeros((2, len(holden31.links)))
    severity[1, holden31.link_names.index("LeftUpLeg-LeftLeg")] = 10
    for _ in range(120):
        pose = character.next_pose((0, 1.5), injury=severity, terrain=lambda x, z: 15.0 * (z > 300))
    assert character._controller.pace[0] == 1.0
    assert character._controller.pace[1] != 1.0
    character.next_pose((0, 1.5), terrain=lambda x, z: 0 * z)
    assert character._controller.pace.tolist() == [1.0, 1.0]
    assert np.isfinite(pose.positions).all()
