"""Wrong arguments of `next_pose` are refused, and a failed call changes nothing."""

import copy

import numpy as np
import pytest

from hobble.runtime import ProceduralAnimation
from hobble.runtime.waypoints import Waypoint
from tests.runtime.walking import KNEE, same, walk

SHARES = r"gait shares have to be \(6,\) or \(2, 6\) .* order: stand, walk"
# Arguments for two characters, and the message.
CALLS = [
    ({"target_velocity": (0, np.nan)}, "target_velocity is not a finite vector"),
    ({"target_velocity": (0, 1, 2, 3)}, r"target_velocity has to be a vector .* not of shape \(4,\)"),
    ({"target_velocity": (0, 31.0)}, "faster than a body"),
    ({"facing": np.ones((3, 2))}, r"facing has to be a vector of 2 or 3 .* of 2, not of shape \(3, 2\)"),
    ({"gait": np.ones((3, 6), int)}, SHARES),
    ({"gait": [np.inf, 0, 0, 0, 0, 0]}, SHARES),
    ({"terrain": lambda x, z: 1e30 + 0 * x}, "a height of 1e\\+30"),
    ({"terrain": lambda x, z: x * np.nan}, "heights that are not finite"),
    ({"terrain": lambda x, z: np.zeros(2)}, r"terrain returned heights of shape \(2,\) for 72 points"),
    ({"injury": {KNEE: 10.5}}, r"the severity of LeftUpLeg-LeftLeg is 10.5.* from 0 to 10"),
    ({"injury": np.ones(29)}, r"injury has to have shape \(30,\) or \(2, 30\), not \(29,\)"),
    ({"injury": {KNEE: [1, 2, 3]}}, r"one severity for all .* 2, one for each; its shape is \(3,\)"),
    ({"injury": {"LeftUpLeg-LeftFoot": 1}}, "did you mean .*LeftUpLeg-LeftLeg"),
]


@pytest.mark.parametrize(("call", "message"), CALLS)
def test_an_impossible_call_is_refused_and_changes_nothing(hurtable, call: dict, message: str) -> None:
    character = ProceduralAnimation(hurtable, characters=2)
    walk(character, 5, injury={KNEE: 3.0})
    before = copy.deepcopy(character.state)
    with pytest.raises((ValueError, KeyError), match=message):
        character.next_pose(**{"target_velocity": (0.5, 2.0), "injury": {KNEE: 9.0}, **call})
    assert same(before, character.state)
    assert np.isfinite(character.next_pose((0.5, 2.0)).positions).all()


def test_wrong_options_are_refused(network) -> None:
    for options, message in (
        ({"steering": np.nan}, "steering is nan, but has to be"),
        ({"scales": {"injury": 0}}, "the scale of injury is 0, but has to be more than 0"),
        ({"position": (1e30, 0)}, "100 km"),
        ({"mode": "quadratic"}, "constant, linear, cubic"),
        ({"storage": "float8"}, "float32, int16"),
        ({"waypoints": [Waypoint((0, 0), "walk", 2)]}, "two waypoints"),
    ):
        with pytest.raises(ValueError, match=message):
            ProceduralAnimation(network, **options)
    with pytest.raises(KeyError, match=r"no gait 'jogging'; did you mean jog\?"):
        ProceduralAnimation(network, waypoints=[Waypoint((0, 0), "walk", 2), Waypoint((9, 0), "jogging", 2)])


def test_a_failed_frame_leaves_no_trace(hurtable) -> None:
    """The ground is looked up twice in a frame. Both calls are tried, also in the first frame."""

    def hills(x, z):
        return 40 + 0.2 * z

    for failing in (0, 1, 40, 41):
        whole, disturbed = ProceduralAnimation(hurtable), ProceduralAnimation(hurtable)
        looks = iter(range(10**6))

        def once(x, z, looks=looks, failing=failing):
            if next(looks) == failing:
                raise OSError("gone")
            return hills(x, z)

        for frame in range(40):
            pose = whole.next_pose((0, 2.0), terrain=hills)
            if frame == failing // 2:
                with pytest.raises(OSError, match="gone"):
                    disturbed.next_pose((0, 2.0), terrain=once, injury={KNEE: 8.0})
            again = disturbed.next_pose((0, 2.0), terrain=once)
            np.testing.assert_array_equal(again.positions, pose.positions)
            np.testing.assert_array_equal(again.root, pose.root)
